#include "worker/rays/macrocell_ranges.h"

#include <algorithm>
#include <type_traits>

#include "common/parallel/parallel.h"
#include "common/volume/column_ranges.h"

namespace slabstream {

namespace {

// Calls found(cell, its range) for cells of `side` voxels, a power of two, that together are `counts` macrocells. Parallel; macrocells of
// one z are one task.
template <class Found>
void FindRanges(const PaddedVoxels& voxels, const Index3& counts, std::int32_t side, Found&& found) {
  // Floors of positions run from box.begin - 1 to box.end - 1, and the voxels read from there to box.end: relative to the first, 0 ... size
  // + 1.
  const Index3 size = voxels.box.size();
  const std::int32_t in_macrocell = kCellSide / side;
  const auto end_of = [&](std::int32_t cell, std::int32_t voxels_along) { return std::min((cell + 1) * side + 1, voxels_along + 2); };
  VisitStoredType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const T* const first = reinterpret_cast<const T*>(voxels.samples.get()) + voxels.slice + voxels.row + 1;
    ParallelFor(0, counts.z, [&](std::int32_t macrocell_z) {
      ColumnRanges<T> columns(std::size_t(size.x) + 2);
      Index3 cell;
      for (cell.z = macrocell_z * in_macrocell; cell.z < (macrocell_z + 1) * in_macrocell; ++cell.z) {
        for (cell.y = 0; cell.y < counts.y * in_macrocell; ++cell.y) {
          columns.Clear();
          for (std::int32_t z = cell.z * side; z < end_of(cell.z, size.z); ++z) {
            for (std::int32_t y = cell.y * side; y < end_of(cell.y, size.y); ++y) {
              columns.Fold(first + z * voxels.slice + std::ptrdiff_t{y} * voxels.row);
            }
          }
          // A cell has its own columns, and the first one of the next cell.
          columns.Widen(std::size_t(side));
          for (cell.x = 0; cell.x < counts.x * in_macrocell; ++cell.x) {
            const auto x = std::size_t(cell.x) * std::size_t(side);
            StoredRange<T> range;
            if (x <= std::size_t(size.x) + 1) range = columns.Of(x);
            if (x <= std::size_t(size.x)) range.Include(columns.Of(x + 1));
            found(cell, MacrocellRange{float(range.low), float(range.high)});
          }
        }
      }
    });
  });
}

}  // namespace

MacrocellRanges FindMacrocellRanges(const PaddedVoxels& voxels) {
  MacrocellRanges cells;
  cells.counts = CubesOver(voxels.box.size() + Uniform(1), kCellSide);
  cells.ranges.resize(CountIn(cells.counts));
  FindRanges(voxels, cells.counts, kCellSide,
             [&](const Index3& cell, const MacrocellRange& range) { cells.ranges[NumberIn(cells.counts, cell)] = range; });
  return cells;
}

std::vector<std::uint8_t> VisibleEighths(const PaddedVoxels& voxels, const Index3& counts, const std::vector<std::uint8_t>& visible,
                                         FunctionRef<bool(float, float)> any_between) {
  std::vector<std::uint8_t> eighths(visible.size());
  FindRanges(voxels, counts, kCellSide / 2, [&](const Index3& eighth, const MacrocellRange& range) {
    const std::size_t macrocell = NumberIn(counts, {eighth.x / 2, eighth.y / 2, eighth.z / 2});
    if (visible[macrocell] != 0 || !any_between(range.min, range.max)) return;
    eighths[macrocell] |= std::uint8_t(1 << (eighth.x % 2 | eighth.y % 2 << 1 | eighth.z % 2 << 2));
  });
  return eighths;
}

}  // namespace slabstream
