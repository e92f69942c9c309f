#include "worker/renderers/brick_ranges.h"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace slabstream {
namespace {

// Least and greatest finite sample so far.
template <class T>
struct Extremes {
  static constexpr T kLargest = std::numeric_limits<T>::max(), kLeast = std::numeric_limits<T>::lowest();
  T low = kLargest, high = kLeast;

  void Include(const T* samples, std::int32_t count) {
    T least = low, greatest = high;
    for (std::int32_t i = 0; i < count; ++i) {
      if constexpr (std::is_integral_v<T>) {
        least = std::min(least, samples[i]);
        greatest = std::max(greatest, samples[i]);
      } else {
        const bool finite = samples[i] >= kLeast && samples[i] <= kLargest;  // NaN is neither
        least = finite && samples[i] < least ? samples[i] : least;
        greatest = finite && samples[i] > greatest ? samples[i] : greatest;
      }
    }
    low = least;
    high = greatest;
  }
};

// Reads contiguous memory in one pass, which vectorises.
template <class T>
BrickRanges::Range RangeOf(const BrickView<T>& brick, const Box& box) {
  const Index3 size = box.size();
  Extremes<T> extremes;
  if (brick.y_stride == 0) {
    extremes.Include(brick.first, 1);
  } else if (brick.y_stride == size.x && brick.z_stride == std::ptrdiff_t{size.x} * size.y) {
    extremes.Include(brick.first, size.x * size.y * size.z);
  } else {
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) extremes.Include(brick.Row(y, z), size.x);
    }
  }
  return {float(extremes.low), float(extremes.high)};
}

}  // namespace

BrickRanges::BrickRanges(const VoxelBricks& voxels) : grid_(voxels.grid()), ranges_(grid_.size()) {
  VisitScalarType(voxels.type(), [&]<class T>(const T*) {
    ForEachRowOfBricks(grid_, [&](Index3 brick) {
      for (; brick.x < grid_.first.x + grid_.counts.x; ++brick.x) {
        ranges_[grid_.Number(brick)] = RangeOf(voxels.View<T>(brick), grid_.BoxOf(brick));
      }
    });
  });
}

}  // namespace slabstream
