// BoxFragments: where the fragments of shapes lie on the rays of a frame, and which of them a box composites.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "worker/rays/view_rays.h"
#include "worker/shapes/fragment_order.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// How far along the ray of a pixel a depth is, in samples without jitter.
inline double SampleAtDepth(const ViewRays& rays, std::int32_t x, std::int32_t y, float depth) {
  const double from_x = x - double(rays.centre_x), from_y = y - double(rays.centre_y);
  const double length = std::sqrt(1 + (from_x * from_x + from_y * from_y) * double(rays.bend));
  return (double(depth) * (rays.perspective ? length : 1) - double(rays.start_distance)) / double(rays.step);
}

// Whether a place belongs to the box that owns the positions p with low <= p < high on every axis.
inline bool Owns(const Float3& low, const Float3& high, const FragmentOrder::Place& place) {
  if (place.side != FragmentOrder::Side::kInside) return false;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    if (!(place.at[axis] >= double(low[i]) && place.at[axis] < double(high[i]))) return false;
  }
  return true;
}

struct BoxFragments {
  const FrameShapes& shapes;
  const ViewRays& rays;  // without jitter
  FragmentOrder order;
  Float3 low, high;  // Owns

  // Calls visit(x, y, fragment, its place in samples) for the fragments in `pixels` that end their ray or belong to the box, those of a
  // pixel nearest first.
  template <class Visit>
  void ForEachIn(const PixelBounds& pixels, Visit&& visit) const {
    for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
      for (std::int32_t x = pixels.x_begin; x < pixels.x_end; ++x) {
        const ShapeTile& tile = shapes.TileForBoxes(x, y);
        if (tile.empty()) {
          x = tile.pixels.x_end - 1;
          continue;
        }
        for (const ShapeFragment& fragment : tile.At(x, y)) {
          if (fragment.rgba[3] < 1 && !Owns(low, high, order.Of(x, y, fragment.depth))) continue;
          visit(x, y, fragment, float(SampleAtDepth(rays, x, y, fragment.depth)));
        }
      }
    }
  }
};

// What lies behind on a ray that has gathered red ... alpha. `rgba`: premultiplied.
inline void AddBehind(const std::array<float, 4>& rgba, float& red, float& green, float& blue, float& alpha) {
  const float through = 1 - alpha;
  red += through * rgba[0];
  green += through * rgba[1];
  blue += through * rgba[2];
  alpha += through * rgba[3];
}

}  // namespace slabstream
