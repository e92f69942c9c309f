#include "worker/shapes/fragment_order.h"

#include <algorithm>

namespace slabstream {

FragmentOrder::FragmentOrder(const FrameSetup& setup)
    : camera_(setup.camera),
      along_slices_(!setup.sheets.empty()),
      low_{-0.5, -0.5, -0.5},
      high_(ToVec3(setup.description.geometry.size) - Vec3{0.5, 0.5, 0.5}) {
  const double last = setup.description.geometry.size[camera_.traversal_axis] - 1;
  (camera_.ascending ? last_slice_ : first_slice_) = camera_.ascending ? last : -last;
}

FragmentOrder::Place FragmentOrder::Of(std::int32_t x, std::int32_t y, float depth) const {
  if (along_slices_) {
    const auto slice = double(depth);
    return {{}, slice <= first_slice_ ? Side::kFront : slice <= last_slice_ ? Side::kInside : Side::kBehind};
  }
  const Camera::Ray ray = camera_.RayAt(x + 0.5, y + 0.5);
  const Vec3 at = ray.origin + double(depth) * ray.direction;
  double enter = -1e300;
  bool inside = true;
  for (const Axis axis : kAxes) {
    inside = inside && at[axis] >= low_[axis] && at[axis] < high_[axis];
    if (ray.direction[axis] == 0) continue;
    enter = std::max(enter, ((ray.direction[axis] > 0 ? low_ : high_)[axis] - ray.origin[axis]) / ray.direction[axis]);
  }
  // A ray that misses the volume has no samples, so either side does.
  return {at, inside ? Side::kInside : double(depth) < enter ? Side::kFront : Side::kBehind};
}

}  // namespace slabstream
