#include "common/classification/transfer_function.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/range_status.h"
#include "common/classification/mean_color.h"

namespace slabstream {
namespace {

Status WrongField(std::string_view curve, std::size_t point, std::string_view field, double value, std::string_view limit) {
  return Status::InvalidArgument(
      fmt::format("transfer function: {} of {} point {} is {:g}, must be {}", field, curve, point, value, limit));
}

Status CheckCount(std::string_view curve, std::size_t count, bool may_be_none) {
  if ((count >= 1 || may_be_none) && count <= std::size_t{kMaxTransferPoints}) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("transfer function: number of {} points is {}, must be in [1, {}]", curve, count, kMaxTransferPoints));
}

template <class Point>
Status CheckValues(std::string_view curve, const std::vector<Point>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i].value)) return WrongField(curve, i, "value", points[i].value, "finite");
    if (i > 0 && points[i].value < points[i - 1].value) {
      return WrongField(curve, i, "value", points[i].value, fmt::format("at least that of the point before, {:g}", points[i - 1].value));
    }
  }
  return Status::Ok();
}

// Number of points whose value is at most `value`: the segment that holds it ends at this index. Of points at the same value the last
// one counts, so a step takes its upper side.
template <class Point>
std::size_t SegmentEnd(const std::vector<Point>& points, double value) {
  const auto after = [](double v, const Point& point) { return v < point.value; };
  return std::size_t(std::upper_bound(points.begin(), points.end(), value, after) - points.begin());
}

// Where `value` lies between two values, in [0, 1). The values may be as far apart as doubles go.
double Fraction(double value, double from, double to) { return (value / 2 - from / 2) / (to / 2 - from / 2); }

// Opacity at fraction s of the segment a ... b, by the definition of vtkPiecewiseFunction (class documentation of VTK 9.1): s is first
// moved so that the midpoint lies at one half, then a cubic Hermite curve is drawn whose end slopes fall with the sharpness.
double Interpolate(const OpacityPoint& a, const OpacityPoint& b, double s) {
  constexpr double kEdge = 1e-5;  // keeps the two halves of a segment from having no width
  const double midpoint = std::clamp(a.midpoint, kEdge, 1 - kEdge);
  s = s < midpoint ? 0.5 * s / midpoint : 0.5 + 0.5 * (s - midpoint) / (1 - midpoint);

  // Near either end of the range of sharpness the curve is replaced by its limit.
  if (a.sharpness > 0.99) return s < 0.5 ? a.opacity : b.opacity;
  if (a.sharpness < 0.01) return std::lerp(a.opacity, b.opacity, s);

  const double exponent = 1 + 10 * a.sharpness;
  s = s < 0.5 ? 0.5 * std::pow(2 * s, exponent) : 1 - 0.5 * std::pow(2 * (1 - s), exponent);

  const double rise = b.opacity - a.opacity;
  const double end_slope = (1 - a.sharpness) * rise;
  const double ease = s * s * (3 - 2 * s);       // Hermite: from 0 to 1 with flat ends
  const double bow = s * (1 - s) * (1 - 2 * s);  // Hermite: what unit slopes at both ends add
  const auto [low, high] = std::minmax(a.opacity, b.opacity);
  return std::clamp(a.opacity + ease * rise + bow * end_slope, low, high);
}

}  // namespace

Rgb Brightened(Rgb color, double factor) {
  for (float* channel : {&color.r, &color.g, &color.b}) *channel = std::min(float(*channel * factor), 1.0F);
  return color;
}

Rgb TransferFunction::Color(double value) const {
  const std::size_t end = SegmentEnd(colors, value);
  if (colors.empty()) return {};
  if (end == 0) return colors.front().color;
  if (end == colors.size()) return colors.back().color;
  const ColorPoint& a = colors[end - 1];
  const ColorPoint& b = colors[end];
  const auto s = float(Fraction(value, a.value, b.value));
  return {std::lerp(a.color.r, b.color.r, s), std::lerp(a.color.g, b.color.g, s), std::lerp(a.color.b, b.color.b, s)};
}

