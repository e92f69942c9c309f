// GradientBricks: the voxels that rays of one thread passed last, each with its gradient, as rays read them: eight neighbours of a sample
// take four loads. A brick is made where a ray first comes, and forgotten when there is no more room. So gradients take a fixed amount of
// memory for a thread, and nothing where no ray comes.
#pragma once

#include <array>
#include <cstdint>

#include "common/base/aligned_buffer.h"
#include "worker/rays/ray_box.h"

namespace slabstream {

// A voxel and its gradient: central differences, next voxel minus the one before.
struct GradientCorner {
  std::int16_t value, x, y, z;
};

class GradientBricks {
 public:
  // A brick has 8^3 sample positions p by their floor, counted from RayBox::origin, and the corners around them: [z][y][x].
  static constexpr int kShift = 3;
  static constexpr std::int32_t kSide = 1 << kShift, kRow = kSide + 1, kSlice = kRow * kRow;
  static constexpr std::int32_t kCorners = 736;  // a brick's; the last ones are room for kernels that write whole registers
  static constexpr std::int32_t kNone = -1;

  // Forgets the bricks of other voxels. Voxels are told apart by where they are: those of all boxes must live as long as this.
  void Enter(const RayBox& box);
  Index3 CountsOf(const RayBox& box) const { return (box.cells + Uniform(1)) / 2; }  // of bricks along each axis

  // The brick's first corner, or kNone.
  std::int32_t Find(std::int32_t number) const {
    for (std::uint32_t slot = SlotOf(number);; slot = (slot + 1) % kSlots) {
      if (slots_[slot].number == number) return slots_[slot].first;
      if (slots_[slot].number == kNone) return kNone;
    }
  }
  bool full() const { return count_ == kMost; }
  void Clear();
  // Room for a brick that is not there; not if full. Returns its first corner.
  std::int32_t Add(std::int32_t number);

  GradientCorner* corners() { return corners_.data(); }

 private:
  static constexpr std::int32_t kMost = 256;  // bricks: 1.5 MB. A ray through 256 voxels and its neighbours pass about 300
  static constexpr std::uint32_t kSlots = 4 * kMost;
  struct Slot {
    std::int32_t number = kNone, first = 0;
  };

  // Multiplicative hashing by the golden ratio (Knuth).
  static std::uint32_t SlotOf(std::int32_t number) { return (std::uint32_t(number) * 0x9E3779B9U) >> 22; }
  static_assert(kSlots == 1U << 10);

  const std::byte* samples_ = nullptr;
  std::int32_t count_ = 0;
  std::array<Slot, kSlots> slots_;
  AlignedVector<GradientCorner> corners_;
};

}  // namespace slabstream
