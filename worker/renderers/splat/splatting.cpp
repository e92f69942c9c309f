// The splatting pipeline (Westover 1990, one sheet a slice): transform, shade, splat, composite. docs/rendering.md defines what it
// computes.
#include <vector>

#include "worker/renderers/for_each_piece.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/splat/splat_band.h"
#include "worker/renderers/splat/splat_cache.h"
#include "worker/renderers/splat/splat_pass.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::splat {
namespace {

// Rows of a band: few enough to stay in the second-level cache with their beams, enough that few voxels are shaded twice.
constexpr std::int32_t kBandRows = 64;

void RenderBand(const SplatPass& pass, std::int32_t y_begin, const RenderControl& control, LocalImage& image, RankReport& report) {
  const std::int32_t y_end = std::min(y_begin + kBandRows, pass.bounds.y_end);
  const auto pixel = [&](std::int32_t y) { return std::size_t(y - pass.bounds.y_begin) * std::size_t(pass.bounds.width()); };
  MakeEmpty(image, pixel(y_begin), pixel(y_end));
  SplatBand band(pass, y_begin, y_end, image, report);
  const Axis c = pass.cells.axes.c;
  const std::int32_t first = pass.cells.occupied.begin[c], last = pass.cells.occupied.end[c];
  const std::int32_t begin = pass.shapes == nullptr ? first : pass.box.begin[c], end = pass.shapes == nullptr ? last : pass.box.end[c];
  for (std::int32_t i = 0; i < end - begin && !band.finished() && !control.cancelled(); ++i) {
    const std::int32_t k = pass.setup.camera.ascending ? begin + i : end - 1 - i;
    band.AddFragments(k);
    if (k >= first && k < last) band.AddSlice(k);
  }
  band.Finish();
}

void AddTo(RankReport& sum, const RankReport& part) {
  AddTimes(sum.stage_ns, part.stage_ns);
  sum.drawn_voxels += part.drawn_voxels;
}

class SplattingRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    const Box& box = at.box;
    StageClock clock(report);
    const ClassificationTable& table = data.Classification(setup);
    const OccupiedVoxels& cells = data.CacheOf<SplatCache>().Occupied(data, setup, box);
    report.occupied_voxels += cells.occupied_in_box;
    clock.Charge(Stage::kPrepare);
    LocalImage image = MakeLocalImage(PixelFormat::kRgba, {});
    if (!cells.occupied.empty() || data.shapes() != nullptr) {
      const SplatPass pass(cells, table, setup, box, hidden, data.light(), data.shapes());
      if (!hidden.HidesAll(pass.bounds)) image = MakeUnwrittenImage(PixelFormat::kRgba, pass.bounds);  // bands write it
      clock.Charge(Stage::kTransform);
      const std::int32_t bands = (image.bounds.height() + kBandRows - 1) / kBandRows;
      std::vector<RankReport> parts(static_cast<std::size_t>(bands));
      ForEachPiece(bands, control,
                   [&](std::int32_t i) { RenderBand(pass, pass.bounds.y_begin + i * kBandRows, control, image, parts[std::size_t(i)]); });
      for (const RankReport& part : parts) AddTo(report, part);
    }
    return clock.Finish(std::move(image), control);
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<SplattingRenderer>(); }

}  // namespace slabstream::splat
