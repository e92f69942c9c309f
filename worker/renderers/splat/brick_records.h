// BrickRecords: makes the records of a brick when a frame first needs one of them. Most voxels of an opaque volume lie behind others: their
// records are never made, and memory for them is not taken.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/volume/bricks.h"

namespace slabstream {

class BrickRecords {
  enum State : std::uint8_t { kNone, kBeingMade, kMade };

 public:
  // Of the bricks that touch `box`, which lies in that of the voxels.
  BrickRecords(const VoxelBricks& voxels, const Box& box) : voxels_(voxels), grid_(box), states_(grid_.size()) {}
  virtual ~BrickRecords() = default;
  BrickRecords(const BrickRecords&) = delete;
  BrickRecords& operator=(const BrickRecords&) = delete;

  // Call before a frame's first Need: the voxels may lie elsewhere than before. They must stay until its last Need.
  void SetVoxels(const VoxelBricks& voxels) { voxels_ = voxels; }

  // A row of bricks along x: a frame asks for each octet that it draws.
  class Row {
   public:
    bool Has(std::int32_t x) const { return states_[x - first_x_].load(std::memory_order_acquire) == kMade; }

   private:
    friend class BrickRecords;
    Row(const std::atomic<std::uint8_t>* states, std::int32_t first_x) : states_(states), first_x_(first_x) {}

    const std::atomic<std::uint8_t>* states_;
    std::int32_t first_x_;
  };
  Row RowAt(std::int32_t y, std::int32_t z) const { return {&states_[grid_.Number({grid_.first.x, y, z})], grid_.first.x}; }
  void Need(const Index3& brick);  // any thread
  void NeedAll();                  // parallel
  std::size_t bytes() const { return states_.size(); }

 protected:
  virtual void Make(const Index3& brick) const = 0;  // one call for each brick
  const VoxelBricks& voxels() const { return voxels_; }

 private:
  VoxelBricks voxels_;
  const BrickGrid grid_;
  std::vector<std::atomic<std::uint8_t>> states_;  // by brick
};

}  // namespace slabstream
