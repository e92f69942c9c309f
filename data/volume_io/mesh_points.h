// The points of a grid whose pieces meet: a point of a piece that has the place and the value of one of an earlier piece is that one.
// Points of one piece stay apart. Points of pieces that have ended may be moved to a file. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "common/mesh/mesh.h"
#include "data/cell_store/cell_spool.h"

namespace slabstream {

inline constexpr std::size_t kBytesPerMeshPoint = sizeof(MeshPoint) + 6 * sizeof(PointNumber);  // at most

class MeshPoints {
 public:
  // The points that were added so far are found from now on. Takes memory for `more` points. ResourceExhausted; errors of RecordFile.
  Status BeginPiece(std::size_t more);
  // Its number.
  Result<PointNumber> Add(MeshPoint point);
  std::size_t size() const { return moved_ + held_.size(); }
  // Those that were not moved, which are the last ones.
  const AlignedVector<MeshPoint>& held() const { return held_; }
  // Appends those to `file`, which has all before them. It must stay.
  Status MoveTo(Records<MeshPoint>& file);

 private:
  struct Slot {
    PointNumber number;
    std::uint32_t tag;  // the rest of the point's digest
  };

  // Where such a point is or will be.
  Result<Slot*> SlotOf(const MeshPoint& point);
  Result<bool> IsSame(PointNumber number, const MeshPoint& point);
  Status Find(const MeshPoint& point, PointNumber number);

  AlignedVector<MeshPoint> held_;
  std::size_t moved_ = 0;
  const Records<MeshPoint>* file_ = nullptr;  // of those that were moved
  std::vector<MeshPoint> block_;              // of the file: points [block_begin_, ...)
  std::uint64_t block_begin_ = 0;
  std::size_t found_ = 0;    // how many are in the slots
  std::vector<Slot> slots_;  // a hash table, at most three quarters full
};

}  // namespace slabstream