double TransferFunction::Opacity(double value) const {
  const std::size_t end = SegmentEnd(opacities, value);
  if (opacities.empty()) return 0;
  if (end == 0) return opacities.front().opacity;
  if (end == opacities.size()) return opacities.back().opacity;
  const OpacityPoint& a = opacities[end - 1];
  const OpacityPoint& b = opacities[end];
  return Interpolate(a, b, Fraction(value, a.value, b.value));
}

TransferFunction WithCurvesOfRegions(TransferFunction transfer) {
  if (transfer.regions.empty()) return transfer;
  transfer.colors.clear();
  transfer.opacities.clear();
  // Between these values all trapezoids of MostOpacityAt are linear.
  std::vector<double> values;
  for (const TransferRegion& region : transfer.regions) {
    const auto [least, greatest] = BoundsOf(region);
    for (const double share : {0.0, region.softness / 2, 1 - region.softness / 2, 1.0}) {
      values.push_back(std::lerp(least.value, greatest.value, share));
    }
  }
  std::ranges::sort(values);
  values.erase(std::ranges::unique(values).begin(), values.end());
  // On either side of a value: a hard border makes a step there.
  const auto add = [&](double value, double beside) {
    double most = 0;
    MeanColor mean;
    for (const TransferRegion& region : transfer.regions) {
      const auto [least, greatest] = BoundsOf(region);
      if (!(least.value <= beside && beside <= greatest.value)) continue;
      const double opacity = MostOpacityAt(region, beside);
      most = std::max(most, opacity);
      mean.Add(region.color, opacity + 1e-6);
    }
    transfer.opacities.push_back({value, most});
    if (mean.any()) transfer.colors.push_back({value, mean.Get()});
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double value : values) {
    add(value, std::nextafter(value, -kInfinity));
    add(value, std::nextafter(value, kInfinity));
  }
  return transfer;
}

TransferFunction Stretched(TransferFunction transfer, const ScalarRange& range) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  const auto each = [&](auto&& visit) {
    for (ColorPoint& point : transfer.colors) visit(point.value);
    for (OpacityPoint& point : transfer.opacities) visit(point.value);
    for (TransferRegion& region : transfer.regions) {
      for (RegionCorner& corner : region.corners) visit(corner.value);
    }
  };
  each([&](double value) {
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  });
  each([&](double& value) {
    // Halves, so that the widest range there is does not overflow.
    const double share = greatest > least ? (0.5 * value - 0.5 * least) / (0.5 * greatest - 0.5 * least) : 0;
    value = std::clamp(std::lerp(range.min, range.max, share), range.min, range.max);
  });
  return transfer;
}

Status Validate(const TransferFunction& transfer) {
  // Negated comparisons, so that NaN is never within a limit.
  const auto outside = [](double value, double low, double high) { return !(value >= low && value <= high); };
  const bool two_dimensional = !transfer.regions.empty();
  if (Status status = CheckCount("colour", transfer.colors.size(), two_dimensional); !status.ok()) return status;
  if (Status status = CheckCount("opacity", transfer.opacities.size(), two_dimensional); !status.ok()) return status;
  if (Status status = CheckValues("colour", transfer.colors); !status.ok()) return status;
  if (Status status = CheckValues("opacity", transfer.opacities); !status.ok()) return status;
  for (std::size_t i = 0; i < transfer.colors.size(); ++i) {
    const auto [r, g, b] = transfer.colors[i].color;
    if (outside(r, 0, 1)) return WrongField("colour", i, "red", r, "in [0, 1]");
    if (outside(g, 0, 1)) return WrongField("colour", i, "green", g, "in [0, 1]");
    if (outside(b, 0, 1)) return WrongField("colour", i, "blue", b, "in [0, 1]");
  }
  for (std::size_t i = 0; i < transfer.opacities.size(); ++i) {
    const OpacityPoint& point = transfer.opacities[i];
    if (outside(point.opacity, 0, 1)) return WrongField("opacity", i, "opacity", point.opacity, "in [0, 1]");
    if (!(point.midpoint > 0 && point.midpoint < 1)) return WrongField("opacity", i, "midpoint", point.midpoint, "in (0, 1)");
    if (outside(point.sharpness, 0, 1)) return WrongField("opacity", i, "sharpness", point.sharpness, "in [0, 1]");
  }
  if (!(transfer.opacity_distance > 0 && transfer.opacity_distance <= kMaxOpacityDistance)) {
    return Status::InvalidArgument(fmt::format("transfer function: opacity distance is {:g} voxel lengths, must be in (0, {:g}]",
                                               transfer.opacity_distance, kMaxOpacityDistance));
  }
  if (Status status = Validate(transfer.isosurfaces); !status.ok()) return status;
  if (Status status = Validate(transfer.gradient_opacities); !status.ok()) return status;
  if (Status status = Validate(transfer.regions); !status.ok()) return status;
  return Validate(transfer.material.value_or(Material()));
}

