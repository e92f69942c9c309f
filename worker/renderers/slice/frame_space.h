// FrameSpace: the space in which slicing cuts cells, and the samples' rays.
//
// A sample is (x, y, k): the ray of pixel (x, y) meets plane k. Planes are parallel to the picture, at equal distances of depth. Frame
// space has the coordinates (x, y, s): x and y in pixels, and s = SOf(k), so that samples lie at whole x and y. Orthographic: s = k.
// Perspective: s is proportional to 1 / depth, so that straight lines and planes of data space stay straight, and v * s is linear in frame
// space where the value v is linear in data space.
//
// Samples lie a little beside the pixels' centres and planes of ray casting: on the order of 2^-19 of the volume's side, by a different
// part along each axis. Otherwise a grid of equal cells that is seen along an axis has its faces, edges and points right at the samples,
// where the rounding of different faces decides. Near a single face two cells compute the same bits, so nothing else depends on this.
#pragma once

#include <span>

#include "common/math/vec.h"
#include "common/memory/aligned_buffer.h"
#include "common/view/camera.h"
#include "common/view/clip.h"
#include "worker/rays/view_rays.h"
#include "worker/renderers/box_data.h"

namespace slabstream::slice {

// Double precision: errors are far smaller than what samples are moved by.
struct alignas(32) FramePoint {
  double x, y, s;
};

// Whole numbers from a point on: x, y and k of samples in a cell are at least the least `begin` of its points, and less than the greatest
// `end`. Saturated far beyond pixels and planes.
struct alignas(32) PointBounds {
  float begin[4], end[4];  // x, y, k; end[3]: 1 if the point does not lie before the eye, else 0
};

// The points of a padded box's cells. Their memory stays with the padded box, since taking it anew costs more than finding the points.
class FramePoints : public BoxCache {
 public:
  AlignedVector<FramePoint> points;
  AlignedVector<PointBounds> bounds;

  std::size_t bytes() const override { return points.capacity() * sizeof(FramePoint) + bounds.capacity() * sizeof(PointBounds); }
};

class FrameSpace {
 public:
  // As MakeViewRays: `planes_per_voxel` is `samples_per_voxel`.
  FrameSpace(const Camera& camera, const VolumeGeometry& geometry, double planes_per_voxel, const ClipRegion& clip);

  const ViewRays& rays() const { return rays_; }  // on planes; they run through the samples

  // Places points of data space. Parallel.
  void Place(std::span<const Vector3<float>> points, FramePoints& result) const;

  double SOf(double k) const { return perspective_ ? numerator_ / DepthOf(k) : k; }
  // What the linear function of a cell is multiplied by on plane k, so that it is the value.
  double ScaleOf(double k) const { return perspective_ ? DepthOf(k) / numerator_ : 1; }
  bool perspective() const { return perspective_; }

  // As of rays and camera.
  RayReach ReachOf(const Vec3& low, const Vec3& high) const;

 private:
  void Place(const Vec3& point, FramePoint& at, PointBounds& bounds) const;
  double DepthOf(double k) const { return first_depth_ + k * step_; }

  Camera camera_;
  ViewRays rays_;
  bool perspective_ = false;
  double step_ = 1;         // physical
  double first_depth_ = 0;  // the depth of plane 0
  double numerator_ = 1;    // s * depth
  double moved_ = 0;        // voxel lengths: samples are moved by less
  Vec3 first_;              // data space: a point of plane 0, before it was moved
  double move_x_ = 0, move_y_ = 0, move_k_ = 0;
};

}  // namespace slabstream::slice
