#include "worker/rays/macrocell_ranges.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <type_traits>

namespace slabstream {
namespace {

// The range of each column of samples, over the rows of a row of cells. Loops over a row vectorise.
template <class T>
class ColumnRanges {
 public:
  explicit ColumnRanges(std::size_t columns) : low_(columns), high_(columns) {}

  void Clear() {
    std::fill(low_.begin(), low_.end(), std::numeric_limits<T>::max());
    std::fill(high_.begin(), high_.end(), std::numeric_limits<T>::lowest());
  }
  void Include(const T* row) {
    T *low = low_.data(), *high = high_.data();
    for (std::size_t x = 0; x < low_.size(); ++x) {
      if constexpr (std::is_integral_v<T>) {
        low[x] = std::min(low[x], row[x]);
        high[x] = std::max(high[x], row[x]);
      } else {
        // Skips infinite samples and NaN.
        const bool finite = row[x] >= std::numeric_limits<T>::lowest() && row[x] <= std::numeric_limits<T>::max();
        low[x] = finite && row[x] < low[x] ? row[x] : low[x];
        high[x] = finite && row[x] > high[x] ? row[x] : high[x];
      }
    }
  }
  MacrocellRange Of(std::size_t begin, std::size_t end) const {
    T low = low_[begin], high = high_[begin];
    for (std::size_t x = begin + 1; x < end; ++x) {
      low = std::min(low, low_[x]);
      high = std::max(high, high_[x]);
    }
    return {float(low), float(high)};
  }

 private:
  std::vector<T> low_, high_;
};

}  // namespace

MacrocellRanges FindMacrocellRanges(const PaddedVoxels& voxels) {
  // Floors of positions run from box.begin - 1 to box.end - 1, and the voxels read from there to box.end: relative to the first, 0 ... size
  // + 1.
  const Index3 size = voxels.box.size();
  MacrocellRanges cells;
  cells.counts = CubesOver(size + Uniform(1), kCellSide);
  cells.ranges.resize(CountIn(cells.counts));
  const auto end_of = [](std::int32_t cell, std::int32_t voxels_along) { return std::min((cell + 1) * kCellSide + 1, voxels_along + 2); };
  VisitScalarType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const T* const first = reinterpret_cast<const T*>(voxels.samples.get()) + voxels.slice + voxels.row + 1;
    tbb::parallel_for(0, cells.counts.z, [&](std::int32_t cell_z) {
      ColumnRanges<T> columns(std::size_t(size.x) + 2);
      for (std::int32_t cell_y = 0; cell_y < cells.counts.y; ++cell_y) {
        columns.Clear();
        for (std::int32_t z = cell_z * kCellSide; z < end_of(cell_z, size.z); ++z) {
          for (std::int32_t y = cell_y * kCellSide; y < end_of(cell_y, size.y); ++y) {
            columns.Include(first + z * voxels.slice + std::ptrdiff_t{y} * voxels.row);
          }
        }
        MacrocellRange* const row = &cells.ranges[NumberIn(cells.counts, {0, cell_y, cell_z})];
        for (std::int32_t cell_x = 0; cell_x < cells.counts.x; ++cell_x) {
          row[cell_x] = columns.Of(std::size_t(cell_x) * kCellSide, std::size_t(end_of(cell_x, size.x)));
        }
      }
    });
  });
  return cells;
}

}  // namespace slabstream
