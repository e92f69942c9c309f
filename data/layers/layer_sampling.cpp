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

// The trilinear value at a position inside; `value(v)` is that of a voxel.
template <class Value>
double Interpolated(const Vec3& p, const Index3& size, Value&& value) {
  Index3 low, high;
  Vec3 fraction;
  for (const Axis axis : kAxes) {
    const double q = std::clamp(p[axis], 0.0, double(size[axis] - 1));
    low[axis] = std::int32_t(q);
    fraction[axis] = q - low[axis];
    high[axis] = std::min(low[axis] + 1, size[axis] - 1);
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Index3 v;
    double weight = 1;
    for (const Axis axis : kAxes) {
      const bool upper = (corner >> Number(axis) & 1) != 0;
      v[axis] = upper ? high[axis] : low[axis];
      weight *= upper ? fraction[axis] : 1 - fraction[axis];
    }
    if (weight > 0) sum += weight * value(v);  // a voxel without a part may have any value
  }
  return sum;
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

VoxelBlock InterpolatedOn(const VolumeGeometry& grid, const Volume& layer) {
  VoxelBlock block = MakeVoxelBlock(grid.bounds(), ScalarType::kFloat32);
  VisitScalarType(layer.block.type, [&]<class From>(const From*) {
    const Index3 size = layer.description.geometry.size;
    const ValueMapping mapping = layer.description.mapping;
    const From* const from = layer.block.samples<From>();
    auto* const to = block.samples<float>();
    const auto value = [&](const Index3& v) { return mapping.FromStored(double(from[layer.block.Offset(v)])); };
    ForEachVoxel(grid, layer.description.geometry, [&](std::size_t offset, const Vec3& p) {
      const float sample = IsInside(p, size) ? float(Interpolated(p, size, value)) : std::numeric_limits<float>::quiet_NaN();
      to[offset] = std::isfinite(sample) ? sample : std::numeric_limits<float>::quiet_NaN();
    });
  });
  return block;
}

}  // namespace slabstream