Status Validate(const Material& material) {
  if (Status s = InRange("ambient of the material", double(material.ambient), 0, 1); !s.ok()) return s;
  if (Status s = InRange("diffuse of the material", double(material.diffuse), 0, 1); !s.ok()) return s;
  if (Status s = InRange("specular of the material", double(material.specular), 0, 1); !s.ok()) return s;
  return InRange("shininess of the material", double(material.shininess), 1, 1000);
}

Status Validate(const std::vector<Isosurface>& isosurfaces) {
  if (isosurfaces.size() > std::size_t{kMaxIsosurfaces}) {
    return Status::InvalidArgument(
        fmt::format("number of isosurfaces is {}, at most {} are possible", isosurfaces.size(), kMaxIsosurfaces));
  }
  for (std::size_t i = 0; i < isosurfaces.size(); ++i) {
    const auto& [value, color, opacity] = isosurfaces[i];
    const auto in_range = [&](std::string_view field, double number, double least, double most) {
      return InRange(fmt::format("{} of isosurface {}", field, i), number, least, most);
    };
    if (Status s = in_range("value", value, -kMaxScalar, kMaxScalar); !s.ok()) return s;
    if (Status s = in_range("red", double(color.r), 0, 1); !s.ok()) return s;
    if (Status s = in_range("green", double(color.g), 0, 1); !s.ok()) return s;
    if (Status s = in_range("blue", double(color.b), 0, 1); !s.ok()) return s;
    if (Status s = in_range("opacity", opacity, 0, 1); !s.ok()) return s;
    if (i == 0 || isosurfaces[i - 1].value < value) continue;
    return Status::InvalidArgument(
        fmt::format("value of isosurface {} is {:g}, must be above that of the one before, {:g}", i, value, isosurfaces[i - 1].value));
  }
  return Status::Ok();
}

Status Validate(const std::vector<GradientOpacityPoint>& points) {
  if (points.size() > std::size_t{kMaxTransferPoints}) {
    return Status::InvalidArgument(
        fmt::format("number of gradient opacity points is {}, at most {} are possible", points.size(), kMaxTransferPoints));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [slope, opacity] = points[i];
    if (Status s = InRange(fmt::format("slope of gradient opacity point {}", i), slope, 0, kMaxScalar); !s.ok()) return s;
    if (Status s = InRange(fmt::format("opacity of gradient opacity point {}", i), opacity, 0, 1); !s.ok()) return s;
    if (i == 0 || points[i - 1].slope <= slope) continue;
    return Status::InvalidArgument(fmt::format("slope of gradient opacity point {} is {:g}, must be at least that of the one before, {:g}",
                                               i, slope, points[i - 1].slope));
  }
  return Status::Ok();
}

double GradientOpacity(const std::vector<GradientOpacityPoint>& points, double slope) {
  const auto end = std::ranges::upper_bound(points, slope, {}, &GradientOpacityPoint::slope);
  if (end == points.begin()) return end->opacity;
  const GradientOpacityPoint& before = end[-1];
  if (end == points.end()) return before.opacity;
  return std::lerp(before.opacity, end->opacity, (slope - before.slope) / (end->slope - before.slope));
}

double MaxOpacity(const TransferFunction& transfer, double low, double high) {
  if (!(low <= high)) return 0;
  double largest = std::max(transfer.Opacity(low), transfer.Opacity(high));
  // Between its points the curve is monotone, so only points can top the ends of the range. Both sides of a step count.
  const std::vector<OpacityPoint>& points = transfer.opacities;
  for (std::size_t i = SegmentEnd(points, low); i < points.size() && points[i].value <= high; ++i) {
    largest = std::max(largest, points[i].opacity);
  }
  return largest;
}

}  // namespace slabstream
