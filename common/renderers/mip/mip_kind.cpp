// The planning half of intensity projections: the transfer function colours the value of each ray.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/renderers/mip/projection_mode.h"
#include "common/renderers/projection_kind.h"
#include "common/renderers/sampling_rate.h"

namespace slabstream::mip {
namespace {

// Premultiplied colours of values in [0, 1], interpolated between kMaxBins places among the data values that the function tells apart.
class ColorTable {
 public:
  ColorTable(const TransferFunction& transfer, const ValueRange& range, double weight) : entries_(std::size_t{kMaxBins} + 1) {
    const auto [least, largest] = ProjectedValuesOf(transfer, range);
    const auto [first, last] = NodesOf(transfer);
    const double place = (last - first) / (kMaxBins - 3);  // one more beyond each end
    const double low = std::clamp(first - place, least, largest), high = std::clamp(last + place, low, largest);
    const double extent = high - low;
    if (extent > 0) {
      scale_ = (largest - least) / extent * (kMaxBins - 1);
      offset_ = (least - low) / extent * (kMaxBins - 1);
    }
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const double t = std::min(double(i) / (kMaxBins - 1), 1.0);
      const double data = low + t * extent;
      const auto whole = transfer.Opacity(data);
      const auto opacity = float(weight == 1 ? whole : 1 - std::pow(1 - whole, weight));
      const Rgb color = transfer.Color(data);
      entries_[i] = {opacity * color.r, opacity * color.g, opacity * color.b, opacity};
    }
  }

  void Look(double value, float* rgba) const {
    const double place = std::clamp(value * scale_ + offset_, 0.0, double(kMaxBins - 1));
    const auto below = std::size_t(place);
    const auto t = float(place - double(below));
    for (std::size_t c = 0; c < 4; ++c) rgba[c] = entries_[below][c] + t * (entries_[below + 1][c] - entries_[below][c]);
  }

 private:
  std::vector<std::array<float, 4>> entries_;
  double scale_ = 0, offset_ = 0;  // place = value * scale + offset
};

double ValueOf(const float* pixel, ProjectionMode mode) {
  switch (mode) {
    case ProjectionMode::kMaximum: return double(pixel[0]);
    case ProjectionMode::kMinimum: return 1 - double(pixel[0]);
    case ProjectionMode::kMean: break;
  }
  return std::min(SumOfValues(pixel) / double(pixel[3]), 1.0);
}

class MipKind : public ProjectionKind {
 public:
  MipKind()
      : ProjectionKind({.name = "mip",
                        .title = "intensity projection",
                        .purpose = "the largest, least or mean value along each ray, for vessels",
                        .format = PixelFormat::kMaximum,
                        .reach = kRayReach,
                        .derived_from_stored = kRayDerived,
                        .abilities = {Ability::kPerspective, Ability::kTransfer, Ability::kLevels, Ability::kFields, Ability::kRectilinear,
                                      Ability::kShapes},
                        .parameters = {SamplingRate(),
                                       {.name = "projection-mode",
                                        .purpose = "Value of a pixel: the largest, the least or the mean sample along its ray",
                                        .standard = double(ProjectionMode::kMaximum),
                                        .choices = {"maximum", "minimum", "mean"}},
                                       {.name = "interpolation",
                                        .purpose = "Values between voxels: trilinear, or those of the nearest voxel",
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
    return PickRule::kMean;
  }

  LocalImage Finish(const LocalImage& frame, const FrameSetup& setup) const override {
    const ProjectionMode mode = ModeOf(setup);
    const ColorTable table(setup.transfer, setup.range, setup.weight);
    if (!setup.fields.empty()) return FinishFields(frame, setup, table, mode);
    return ColorPixels(frame, setup, [&](const float* pixel, float* rgba) {
      if (pixel[3] > 0) table.Look(ValueOf(pixel, mode), rgba);
    });
  }

 private:
  // Colours of fields add.
  static LocalImage FinishFields(const LocalImage& frame, const FrameSetup& setup, const ColorTable& volume, ProjectionMode mode) {
    std::vector<ColorTable> tables = {volume};
    for (const FieldSetup& field : setup.fields) tables.emplace_back(field.look.transfer, field.look.range, field.look.weight);
    return ColorPixels(frame, setup, [&](const float* pixel, float* rgba) {
      float transmittance = 1;
      for (std::size_t i = 0; i < std::min(tables.size(), kMostFields); ++i) {
        if (pixel[i] < 0.5F) continue;
        const double value = 2 * double(pixel[i]) - 1;
        std::array<float, 4> of{};
        tables[i].Look(mode == ProjectionMode::kMinimum ? 1 - value : value, of.data());
        for (std::size_t c = 0; c < 3; ++c) rgba[c] = std::min(rgba[c] + of[c], 1.0F);
        transmittance *= 1 - of[3];
      }
      rgba[3] = 1 - transmittance;
    });
  }
};

}  // namespace

const RendererKind& Kind() {
  static const MipKind kind;
  return kind;
}

}  // namespace slabstream::mip
