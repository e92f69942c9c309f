#include "worker/render/surface_voxels.h"

#include <algorithm>
#include <array>
#include <type_traits>

namespace slabstream {

std::vector<SurfaceVoxel> FindSurfaceVoxels(const VoxelBlock& voxels, const BrickRanges& bricks, const ClassificationTable& table,
                                            const BinSelection& opaque, const Box& box) {
  std::vector<SurfaceVoxel> found;
  const Box inside = Intersection(box, voxels.box);
  const Index3 size = voxels.box.size();
  const std::array<std::int64_t, 3> strides = {1, size.x, std::int64_t{1} * size.x * size.y};
  VisitScalarType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const BinLookup<T> lookup(table, opaque);
    for (std::int32_t z = inside.begin.z; z < inside.end.z; ++z) {
      for (std::int32_t y = inside.begin.y; y < inside.end.y; ++y) {
        for (std::int32_t x = inside.begin.x; x < inside.end.x; ++x) {
          if (x == inside.begin.x || x % BrickRanges::kBrick == 0) {
            const BrickRanges::Range& range = bricks.At(x, y, z);
            if (!lookup.AnyBetween(range.min, range.max)) {
              x = (x / BrickRanges::kBrick + 1) * BrickRanges::kBrick - 1;
              continue;
            }
          }
          const Index3 voxel = {x, y, z};
          const T* sample = voxels.samples<T>() + voxels.Offset(voxel);
          if (lookup(*sample) == kNotSelected) continue;
          std::uint8_t open = 0;
          for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t stride = strides[std::size_t(axis)];
            const bool below = voxel[axis] > voxels.box.begin[axis] && lookup(sample[-stride]) != kNotSelected;
            const bool above = voxel[axis] + 1 < voxels.box.end[axis] && lookup(sample[stride]) != kNotSelected;
            open = std::uint8_t(open | (below ? 0 : 1 << (2 * axis)) | (above ? 0 : 2 << (2 * axis)));
          }
          if (open != 0) found.push_back({std::uint16_t(x), std::uint16_t(y), std::uint16_t(z), open});
        }
      }
    }
  });
  found.shrink_to_fit();
  return found;
}

}  // namespace slabstream
