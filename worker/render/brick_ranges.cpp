#include "worker/render/brick_ranges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace slabstream {
namespace {

template <class T>
BrickRanges::Range RangeOf(const T* samples, std::int32_t count, BrickRanges::Range range) {
  if constexpr (std::is_integral_v<T>) {
    T low = std::numeric_limits<T>::max(), high = 0;
    for (std::int32_t i = 0; i < count; ++i) {
      low = std::min(low, samples[i]);
      high = std::max(high, samples[i]);
    }
    return {std::min(range.min, float(low)), std::max(range.max, float(high))};
  } else {
    for (std::int32_t i = 0; i < count; ++i) {
      if (std::isfinite(samples[i])) range = {std::min(range.min, samples[i]), std::max(range.max, samples[i])};
    }
    return range;
  }
}

}  // namespace

BrickRanges::BrickRanges(const VoxelBlock& voxels) {
  const Box& box = voxels.box;
  if (box.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    first_[axis] = box.begin[axis] / kBrick;
    counts_[axis] = (box.end[axis] - 1) / kBrick + 1 - first_[axis];
  }
  constexpr float kLargest = std::numeric_limits<float>::max();
  ranges_.assign(std::size_t(counts_.x) * counts_.y * counts_.z, Range{kLargest, -kLargest});
  VisitScalarType(voxels.type, [&](auto* type) {
    const auto* samples = voxels.samples<std::remove_cvref_t<decltype(*type)>>();
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        Range* row = &ranges_[(std::size_t(z / kBrick - first_.z) * counts_.y + (y / kBrick - first_.y)) * counts_.x];
        for (std::int32_t x = box.begin.x; x < box.end.x; ++row) {
          const std::int32_t end = std::min((x / kBrick + 1) * kBrick, box.end.x);
          *row = RangeOf(samples, end - x, *row);
          samples += end - x;
          x = end;
        }
      }
    }
  });
}

}  // namespace slabstream
