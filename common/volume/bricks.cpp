#include "common/volume/bricks.h"

#include <algorithm>
#include <cstring>

#include "common/base/check.h"
#include "common/parallel/parallel.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

// Calls function(first voxel, samples, count) for the rows of bricks that make up the samples of `box` from byte `begin` on, which are at
// `bytes`. T: const where Byte is.
template <class T, class Byte, class Function>
void ForEachRun(const Box& box, std::uint64_t begin, std::span<Byte> bytes, Function&& function) {
  CHECK(begin % sizeof(T) == 0 && bytes.size() % sizeof(T) == 0);
  T* samples = reinterpret_cast<T*>(bytes.data());
  const auto first = std::int64_t(begin / sizeof(T));
  auto left = std::int64_t(bytes.size() / sizeof(T));
  CHECK_LE(first + left, box.voxel_count());
  const Index3 size = box.size();
  const std::int64_t row = first / size.x;
  Index3 voxel = box.begin + Index3{std::int32_t(first % size.x), std::int32_t(row % size.y), std::int32_t(row / size.y)};
  while (left > 0) {
    const std::int32_t brick_end = std::min((voxel.x / kBrick + 1) * kBrick, box.end.x);
    const auto count = std::int32_t(std::min<std::int64_t>(brick_end - voxel.x, left));
    function(voxel, samples, count);
    samples += count;
    left -= count;
    voxel.x += count;
    if (voxel.x < box.end.x) continue;
    voxel.x = box.begin.x;
    if (++voxel.y < box.end.y) continue;
    voxel.y = box.begin.y;
    ++voxel.z;
  }
}

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
  first = box.begin / kBrick;
  counts = CubesOver(box.end, kBrick) - first;
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
  const Index3 brick = voxel / kBrick;
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
  VisitStoredType(type_, [&]<class T>(const T*) {
    ForEachRun<const T>(box, begin, samples, [&](const Index3& voxel, const T* from, std::int32_t count) { WriteRun(voxel, from, count); });
  });
}

BrickedVoxels::BrickedVoxels(const VoxelBlock& block) : BrickedVoxels(block.box, block.type) {
  const std::size_t slice_bytes = block.bytes.size() / std::size_t(std::max(block.box.size().z, 1));
  ParallelFor(0, grid_.counts.z, [&](std::int32_t layer) {
    const Box bricks = grid_.BoxOf({grid_.first.x, grid_.first.y, grid_.first.z + layer});
    const std::size_t begin = std::size_t(bricks.begin.z - block.box.begin.z) * slice_bytes;
    Write(block.box, begin, std::span(block.bytes).subspan(begin, std::size_t(bricks.size().z) * slice_bytes));
  });
}

VoxelBricks VoxelBricks::Part(const Box& box) const {
  CHECK(grid_.box.Contains(box));
  VoxelBricks part = *this;
  part.grid_ = BrickGrid(box);
  if (bricks_ != nullptr) return part;
  const Index3 offset = box.begin - grid_.box.begin;
  part.first_ += (offset.z * slice_ + offset.y * row_ + offset.x) * std::ptrdiff_t(BytesPerSample(type_));
  return part;
}

void VoxelBricks::Read(const Box& box, std::uint64_t begin, std::span<std::byte> samples) const {
  CHECK(grid_.box.Contains(box));
  VisitStoredType(type_, [&]<class T>(const T*) {
    ForEachRun<T>(box, begin, samples, [&](const Index3& voxel, T* to, std::int32_t count) {
      const BrickView<T> view = View<T>(voxel / kBrick);
      CopyRun(to, view.Row(voxel.y, voxel.z) + (voxel.x - view.begin.x), count);
    });
  });
}

VoxelBlock VoxelBricks::Block() const {
  VoxelBlock block = MakeVoxelBlock(box(), type_);
  VisitStoredType(type_, [&]<class T>(const T*) {
    ParallelFor(0, grid_.counts.z, [&](std::int32_t layer) {
      const Index3 first = grid_.first + Index3{0, 0, layer};
      for (const Index3& brick : IndicesIn(Box{first, first + Index3{grid_.counts.x, grid_.counts.y, 1}})) {
        const Box part = grid_.BoxOf(brick);
        const BrickView<T> view = View<T>(brick);
        for (std::int32_t z = part.begin.z; z < part.end.z; ++z) {
          for (std::int32_t y = part.begin.y; y < part.end.y; ++y) {
            CopyRun(block.samples<T>() + block.Offset({part.begin.x, y, z}), view.Row(y, z), part.size().x);
          }
        }
      }
    });
  });
  return block;
}

}  // namespace slabstream
