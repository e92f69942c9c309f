#include "worker/renderers/raycast/surface_cells.h"

#include <algorithm>
#include <cstddef>

#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

// The cells of a row, `count` of them, bit by bit: whether all corners lie at or above the value, and whether some do.
struct Sides {
  unsigned all, any;
};
template <class T>
Sides SidesOfRow(const T* corners, std::int32_t count, float value) {
  unsigned above = 0;
  for (std::int32_t x = 0; x <= count; ++x) above |= unsigned(float(corners[x]) >= value) << x;
  const unsigned cells = (1U << count) - 1;
  return {above & above >> 1 & cells, (above | above >> 1) & cells};
}

// Sets the bits of the cells of a macrocell that hold the surface. `corners`: the first one's lowest corner; `count`: cells along each
// axis.
template <class T>
void SetBits(const T* corners, std::int32_t row, std::int64_t slice, const Index3& count, float value, std::int32_t (&bits)[2]) {
  Sides rows[kCellSide + 1][kCellSide + 1];
  for (std::int32_t z = 0; z <= count.z; ++z) {
    for (std::int32_t y = 0; y <= count.y; ++y) rows[z][y] = SidesOfRow(corners + z * slice + std::int64_t{y} * row, count.x, value);
  }
  for (std::int32_t z = 0; z < count.z; ++z) {
    for (std::int32_t y = 0; y < count.y; ++y) {
      const Sides &a = rows[z][y], &b = rows[z][y + 1], &c = rows[z + 1][y], &d = rows[z + 1][y + 1];
      const unsigned holds = (a.any | b.any | c.any | d.any) & ~(a.all & b.all & c.all & d.all);
      bits[z & 1] |= std::int32_t(holds << (16 * (z >> 1) + 4 * y));
    }
  }
}

}  // namespace

std::vector<std::int32_t> FindSurfaceCells(const PaddedVoxels& voxels, const MacrocellRanges& cells, const VisibleSamples& visible) {
  const Index3& counts = cells.counts;
  std::vector<std::int32_t> found(2 * cells.ranges.size());
  const Index3 cells_along = voxels.box.size() + Uniform(2 * kPad - 2);  // the first one is next to voxel box.begin - 1
  VisitScalarType(voxels.type, [&]<class T>(const T*) {
    const T* const first = reinterpret_cast<const T*>(voxels.At(voxels.box.begin - Uniform(1)));
    ParallelFor(0, counts.z, [&](std::int32_t group_z) {
      for (Index3 group{0, 0, group_z}; group.y < counts.y; ++group.y) {
        for (group.x = 0; group.x < counts.x; ++group.x) {
          const std::size_t number = NumberIn(counts, group);
          const Index3 begin = kCellSide * group, count = Min(Uniform(kCellSide), cells_along - begin);
          if (count.x <= 0 || !visible.AnySurfaceBetween(cells.ranges[number].min, cells.ranges[number].max)) continue;
          const T* const corners = first + begin.z * voxels.slice + std::int64_t{begin.y} * voxels.row + begin.x;
          std::int32_t bits[2] = {};
          for (const float value : visible.isovalues()) SetBits(corners, voxels.row, voxels.slice, count, value, bits);
          std::copy_n(bits, 2, &found[2 * number]);
        }
      }
    });
  });
  return found;
}

std::vector<std::uint8_t> MacrocellsWithSurfaces(const std::vector<std::int32_t>& surface_cells) {
  std::vector<std::uint8_t> shown(surface_cells.size() / 2);
  for (std::size_t i = 0; i < shown.size(); ++i) shown[i] = (surface_cells[2 * i] | surface_cells[2 * i + 1]) != 0 ? 0 : 255;
  return shown;
}

}  // namespace slabstream
