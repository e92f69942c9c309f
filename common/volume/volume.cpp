#include "common/volume/volume.h"

namespace slabstream {

VoxelBlock MakeVoxelBlock(const Box& box, ScalarType type) {
  VoxelBlock block{box, type, {}};
  block.bytes.resize(std::size_t(box.voxel_count()) * BytesPerSample(type));
  return block;
}

}  // namespace slabstream
