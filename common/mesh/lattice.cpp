#include "common/mesh/lattice.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/parallel/parallel.h"

namespace slabstream {

VolumeGeometry LatticeOf(const Bounds3& bounds, std::int64_t cells, std::optional<std::int32_t> longest_side) {
  constexpr double kLeastSide = 32, kMostSide = 256, kVoxelsPerCell = 2;
  const Vec3 extent = bounds.high - bounds.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  CHECK(Least(extent) >= kLeastExtent && longest <= kMostExtent);
  double side = 0;
  if (longest_side) {
    CHECK(*longest_side >= 1 && *longest_side <= kMaxLatticeSide);
    side = *longest_side;
  } else {
    const Vec3 shape = extent / longest;
    side = std::round(std::clamp(std::cbrt(kVoxelsPerCell * double(cells) / shape.x / shape.y / shape.z), kLeastSide, kMostSide));
  }
  VolumeGeometry lattice;
  for (int axis = 0; axis < 3; ++axis) {
    lattice.size[axis] = std::max(std::int32_t(std::lround(side * (extent[axis] / longest))), 1);
    lattice.spacing[axis] = extent[axis] / lattice.size[axis];
  }
  lattice.orientation.world = World::kScene;
  lattice.orientation.origin = bounds.low + 0.5 * lattice.spacing;
  return lattice;
}

void MoveToLattice(const VolumeGeometry& lattice, Mesh& mesh) {
  ParallelFor(0, mesh.points.size(), [&](std::size_t i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double place = double(mesh.points[i][axis]) / lattice.spacing[axis] - 0.5;
      mesh.points[i][axis] = float(std::clamp(place, -0.5, lattice.size[axis] - 0.5));  // rounding ends at the sides
    }
  });
}

}  // namespace slabstream
