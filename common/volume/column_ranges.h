// Ranges of stored samples, column by column: rows of voxels are folded onto each other, which vectorises for every type; what lies in a
// brick or a cell is then the range of a few columns.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

namespace slabstream {

// The range of stored samples; low > high until a finite one was met.
template <class T>
struct StoredRange {
  T low = std::numeric_limits<T>::max();
  T high = std::numeric_limits<T>::lowest();

  bool empty() const { return low > high; }
  void Include(const StoredRange& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
};

// Includes sample i of `row` in the range low[i], high[i]. Samples that are not finite are left out.
template <class T>
void FoldRow(const T* __restrict row, std::size_t count, T* __restrict low, T* __restrict high) {
  for (std::size_t i = 0; i < count; ++i) {
    if constexpr (std::is_integral_v<T>) {
      low[i] = std::min(low[i], row[i]);
      high[i] = std::max(high[i], row[i]);
    } else {
      // Comparisons with NaN are false.
      const bool finite = row[i] >= std::numeric_limits<T>::lowest() && row[i] <= std::numeric_limits<T>::max();
      low[i] = finite && row[i] < low[i] ? row[i] : low[i];
      high[i] = finite && row[i] > high[i] ? row[i] : high[i];
    }
  }
}

// The range of each column, over rows of one length.
template <class T>
class ColumnRanges {
 public:
  explicit ColumnRanges(std::size_t columns) : low_(columns), high_(columns) { Clear(); }

  void Clear() {
    std::ranges::fill(low_, StoredRange<T>{}.low);
    std::ranges::fill(high_, StoredRange<T>{}.high);
  }
  void Fold(const T* row) { FoldRow(row, low_.size(), low_.data(), high_.data()); }

  // Column x gets the range of columns x to x + count - 1, as far as there are any. `count`: a power of two.
  void Widen(std::size_t count) {
    for (std::size_t reach = 1; reach < count; reach *= 2) {
      for (std::size_t x = 0; x + reach < low_.size(); ++x) {
        low_[x] = std::min(low_[x], low_[x + reach]);
        high_[x] = std::max(high_[x], high_[x + reach]);
      }
    }
  }

  StoredRange<T> Of(std::size_t column) const { return {low_[column], high_[column]}; }
  StoredRange<T> Of(std::size_t begin, std::size_t end) const {
    StoredRange<T> range;
    for (std::size_t x = begin; x < std::min(end, low_.size()); ++x) range.Include(Of(x));
    return range;
  }

 private:
  std::vector<T> low_, high_;
};

}  // namespace slabstream
