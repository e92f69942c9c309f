// The planning half of intensity projections: every box draws, since any may hold a ray's extreme; values become colours at the end.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/calibration/calibration.h"
#include "common/image/local_image.h"
#include "common/image/resolve.h"
#include "common/renderers/mip/projection_mode.h"
#include "common/renderers/renderer_kind.h"
#include "common/renderers/sampling_rate.h"

namespace slabstream::mip {
namespace {

// Premultiplied colours of values in [0, 1], interpolated between kMaxBins places.
class ColorTable {
 public:
  explicit ColorTable(const FrameSetup& setup) : entries_(std::size_t{kMaxBins} + 1) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const double t = std::min(double(i) / (kMaxBins - 1), 1.0);
      const double data = double(setup.range.min) + t * (double(setup.range.max) - double(setup.range.min));
      const auto opacity = float(setup.transfer.Opacity(data));
      const Rgb color = setup.transfer.Color(data);
      entries_[i] = {opacity * color.r, opacity * color.g, opacity * color.b, opacity};
    }
  }

  void Look(double value, float* rgba) const {
    const double place = value * (kMaxBins - 1);
    const auto below = std::size_t(place);
    const auto t = float(place - double(below));
    for (std::size_t c = 0; c < 4; ++c) rgba[c] = entries_[below][c] + t * (entries_[below + 1][c] - entries_[below][c]);
  }

 private:
  std::vector<std::array<float, 4>> entries_;
};

double ValueOf(const float* pixel, ProjectionMode mode) {
  switch (mode) {
    case ProjectionMode::kMaximum: return double(pixel[0]);
    case ProjectionMode::kMinimum: return 1 - double(pixel[0]);
    case ProjectionMode::kMean: break;
  }
  const double sum = double(pixel[0]) * 0x1p-8 + double(pixel[1]) * 0x1p-16 + double(pixel[2]) * 0x1p-24;
  return std::min(sum / double(pixel[3]), 1.0);
}

// The time of a box is that of its samples, along the rays of all pixels that it covers.
class MipCost : public AnalyticCost {
 public:
  explicit MipCost(double sampling_rate) : sampling_rate_(sampling_rate) {}
  double Seconds(const Box& box, const CostView& view) const override {
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    namespace cost = calibration::mip;
    return cost::kBox + cost::kSample * sampling_rate_ * double(box.voxel_count()) * pixels;
  }

 private:
  const double sampling_rate_;
};

class MipKind : public RendererKind {
 public:
  MipKind()
      : RendererKind({.name = "mip",
                      .title = "intensity projection",
                      .purpose = "the largest, least or mean value along each ray, for vessels",
                      .format = PixelFormat::kMaximum,
                      .reach = kHalo,  // 2 would do; like the other renderers, so that all use the same cached voxels
                      .abilities = {Ability::kPerspective},
                      .footprint = 1,
                      .stages = {Stage::kSample},
                      .parameters = {SamplingRate(),
                                     {.name = "projection-mode",
                                      .purpose = "Value of a pixel: the largest, the least or the mean sample along its ray",
                                      .standard = double(ProjectionMode::kMaximum),
                                      .choices = {"maximum", "minimum", "mean"}},
                                     {.name = "interpolation",
                                      .purpose = "Values between voxels: trilinear, or of the nearest voxel",
                                      .standard = 0,
                                      .choices = {"linear", "nearest"}}}}) {}

  PixelFormat FormatOf(const std::vector<double>& parameters) const override {
    return ProjectionMode(int(parameters[1])) == ProjectionMode::kMean ? PixelFormat::kSum : PixelFormat::kMaximum;
  }

  PickRule PickRuleOf(const std::vector<double>& parameters) const override {
    switch (ProjectionMode(int(parameters[1]))) {
      case ProjectionMode::kMaximum: return PickRule::kLargest;
      case ProjectionMode::kMinimum: return PickRule::kLeast;
      case ProjectionMode::kMean: break;
    }
    return PickRule::kNone;
  }

  // A sample of any value may be the one that a pixel shows.
  ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const override {
    ClassificationTable table = Classify(transfer, summary.description, summary.range);
    std::ranges::fill(table.opacity, 1.0F);
    table.max_opacity = 1;
    return table;
  }
  std::unique_ptr<AnalyticCost> MakeCost(const CostBasis& basis) const override {
    return std::make_unique<MipCost>(SamplingRateOf(basis.parameters));
  }

  LocalImage Finish(const LocalImage& frame, const FrameSetup& setup) const override {
    const ColorTable table(setup);
    const ProjectionMode mode = ModeOf(setup);
    LocalImage picture = MakeLocalImage(PixelFormat::kRgba, frame.bounds);
    constexpr std::size_t kGrain = 4096;  // pixels
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, frame.rgba.size() / 4, kGrain), [&](const auto& pixels) {
      for (std::size_t i = pixels.begin(); i < pixels.end(); ++i) {
        const float* const pixel = &frame.rgba[4 * i];
        if (pixel[3] > 0) table.Look(ValueOf(pixel, mode), &picture.rgba[4 * i]);
      }
    });
    return Resolve(picture, setup.camera.supersample);
  }
  bool FrameIsPicture(const FrameSetup& /*setup*/) const override { return false; }
};

}  // namespace

const RendererKind& Kind() {
  static const MipKind kind;
  return kind;
}

}  // namespace slabstream::mip
