#include "common/volume/bricks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "common/base/check.h"

namespace slabstream {
namespace {

// Calls function(first voxel, count, number of the first sample) for the rows of bricks that make up samples [begin, end) of `box`.
template <class Function>
void ForEachRun(const Box& box, std::int64_t begin, std::int64_t end, Function&& function) {
  const Index3 size = box.size();
  const std::int64_t row = begin / size.x;
  Index3 voxel = {box.begin.x + std::int32_t(begin % size.x), box.begin.y + std::int32_t(row % size.y),
                  box.begin.z + std::int32_t(row / size.y)};
  while (begin < end) {
    const std::int32_t brick_end = std::min((voxel.x / kBrick + 1) * kBrick, box.end.x);
    const auto count = std::int32_t(std::min<std::int64_t>(brick_end - voxel.x, end - begin));
    function(voxel, count, begin);
    begin += count;
    voxel.x += count;
    if (voxel.x < box.end.x) continue;
    voxel.x = box.begin.x;
    if (++voxel.y < box.end.y) continue;
    voxel.y = box.begin.y;
    ++voxel.z;
  }
}

Index3 BrickOf(const Index3& voxel) { return {voxel.x / kBrick, voxel.y / kBrick, voxel.z / kBrick}; }

// Most runs are as long as a brick: with a length known to the compiler, copying takes a few instructions.
template <class T>
void CopyRun(T* to, const T* from, std::int32_t count) {
  if (count == kBrick) {
    std::memcpy(to, from, kBrick * sizeof(T));
  } else {
    std::memcpy(to, from, std::size_t(count) * sizeof(T));
  }
}
// Compares bytes, so that NaNs keep their bits.
template <class T>
bool EqualRuns(const T* a, const T* b, std::int32_t count) {
  if (count == kBrick) return std::memcmp(a, b, kBrick * sizeof(T)) == 0;
  return std::memcmp(a, b, std::size_t(count) * sizeof(T)) == 0;
}

}  // namespace

BrickGrid::BrickGrid(const Box& divided) : box(divided) {
  if (box.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = box.begin[axis] / kBrick;
    counts[axis] = (box.end[axis] - 1) / kBrick + 1 - first[axis];
  }
}

BrickedVoxels::BrickedVoxels(const Box& box, ScalarType type)
    : grid_(box), type_(type), equal_rows_(grid_.size() * kBrick * BytesPerSample(type)), met_(grid_.size()), bricks_(grid_.size()) {}

std::byte* BrickedVoxels::TakeBrick(std::size_t bytes) {
  const std::lock_guard lock(*pool_mutex_);
  if (bytes > pool_left_) {
    pools_.push_back(MakeLargeArray<std::byte>(kPoolBytes));
    pool_left_ = kPoolBytes;
  }
  std::byte* const brick = pools_.back().get() + (kPoolBytes - pool_left_);
  pool_left_ -= bytes;
  return brick;
}

template <class T>
void BrickedVoxels::WriteRun(const Index3& voxel, const T* samples, std::int32_t count) {
  const Index3 brick = BrickOf(voxel);
  const std::size_t number = grid_.Number(brick);
  T* row = reinterpret_cast<T*>(equal_rows_.data()) + number * kBrick;
  std::byte*& own = bricks_[number];
  if (own == nullptr) {
    if (met_[number] == 0) {
      std::fill_n(row, kBrick, samples[0]);
      met_[number] = 1;
    }
    if (EqualRuns(samples, row, count)) return;
    const auto voxels = std::size_t(grid_.BoxOf(brick).voxel_count());
    own = TakeBrick(voxels * sizeof(T));
    std::fill_n(reinterpret_cast<T*>(own), voxels, row[0]);
  }
  const BrickView<T> view = View<T>(brick);
  CopyRun(const_cast<T*>(view.Row(voxel.y, voxel.z)) + (voxel.x - view.begin.x), samples, count);
}

void BrickedVoxels::Write(const Box& box, std::uint64_t begin, std::span<const std::byte> samples) {
  CHECK(grid_.box.Contains(box));
  VisitScalarType(type_, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    CHECK(begin % sizeof(T) == 0 && samples.size() % sizeof(T) == 0);
    const auto first = std::int64_t(begin / sizeof(T)), last = first + std::int64_t(samples.size() / sizeof(T));
    CHECK_LE(last, box.voxel_count());
    const T* from = reinterpret_cast<const T*>(samples.data());
    ForEachRun(box, first, last,
               [&](const Index3& voxel, std::int32_t count, std::int64_t sample) { WriteRun(voxel, from + (sample - first), count); });
  });
}

BrickedVoxels::BrickedVoxels(const VoxelBlock& block) : BrickedVoxels(block.box, block.type) {
  const std::size_t slice_bytes = block.bytes.size() / std::size_t(std::max(block.box.size().z, 1));
  tbb::parallel_for(0, grid_.counts.z, [&](std::int32_t layer) {
    const Box bricks = grid_.BoxOf({grid_.first.x, grid_.first.y, grid_.first.z + layer});
    const std::size_t begin = std::size_t(bricks.begin.z - block.box.begin.z) * slice_bytes;
    Write(block.box, begin, std::span(block.bytes).subspan(begin, std::size_t(bricks.size().z) * slice_bytes));
  });
}

void VoxelBricks::Read(const Box& box, std::uint64_t begin, std::span<std::byte> samples) const {
  CHECK(grid_.box.Contains(box));
  VisitScalarType(type_, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    CHECK(begin % sizeof(T) == 0 && samples.size() % sizeof(T) == 0);
    const auto first = std::int64_t(begin / sizeof(T)), last = first + std::int64_t(samples.size() / sizeof(T));
    CHECK_LE(last, box.voxel_count());
    T* to = reinterpret_cast<T*>(samples.data());
    ForEachRun(box, first, last, [&](const Index3& voxel, std::int32_t count, std::int64_t sample) {
      const BrickView<T> view = View<T>(BrickOf(voxel));
      CopyRun(to + (sample - first), view.Row(voxel.y, voxel.z) + (voxel.x - view.begin.x), count);
    });
  });
}

}  // namespace slabstream
