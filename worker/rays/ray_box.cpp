#include "worker/rays/ray_box.h"

#include <algorithm>

namespace slabstream {

RayBox MakeRayBox(const PaddedVoxels& voxels, const Index3& cells, const Box& box, const SampledRegion& sampled, const ViewRays& rays,
                  const Camera& camera) {
  RayBox result;
  result.type = voxels.type;
  result.samples = voxels.samples.get();
  result.origin = {voxels.box.begin.x - 1, voxels.box.begin.y - 1, voxels.box.begin.z - 1};
  result.row = voxels.row;
  result.slice = std::int32_t(voxels.slice);
  result.cells = cells;
  const SampledRegion owned = WholeBox(box);
  Vec3 low, high;
  bool empty = false;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    result.low[i] = float(owned.low[axis]);
    result.high[i] = float(owned.high[axis]);
    result.at_border = result.at_border || box.begin[axis] == 0 || result.high[i] >= rays.volume_end[i];
    low[axis] = std::max(owned.low[axis], sampled.low[axis]);
    high[axis] = std::min(owned.high[axis], sampled.high[axis]);
    empty = empty || !(low[axis] < high[axis]);
  }
  if (!empty) result.reach = ReachOfBox(rays, camera, low, high);
  return result;
}

}  // namespace slabstream
