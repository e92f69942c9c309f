#include "worker/rays/ray_box.h"

#include <algorithm>

namespace slabstream {

RayBox BoxOfVoxels(const PaddedVoxels& voxels, const Index3& cells) {
  RayBox result;
  result.type = voxels.type;
  result.samples = voxels.samples.get();
  result.origin = {voxels.box.begin.x - 1, voxels.box.begin.y - 1, voxels.box.begin.z - 1};
  result.padded = voxels.box.size() + Uniform(2 * kPad);
  result.row = voxels.row;
  result.slice = std::int32_t(voxels.slice);
  result.cells = cells;
  return result;
}

RayBox MakeRayBox(const PaddedVoxels& voxels, const Index3& cells, const SampledRegion& owned, const SampledRegion& sampled,
                  const ViewRays& rays, const Camera& camera, const GridMap& map) {
  RayBox result = BoxOfVoxels(voxels, cells);
  result.scale = ToFloat3(map.scale);
  result.offset = ToFloat3(map.offset);
  Vec3 low, high;
  bool empty = false;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    result.low[i] = float(owned.low[axis]);
    result.high[i] = float(owned.high[axis]);
    result.at_border = result.at_border || result.low[i] <= -0.5F || result.high[i] >= rays.volume_end[i];
    low[axis] = std::max(owned.low[axis], map.From(sampled.low[axis], axis));
    high[axis] = std::min(owned.high[axis], map.From(sampled.high[axis], axis));
    empty = empty || !(low[axis] < high[axis]);
  }
  if (!empty) result.reach = ReachOfBox(rays, camera, low, high);
  return result;
}

}  // namespace slabstream
