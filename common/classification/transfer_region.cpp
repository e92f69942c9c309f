#include "common/classification/transfer_region.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/range_status.h"
#include "common/classification/mean_color.h"
#include "common/classification/transfer_function.h"

namespace slabstream {
namespace {

// Where `x` lies from `from` to `to`, which may be as far apart as doubles go.
double ShareOf(double x, double from, double to) { return (x / 2 - from / 2) / (to / 2 - from / 2); }

// How much of the opacity a place has that lies `distance` inside the border.
double Softened(const TransferRegion& region, double distance) {
  return region.softness > 0 ? std::min(2 * distance / region.softness, 1.0) : 1;
}

double Square(double x) { return x * x; }

}  // namespace

RegionBounds BoundsOf(const TransferRegion& region) {
  RegionBounds bounds{region.corners.front(), region.corners.front()};
  for (const auto& [value, slope] : region.corners) {
    bounds.least = {std::min(bounds.least.value, value), std::min(bounds.least.slope, slope)};
    bounds.greatest = {std::max(bounds.greatest.value, value), std::max(bounds.greatest.slope, slope)};
  }
  return bounds;
}

Status Validate(const std::vector<TransferRegion>& regions) {
  if (regions.size() > std::size_t{kMaxTransferRegions}) {
    return Status::InvalidArgument(fmt::format("number of regions is {}, at most {} are possible", regions.size(), kMaxTransferRegions));
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const auto& [corners, color, opacity, softness] = regions[i];
    if (corners.size() < 3 || corners.size() > std::size_t{kMaxRegionCorners}) {
      return Status::InvalidArgument(
          fmt::format("number of corners of region {} is {}, must be in [3, {}]", i, corners.size(), kMaxRegionCorners));
    }
    const auto in_range = [&](std::string_view field, double number, double least, double most) {
      return InRange(fmt::format("{} of region {}", field, i), number, least, most);
    };
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (Status s = in_range(fmt::format("value of corner {}", k), corners[k].value, -kMaxScalar, kMaxScalar); !s.ok()) return s;
      if (Status s = in_range(fmt::format("slope of corner {}", k), corners[k].slope, 0, kMaxScalar); !s.ok()) return s;
    }
    if (Status s = in_range("red", double(color.r), 0, 1); !s.ok()) return s;
    if (Status s = in_range("green", double(color.g), 0, 1); !s.ok()) return s;
    if (Status s = in_range("blue", double(color.b), 0, 1); !s.ok()) return s;
    if (Status s = in_range("opacity", opacity, 0, 1); !s.ok()) return s;
    if (Status s = in_range("softness", softness, 0, 1); !s.ok()) return s;
    const auto [least, greatest] = BoundsOf(regions[i]);
    if (!(least.value < greatest.value)) {
      return Status::InvalidArgument(fmt::format("all corners of region {} have the value {:g}, must differ", i, least.value));
    }
    if (!(least.slope < greatest.slope)) {
      return Status::InvalidArgument(fmt::format("all corners of region {} have the slope {:g}, must differ", i, least.slope));
    }
  }
  return Status::Ok();
}

RegionShapes::RegionShapes(const std::vector<TransferRegion>& regions) {
  for (const TransferRegion& region : regions) {
    Shape shape{&region, BoundsOf(region), {}};
    const auto& [least, greatest] = shape.bounds;
    const auto place = [&](const RegionCorner& corner) {
      return RegionCorner{ShareOf(corner.value, least.value, greatest.value), ShareOf(corner.slope, least.slope, greatest.slope)};
    };
    for (std::size_t i = 0; i < region.corners.size(); ++i) {
      const RegionCorner &a = region.corners[i], &b = region.corners[(i + 1) % region.corners.size()];
      shape.edges.push_back({place(a), place(b), a.slope > 0 || b.slope > 0});
    }
    shapes_.push_back(std::move(shape));
  }
}

double RegionShapes::Shape::OpacityAt(double value, double slope) const {
  const auto& [least, greatest] = bounds;
  if (!(value >= least.value && value <= greatest.value && slope >= least.slope && slope <= greatest.slope)) return 0;
  const double x = ShareOf(value, least.value, greatest.value), y = ShareOf(slope, least.slope, greatest.slope);
  bool inside = false;  // by the even-odd rule
  double nearest = 1;   // square of the distance from the border
  for (const auto& [a, b, is_border] : edges) {
    const double dx = b.value - a.value, dy = b.slope - a.slope;
    if ((a.slope > y) != (b.slope > y) && x < a.value + (y - a.slope) / dy * dx) inside = !inside;
    if (!is_border) continue;
    const double square = dx * dx + dy * dy;
    const double t = square > 0 ? std::clamp(((x - a.value) * dx + (y - a.slope) * dy) / square, 0.0, 1.0) : 0;
    nearest = std::min(nearest, Square(x - a.value - t * dx) + Square(y - a.slope - t * dy));
  }
  return inside ? region->opacity * Softened(*region, std::sqrt(nearest)) : 0;
}

RegionLook RegionShapes::At(double value, double slope) const {
  double transmitted = 1;
  MeanColor mean;
  for (const Shape& shape : shapes_) {
    const double opacity = shape.OpacityAt(value, slope);
    if (!(opacity > 0)) continue;
    transmitted *= 1 - opacity;
    mean.Add(shape.region->color, opacity);
  }
  if (!mean.any()) return {};
  return {mean.Get(), 1 - transmitted};
}

double MostOpacityAt(const TransferRegion& region, double value) {
  const auto [least, greatest] = BoundsOf(region);
  const double share = ShareOf(value, least.value, greatest.value);
  if (!(share >= 0 && share <= 1)) return 0;
  return region.opacity * Softened(region, std::min(share, 1 - share));
}

}  // namespace slabstream
