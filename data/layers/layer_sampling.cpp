#include "data/layers/layer_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

constexpr double kSnap = 1e-6;  // voxel lengths

// Voxels of a grid to positions in a layer's data space.
class LayerFromGrid {
 public:
  LayerFromGrid(const VolumeGeometry& grid, const VolumeGeometry& layer) {
    const auto in_layer = [&](const Vec3& world) { return layer.orientation.FromWorld(world) / layer.spacing; };
    origin_ = in_layer(grid.orientation.origin - layer.orientation.origin);
    for (const Axis axis : kAxes) {
      const auto i = std::size_t(Number(axis));
      steps_.at(i) = in_layer(grid.spacing[axis] * grid.orientation.axes.at(i));
    }
  }

  Vec3 At(const Index3& v) const {
    Vec3 p = origin_ + double(v.x) * steps_[0] + double(v.y) * steps_[1] + double(v.z) * steps_[2];
    for (const Axis axis : kAxes) {
      const double whole = std::round(p[axis]);
      if (std::abs(p[axis] - whole) < kSnap) p[axis] = whole;
    }
    return p;
  }

 private:
  Vec3 origin_;
  std::array<Vec3, 3> steps_;
};

// Calls set(offset, position) for each voxel of `grid`, slices in parallel.
template <class Set>
void ForEachVoxel(const VolumeGeometry& grid, const VolumeGeometry& layer, Set&& set) {
  const LayerFromGrid layer_from_grid(grid, layer);
  const Index3 size = grid.size;
  ParallelFor(0, size.z, [&](std::int32_t z) {
    std::size_t offset = std::size_t(z) * std::size_t(size.x) * std::size_t(size.y);
    for (Index3 v = {0, 0, z}; v.y < size.y; ++v.y) {
      for (v.x = 0; v.x < size.x; ++v.x) set(offset++, layer_from_grid.At(v));
    }
  });
}

bool IsInside(const Vec3& p, const Index3& size) {
  bool inside = true;
  for (const Axis axis : kAxes) inside = inside && p[axis] >= -0.5 && p[axis] < size[axis] - 0.5;
  return inside;
}

}  // namespace

VoxelBlock NearestOn(const VolumeGeometry& grid, const VolumeGeometry& layer, const VoxelBlock& numbers, ScalarType type) {
  VoxelBlock block = MakeVoxelBlock(grid.bounds(), type);
  VisitScalarType(type, [&]<class To>(const To*) {
    const auto* const from = numbers.samples<std::uint16_t>();
    To* const to = block.samples<To>();
    ForEachVoxel(grid, layer, [&](std::size_t offset, const Vec3& p) {
      if (!IsInside(p, layer.size)) return;
      const auto nearest = [](double q) { return std::int32_t(std::floor(q + 0.5)); };
      to[offset] = To(from[numbers.Offset({nearest(p.x), nearest(p.y), nearest(p.z)})]);
    });
  });
  return block;
}

}  // namespace slabstream
