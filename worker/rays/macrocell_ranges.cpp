#include "worker/rays/macrocell_ranges.h"

#include <algorithm>
#include <type_traits>

#include "common/parallel/parallel.h"
#include "common/volume/column_ranges.h"

namespace slabstream {

MacrocellRanges FindMacrocellRanges(const PaddedVoxels& voxels) {
  // Floors of positions run from box.begin - 1 to box.end - 1, and the voxels read from there to box.end: relative to the first, 0 ... size
  // + 1.
  const Index3 size = voxels.box.size();
  MacrocellRanges cells;
  cells.counts = CubesOver(size + Uniform(1), kCellSide);
  cells.ranges.resize(CountIn(cells.counts));
  const auto end_of = [](std::int32_t cell, std::int32_t voxels_along) { return std::min((cell + 1) * kCellSide + 1, voxels_along + 2); };
  VisitStoredType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const T* const first = reinterpret_cast<const T*>(voxels.samples.get()) + voxels.slice + voxels.row + 1;
    ParallelFor(0, cells.counts.z, [&](std::int32_t cell_z) {
      ColumnRanges<T> columns(std::size_t(size.x) + 2);
      for (std::int32_t cell_y = 0; cell_y < cells.counts.y; ++cell_y) {
        columns.Clear();
        for (std::int32_t z = cell_z * kCellSide; z < end_of(cell_z, size.z); ++z) {
          for (std::int32_t y = cell_y * kCellSide; y < end_of(cell_y, size.y); ++y) {
            columns.Fold(first + z * voxels.slice + std::ptrdiff_t{y} * voxels.row);
          }
        }
        // A cell has its own columns, and the first one of the next cell.
        columns.Widen(kCellSide);
        MacrocellRange* cell = &cells.ranges[NumberIn(cells.counts, {0, cell_y, cell_z})];
        for (std::size_t x = 0; x < std::size_t(cells.counts.x) * kCellSide; x += kCellSide, ++cell) {
          StoredRange<T> range = columns.Of(x);
          range.Include(columns.Of(x + 1));
          *cell = {float(range.low), float(range.high)};
        }
      }
    });
  });
  return cells;
}

}  // namespace slabstream
