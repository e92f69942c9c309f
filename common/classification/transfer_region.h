// TransferRegion: what a two-dimensional transfer function shows: a polygon in the plane of values and slopes (Kindlmann and Durkin 1998;
// its shapes with soft borders after Kniss, Kindlmann and Hansen 2002). A slope is the magnitude of the gradient, in data values per unit
// of the world (mm of a patient).
//
// Inside, a region has one colour. Its opacity rises from 0 at the border to `opacity`. Distances from the border are measured where the
// polygon is as wide and as high as 1. The axis of values is no border: there are no slopes below 0.
// Regions that overlap are mixed like thin layers of as many materials: what they transmit is multiplied, and colours are weighted by
// opacity.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "common/classification/rgb.h"

namespace slabstream {

inline constexpr int kMaxTransferRegions = 16;
inline constexpr int kMaxRegionCorners = 32;

struct RegionCorner {
  double value = 0;  // data value, in [-kMaxScalar, kMaxScalar]
  double slope = 0;  // data values per unit of the world, in [0, kMaxScalar]
  friend bool operator==(const RegionCorner&, const RegionCorner&) = default;
};

struct TransferRegion {
  std::vector<RegionCorner> corners;  // 3 ... kMaxRegionCorners, in order; not all of one value, not all of one slope
  Rgb color;                          // each in [0, 1]
  double opacity = 1;                 // [0, 1], of TransferFunction::opacity_distance
  double softness = 0.25;             // [0, 1]: the width of the soft border; 0: a hard one, 1: it reaches the middle of a square
  friend bool operator==(const TransferRegion&, const TransferRegion&) = default;
};

// The least and the greatest corner.
struct RegionBounds {
  RegionCorner least, greatest;
};
RegionBounds BoundsOf(const TransferRegion& region);

// InvalidArgument naming the region, the field, the value and the limit.
Status Validate(const std::vector<TransferRegion>& regions);

struct RegionLook {
  Rgb color;           // black where the opacity is 0
  double opacity = 0;  // [0, 1]
};
// The regions at one value and slope after the other.
class RegionShapes {
 public:
  explicit RegionShapes(const std::vector<TransferRegion>& regions);  // valid; must outlive this
  RegionLook At(double value, double slope) const;                    // value finite, slope finite and at least 0

 private:
  struct Edge {
    RegionCorner from, to;  // where the region's bounds are a square of side 1
    bool is_border;         // it does not lie on the axis of values
  };
  struct Shape {
    const TransferRegion* region;
    RegionBounds bounds;
    std::vector<Edge> edges;
    double OpacityAt(double value, double slope) const;
  };
  std::vector<Shape> shapes_;
};
inline RegionLook LookAt(const std::vector<TransferRegion>& regions, double value, double slope) {
  return RegionShapes(regions).At(value, slope);
}

// The largest opacity that a region may have at a value, whatever the slope: a trapezoid, 0 outside the region's values.
double MostOpacityAt(const TransferRegion& region, double value);

}  // namespace slabstream
