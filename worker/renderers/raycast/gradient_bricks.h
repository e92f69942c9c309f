// GradientBricks: the voxels that rays of one thread passed last, each with its gradient, as rays read them: a voxel's four numbers lie
// side by side. A brick is made where a ray first comes, and forgotten when there is no more room. So gradients take a fixed amount of
// memory for a thread, and nothing where no ray comes. A table takes 4 bytes for each brick of the volume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "common/memory/pooled_vector.h"
#include "worker/rays/ray_box.h"

namespace slabstream {

// A voxel and its gradient: central differences, next voxel minus the one before, or smoothed ones, as multiples of slope_unit(). Those of
// 16-bit voxels may be halved, all three.
template <class Number>
struct GradientCorner {
  Number value, x, y, z;
};
// Of samples of type T.
template <class T>
using CornerOf = GradientCorner<std::conditional_t<std::is_same_v<T, float>, float, std::int16_t>>;

class GradientBricks {
 public:
  // A brick has 8^3 sample positions p by their floor, counted from RayBox::origin, and the corners around them: [z][y][x].
  static constexpr int kShift = 3;
  static constexpr std::int32_t kSide = 1 << kShift, kRow = kSide + 1, kSlice = kRow * kRow;
  static constexpr std::int32_t kCorners = 736;  // a brick's; the last ones are room for kernels that write whole registers
  static constexpr std::int32_t kNone = -1;

  // Forgets the bricks of other voxels, and those with other gradients. Voxels are told apart by where they are: those of all boxes must
  // live as long as this.
  void Enter(const RayBox& box, bool smooth);
  bool smooth() const { return smooth_; }           // gradients are smoothed
  float slope_unit() const { return slope_unit_; }  // one unit of a corner's slopes, as a difference of samples
  const Index3& counts() const { return counts_; }  // bricks along each axis

  // By brick: its first corner, or kNone. Bricks are numbered from 1; the first corner of number 0 may be read and means nothing.
  const std::int32_t* firsts() const { return firsts_.data(); }
  Index3 BrickAt(std::int32_t number) const {
    const std::int32_t at = number - 1;
    return {at % counts_.x, at / counts_.x % counts_.y, at / counts_.x / counts_.y};
  }
  // Room for a brick that is not there: its first corner. Where there is none left, it takes that of the brick that was made first.
  std::int32_t Add(std::int32_t number);

  template <class T>
  CornerOf<T>* corners() {
    return reinterpret_cast<CornerOf<T>*>(corners_.data());
  }

 private:
  static constexpr float kSmoothUnit = 1.0F / 16;  // of 8-bit samples: their sums with weights 1, 2, 1 along two axes are whole
  static constexpr std::size_t kBytes =
      std::size_t{256} * kCorners * 8;  // 1.5 MB. More would not fit the second-level cache, and would not be faster

  const std::byte* samples_ = nullptr;
  bool smooth_ = false;
  float slope_unit_ = 1;
  Index3 counts_;
  PooledVector<std::int32_t> firsts_;
  std::vector<std::int32_t> made_;  // the numbers of bricks, by where they are among the corners; 0: none
  std::size_t next_ = 0;            // where the next one comes
  PooledVector<std::byte> corners_;
};

}  // namespace slabstream
