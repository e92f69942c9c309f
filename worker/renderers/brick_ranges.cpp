#include "worker/renderers/brick_ranges.h"

#include <array>
#include <cstddef>

#include "common/volume/column_ranges.h"

namespace slabstream {
namespace {

// Slices are folded onto each other.
template <class T>
StoredRange<T> RangeOf(const BrickView<T>& brick, const Box& box) {
  StoredRange<T> range;
  if (brick.y_stride == 0) {  // all samples are equal
    FoldRow(brick.first, 1, &range.low, &range.high);
    return range;
  }
  const auto width = std::size_t(box.size().x), height = std::size_t(box.size().y);
  std::array<T, std::size_t{kBrick} * kBrick> low, high;
  low.fill(range.low);
  high.fill(range.high);
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    const T* row = brick.Row(box.begin.y, z);
    if (brick.y_stride == std::ptrdiff_t(width)) {
      FoldRow(row, width * height, low.data(), high.data());
      continue;
    }
    for (std::size_t y = 0; y < height; ++y, row += brick.y_stride) FoldRow(row, width, &low[y * width], &high[y * width]);
  }
  for (std::size_t i = 0; i < width * height; ++i) range.Include({low[i], high[i]});
  return range;
}

}  // namespace

BrickRanges::BrickRanges(const VoxelBricks& voxels) : grid_(voxels.grid()), ranges_(grid_.size()) {
  VisitStoredType(voxels.type(), [&]<class T>(const T*) {
    ForEachRowOfBricks(grid_, [&](Index3 brick) {
      for (; brick.x < grid_.first.x + grid_.counts.x; ++brick.x) {
        const StoredRange<T> range = RangeOf(voxels.View<T>(brick), grid_.BoxOf(brick));
        ranges_[grid_.Number(brick)] = {float(range.low), float(range.high)};
      }
    });
  });
}

}  // namespace slabstream
