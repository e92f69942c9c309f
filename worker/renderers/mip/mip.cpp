// The pixel half of intensity projections: the largest, the least or the mean sample along each ray. docs/rendering.md defines them.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "common/renderers/mip/projection_mode.h"
#include "worker/rays/bounds_cache.h"
#include "worker/rays/project.h"
#include "worker/rays/render_pieces.h"
#include "worker/rays/stretch_tables.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::mip {
namespace {

// A field as it is projected: the volume, or another field.
struct Projected {
  const std::vector<RayPiece>* pieces = nullptr;
  const std::vector<SampleBounds>* bounds = nullptr;
  const std::vector<SampleBounds>* opposite = nullptr;  // of the mean alone
  float sign = 1;
  ValueScale values;
  std::optional<FieldMap> map = {};  // of another field
};
Projected ProjectedFrom(BoxData& data, const TransferFunction& transfer, const ValueRange& range, const ValueMapping& mapping,
                        ProjectionMode mode) {
  // If data values fall as stored samples rise, the largest value belongs to the least sample.
  const bool largest = (mode == ProjectionMode::kMaximum) == (mapping.scale >= 0);
  const auto [least, largest_value] = ProjectedValuesOf(transfer, range);
  Projected field = {.pieces = &data.CacheOf<RayVolume>().PiecesOf(data),
                     .sign = largest ? 1.0F : -1.0F,
                     .values = MakeValueScale(least, largest_value, mapping)};
  field.bounds = &data.CacheOf<BoundsCache>().Of(*field.pieces, field.sign);
  if (mode == ProjectionMode::kMean) field.opposite = &data.CacheOf<BoundsCache>().Of(*field.pieces, -field.sign);
  return field;
}

class MipRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    StageClock clock(report);
    const ProjectionMode mode = ModeOf(setup);
    const Projected volume = ProjectedFrom(data, setup.transfer, setup.range, setup.description.mapping, mode);
    const Result<std::vector<Projected>> others = OthersOf(data, at, setup);
    if (!others.ok()) return others.status();
    clock.Charge(Stage::kPrepare);

    const ViewRays rays = MakeViewRays(setup.camera, setup.description.geometry, SamplesPerVoxel(setup), setup.clip);
    std::optional<StretchTables> stretch;
    if (setup.description.geometry.rectilinear()) stretch.emplace(setup.description.geometry.stretch);
    const FragmentOrder order(setup);
    const auto work_of = [&](const Projected& field, const RayBox& box, std::size_t piece, const PixelBounds& tile) {
      return ProjectWork{.rays = &rays,
                         .box = &box,
                         .field = field.map ? &*field.map : nullptr,
                         .bounds = &(*field.bounds)[piece],
                         .sign = field.sign,
                         .values = field.values,
                         .complement = mode == ProjectionMode::kMinimum,
                         .nearest = TakesNearestVoxel(setup),
                         .shapes = TileOf(data.shapes(), tile),
                         .order = &order,
                         .opposite = field.opposite == nullptr ? nullptr : &(*field.opposite)[piece]};
    };
    LocalImage image = RenderPieces(
        *volume.pieces, {at, setup, rays, hidden, control, report, stretch ? &*stretch : nullptr},
        [&](std::size_t /*piece*/) { return kEverywhere; },
        [&](std::size_t piece, const RayBox& ray_box, const PixelBounds& tile, std::uint8_t /*steps*/, float* pixels,
            std::size_t floats_a_row) {
          ProjectTile(work_of(volume, ray_box, piece, tile), tile, pixels, floats_a_row);
          if (setup.fields.empty()) return;
          const auto width = std::size_t(tile.width()), height = std::size_t(tile.height());
          const auto for_each_pixel = [&](auto&& visit) {
            for (std::size_t y = 0; y < height; ++y) {
              for (std::size_t x = 0; x < width; ++x) visit(pixels + y * floats_a_row + 4 * x, 4 * (y * width + x));
            }
          };
          for_each_pixel([](float* pixel, std::size_t) { TurnIntoChannel(pixel, 0, pixel); });
          std::vector<float> own;
          for (std::size_t i = 0; i < others->size(); ++i) {
            const Projected& field = (*others)[i];
            if (field.pieces == nullptr) continue;
            RayBox box = BoxOfVoxels(field.pieces->front().voxels, field.pieces->front().cells.counts);
            box.low = ray_box.low;
            box.high = ray_box.high;
            box.reach = ray_box.reach;
            own.assign(4 * width * height, 0);
            ProjectTile(work_of(field, box, 0, tile), tile, own.data(), 4 * width);
            for_each_pixel([&](float* pixel, std::size_t at_own) { TurnIntoChannel(&own[at_own], 1 + i, pixel); });
          }
        });
    return clock.Finish(std::move(image), control);
  }

 private:
  // The other fields of the frame. Without pieces: the field does not reach there.
  static Result<std::vector<Projected>> OthersOf(BoxData& data, const LevelBox& at, const FrameSetup& setup) {
    std::vector<Projected> others;
    if (setup.fields.empty()) return others;
    if (ModeOf(setup) == ProjectionMode::kMean) return Status::InvalidArgument("the mean is of one field: show one, or their maximum");
    if (setup.fields.size() >= kMostFields) {
      return Status::InvalidArgument(
          fmt::format("an intensity projection shows at most {} fields, not {}", kMostFields, 1 + setup.fields.size()));
    }
    for (std::size_t i = 0; i < setup.fields.size(); ++i) {
      const FieldSetup& field = setup.fields[i];
      Projected& projected = others.emplace_back();
      if (data.fields()[i] == nullptr) continue;
      projected = ProjectedFrom(*data.fields()[i], field.look.transfer, field.look.range, LevelOf(field, at.level).description.mapping,
                                ModeOf(setup));
      if (projected.pieces->size() > 1) return TooLargeForRays(i);
      projected.map = MakeFieldMap(at, setup, field);
    }
    return others;
  }

  // What ProjectTile found of a field, as the frame's pixels hold it among what other fields have.
  static void TurnIntoChannel(const float* found, std::size_t channel, float* pixel) {
    if (!(found[3] > 0)) return;
    const float value = 0.5F + 0.5F * found[0];
    if (channel == 0) pixel[0] = pixel[3] = 0;
    pixel[3] = std::max(pixel[3], kOfOthers);
    pixel[channel] = value;
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<MipRenderer>(); }

}  // namespace slabstream::mip
