#include "common/volume/volume.h"

#include <cmath>
#include <cstring>

#include "common/base/check.h"

namespace slabstream {

Box VolumeGeometry::InDataSpace(const Box& box) const {
  if (!rectilinear() || box.empty()) return box;
  constexpr double kRounding = 1e-9;
  Box held;
  for (const Axis axis : kAxes) {
    held.begin[axis] = std::int32_t(std::floor(stretch.ToData(box.begin[axis] - 0.5, axis) + 0.5 + kRounding));
    held.end[axis] = std::int32_t(std::ceil(stretch.ToData(box.end[axis] - 0.5, axis) + 0.5 - kRounding));
  }
  return held;
}

VoxelBlock MakeVoxelBlock(const Box& box, ScalarType type) {
  VoxelBlock block{box, type, {}};
  block.bytes.resize(std::size_t(box.voxel_count()) * BytesPerSample(type));
  return block;
}

VoxelBlock CutBlock(const VoxelBlock& block, const Box& box) {
  CHECK(!box.empty() && block.box.Contains(box));
  VoxelBlock cut = MakeVoxelBlock(box, block.type);
  const std::size_t sample = BytesPerSample(block.type), row = sample * std::size_t(box.size().x);
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
      const Index3 first = {box.begin.x, y, z};
      std::memcpy(&cut.bytes[sample * std::size_t(cut.Offset(first))], &block.bytes[sample * std::size_t(block.Offset(first))], row);
    }
  }
  return cut;
}

}  // namespace slabstream
