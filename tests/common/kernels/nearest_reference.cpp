#include "tests/common/kernels/nearest_reference.h"

#include <cstring>

namespace slabstream::testing {

void NearestRowReference(const SourcePixels& source, const TargetPixels& target, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!NearerDepth(source.depth[i], source.voxel[i], target.depth[i], target.voxel[i])) continue;
    std::memcpy(target.rgba + 4 * i, source.rgba + 4 * i, 4 * sizeof(float));
    target.depth[i] = source.depth[i];
    target.voxel[i] = source.voxel[i];
  }
}

}  // namespace slabstream::testing
