// ClipRays: where the rays of a frame's pixels enter and leave a clip region, which is convex.
//
// A ray is in the region between the farthest of the sides that it enters and the nearest of those that it leaves. Both follow from
// functions g that are linear in a pixel's x and y, so that a row takes a few operations a pixel (worker/kernels/clip_rows.h):
//
//   orthographic   g = depth       the side's distance from a ray's origin is linear, its rise along all rays the same
//   perspective    g = -1 / depth  the other way round; g grows with the depth, too
//
// A ray meets the region where g of each side that it enters is below g of each side that it leaves: half-planes of the screen. They cut
// the outline of the region, a convex polygon, out of the frame. Outside it, nothing is to be computed.
//
// Depths depend on the pixel, the camera and the region alone, in double precision, so all boxes agree on them. The box only makes the
// outline smaller.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/image/pixel_bounds.h"
#include "common/view/camera.h"
#include "common/view/clip.h"
#include "worker/kernels/clip_rows.h"

namespace slabstream {

// A quantity that is linear in x and y of an image point.
struct LinearInImage {
  double at_0 = 0, by_x = 0, by_y = 0;
  double At(double x, double y) const { return (at_0 + y * by_y) + x * by_x; }
  LinearInRow InRow(std::int32_t row) const { return {at_0 + (row + 0.5) * by_y, by_x}; }
};
// From its values at (0, 0), (width, 0) and (0, height) of the camera.
LinearInImage MakeLinear(const Camera& camera, double at_0, double at_right, double at_bottom);

class ClipRays {
 public:
  // `region` is not empty. All rays of `camera` that meet both region and box, which may be none.
  ClipRays(const ClipRegion& region, const Camera& camera, const Box& box);

  // No pixel outside can show anything of the box that lies in the region; empty: none can.
  const PixelBounds& bounds() const { return bounds_; }
  // Columns of a row that may, clipped to `within`; not in ascending order: none.
  struct Columns {
    std::int32_t begin, end;
  };
  Columns ColumnsOf(std::int32_t row, const PixelBounds& within) const;

  // For RegionDepths.
  RegionRow Row(std::int32_t row) const;

  // No ray that meets both enters the region, or leaves it, at a depth below this. kNeverMet: none does.
  float least_enter() const { return least_enter_; }
  float least_leave() const { return least_leave_; }
  // The side, by number in the region, where the ray of a pixel that meets the region enters it, other than from its start, or leaves it.
  std::size_t SideEntered(std::int32_t column, std::int32_t row) const;
  std::size_t SideLeft(std::int32_t column, std::int32_t row) const;

 private:
  struct Side {
    LinearInImage g;
    std::size_t number;
  };
  // What half-spaces mean to the rays.
  struct Sides {
    std::vector<Side> entered, left;
    std::vector<LinearInImage> never;  // rays for which one is negative never meet the half-space
  };
  Sides SidesOf(const std::vector<HalfSpace>& half_spaces, const Camera& camera) const;
  void FindOutline(const PixelBounds& frame, const Sides& of_box);
  double DepthAt(double g) const { return perspective_ ? -1 / g : g; }

  const bool perspective_;
  const double start_, end_;  // g of depths 0 and kNeverMet
  Sides sides_;
  struct Point {
    double x, y;
  };
  std::vector<Point> outline_;  // corners in order
  PixelBounds bounds_;
  float least_enter_ = kNeverMet, least_leave_ = kNeverMet;
};

}  // namespace slabstream
