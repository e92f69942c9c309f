// Bricks: cubes of kBrick voxels a side, at global multiples of kBrick, cut off by the box that they divide. BrickedVoxels stores the
// samples of a box brick by brick. If all samples of a brick are equal it keeps one row of them, so empty space takes hardly any memory:
// most of a segmented scan, and the surroundings of many simulations.
//
// VoxelBricks reads bricks of any kind of storage: BrickedVoxels, or one array, such as that of a VoxelBlock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "common/memory/large_array.h"
#include "common/volume/volume.h"

namespace slabstream {

// A brick is named by its begin divided by kBrick, rounded down, in the whole volume.
struct BrickGrid {
  BrickGrid() = default;
  explicit BrickGrid(const Box& divided);

  std::size_t size() const { return CountIn(counts); }
  std::size_t Number(const Index3& brick) const { return NumberIn(counts, brick - first); }
  Box BoxOf(const Index3& brick) const { return Intersection(box, {kBrick * brick, kBrick * (brick + Uniform(1))}); }

  Box box;
  Index3 first, counts;  // bricks
};

// Where the samples of a brick lie: rows along x. Several rows may be the same memory.
template <class T>
struct BrickView {
  const T* first = nullptr;  // sample of the brick's first voxel
  Index3 begin;
  std::ptrdiff_t y_stride = 0, z_stride = 0;

  // Samples from the brick's first voxel along x on.
  const T* Row(std::int32_t y, std::int32_t z) const { return first + (y - begin.y) * y_stride + (z - begin.z) * z_stride; }
};

class BrickedVoxels {
 public:
  // All samples are 0 until the first Write; from then on, samples not written have any value.
  BrickedVoxels(const Box& box, ScalarType type);
  explicit BrickedVoxels(const VoxelBlock& block);

  const BrickGrid& grid() const { return grid_; }
  ScalarType type() const { return type_; }

  // Writes part of the samples of `box`, which lies inside this one: whole samples, x fastest, from byte `begin` of the box's samples on.
  // Several threads may write different bricks.
  void Write(const Box& box, std::uint64_t begin, std::span<const std::byte> samples);

  template <class T>
  BrickView<T> View(const Index3& brick) const {
    const std::size_t number = grid_.Number(brick);
    const Box box = grid_.BoxOf(brick);
    if (bricks_[number] == nullptr) return {RowOf<T>(number), box.begin, 0, 0};
    const std::ptrdiff_t width = box.end.x - box.begin.x;
    return {reinterpret_cast<const T*>(bricks_[number]), box.begin, width, width * (box.end.y - box.begin.y)};
  }

  std::size_t bytes() const {
    return equal_rows_.size() + met_.size() + bricks_.size() * sizeof(bricks_[0]) + pools_.size() * kPoolBytes - pool_left_;
  }

 private:
  static constexpr std::size_t kPoolBytes = std::size_t{2} << 20;  // a huge page

  template <class T>
  const T* RowOf(std::size_t number) const {
    return reinterpret_cast<const T*>(equal_rows_.data()) + number * kBrick;
  }
  std::byte* TakeBrick(std::size_t bytes);
  template <class T>
  void WriteRun(const Index3& voxel, const T* samples, std::int32_t count);

  BrickGrid grid_;
  ScalarType type_;
  AlignedVector<std::byte> equal_rows_;                                      // by brick: its row if all samples are equal
  std::vector<std::uint8_t> met_;                                            // by brick: 1 once any of its samples was written
  std::vector<std::byte*> bricks_;                                           // null: all samples are equal
  std::unique_ptr<std::mutex> pool_mutex_ = std::make_unique<std::mutex>();  // guards what follows
  std::vector<LargeArray<std::byte>> pools_;                                 // hold the bricks, one after the other
  std::size_t pool_left_ = 0;                                                // free bytes of the last pool
};

// Neither copies nor owns.
class VoxelBricks {
 public:
  VoxelBricks(const VoxelBlock& block)  // NOLINT(google-explicit-constructor): a block is read brick by brick too
      : VoxelBricks(block.box, block.type, block.bytes.data(), block.box.size().x,
                    std::ptrdiff_t{block.box.size().x} * block.box.size().y) {}
  // `first`: the sample of the box's first voxel. `row`, `slice`: samples from a voxel to the next along y and z.
  VoxelBricks(const Box& box, ScalarType type, const std::byte* first, std::ptrdiff_t row, std::ptrdiff_t slice)
      : grid_(box), type_(type), first_(first), row_(row), slice_(slice) {}
  VoxelBricks(const BrickedVoxels& bricks)  // NOLINT(google-explicit-constructor)
      : grid_(bricks.grid()), type_(bricks.type()), bricks_(&bricks) {}

  const BrickGrid& grid() const { return grid_; }
  const Box& box() const { return grid_.box; }
  ScalarType type() const { return type_; }

  // Those of `box`, which lies inside this one.
  VoxelBricks Part(const Box& box) const;

  // Reads part of the samples of `box`, which lies inside this one: whole samples, x fastest, from byte `begin` of the box's samples on.
  void Read(const Box& box, std::uint64_t begin, std::span<std::byte> samples) const;
  VoxelBlock Block() const;  // all samples; parallel

  template <class T>
  BrickView<T> View(const Index3& brick) const {
    const Index3 begin = grid_.BoxOf(brick).begin;
    if (bricks_ != nullptr) {
      BrickView<T> view = bricks_->View<T>(brick);
      view.first = view.Row(begin.y, begin.z) + (begin.x - view.begin.x);
      view.begin = begin;
      return view;
    }
    const Index3 offset = begin - grid_.box.begin;
    return {reinterpret_cast<const T*>(first_) + offset.z * slice_ + offset.y * row_ + offset.x, begin, row_, slice_};
  }

 private:
  BrickGrid grid_;
  ScalarType type_;
  const std::byte* first_ = nullptr;
  std::ptrdiff_t row_ = 0, slice_ = 0;
  const BrickedVoxels* bricks_ = nullptr;
};

}  // namespace slabstream
