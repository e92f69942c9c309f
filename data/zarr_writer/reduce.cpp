#include "data/zarr_writer/reduce.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "common/parallel/parallel.h"
#include "common/volume/exact_value.h"

namespace slabstream {
namespace {

constexpr std::size_t kMost = 8;  // voxels in one

template <class T>
T Mean(const std::array<T, kMost>& values, std::size_t count) {
  if constexpr (!std::is_integral_v<T>) {
    double sum = 0;
    int known = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (std::isnan(values[i])) continue;
      sum += double(values[i]);
      ++known;
    }
    return known == 0 ? std::numeric_limits<T>::quiet_NaN() : T(sum / known);
  } else {
    using Sum = std::conditional_t<sizeof(T) <= 2, std::int32_t, std::conditional_t<sizeof(T) <= 4, std::int64_t, Int128>>;
    Sum sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += Sum(values[i]);
    const Sum n = Sum(count), half = n / 2;  // division cuts towards zero
    return T(sum >= 0 ? (sum + half) / n : (sum - half) / n);
  }
}

template <class T>
T MostFrequent(const std::array<T, kMost>& values, std::size_t count) {
  T best = values[0];
  int most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    int times = 0;
    for (std::size_t j = 0; j < count; ++j) times += values[j] == values[i] ? 1 : 0;
    if (times == int(count)) return values[i];
    if (times > most || (times == most && values[i] < best)) {
      most = times;
      best = values[i];
    }
  }
  return best;
}

template <class T>
void ReduceBox(Reduction reduction, const T* from, const Index3& size, const Index3& step, T* to, const Index3& to_size, const Index3& at) {
  const Index3 count = (size + step - Uniform(1)) / step;
  ParallelFor(0, count.z, [&](std::int32_t z) {
    for (std::int32_t y = 0; y < count.y; ++y) {
      // The rows that become one.
      std::array<const T*, 4> rows{};
      std::size_t row_count = 0;
      for (std::int32_t k = z * step.z; k < std::min((z + 1) * step.z, size.z); ++k) {
        for (std::int32_t j = y * step.y; j < std::min((y + 1) * step.y, size.y); ++j) rows[row_count++] = from + NumberIn(size, {0, j, k});
      }
      T* const out = to + NumberIn(to_size, at + Index3{0, y, z});
      std::array<T, kMost> values{};
      for (std::int32_t x = 0; x < count.x; ++x) {
        std::size_t n = 0;
        for (std::size_t r = 0; r < row_count; ++r) {
          for (std::int32_t i = x * step.x; i < std::min((x + 1) * step.x, size.x); ++i) values[n++] = rows[r][i];
        }
        out[x] = reduction == Reduction::kMean ? Mean(values, n) : MostFrequent(values, n);
      }
    }
  });
}

}  // namespace

void Reduce(SampleType type, Reduction reduction, const std::byte* from, const Index3& size, const Index3& step, std::byte* to,
            const Index3& to_size, const Index3& at) {
  VisitSampleType(type, [&]<class T>(const T*) {
    ReduceBox(reduction, reinterpret_cast<const T*>(from), size, step, reinterpret_cast<T*>(to), to_size, at);
  });
}

}  // namespace slabstream
