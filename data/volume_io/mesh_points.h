// The points of a grid whose pieces meet: a point of a piece that has the place and the value of one of an earlier piece is that one.
// Points of one piece stay apart. One thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "common/mesh/mesh.h"

namespace slabstream {

// x, y and z in the world, finite, and the value; 0 where values belong to cells.
using MeshPoint = std::array<double, 4>;

inline constexpr std::size_t kBytesPerMeshPoint = sizeof(MeshPoint) + 4 * sizeof(PointNumber);  // at most

class MeshPoints {
 public:
  // The points that were added so far are found from now on. Takes memory for `more` points.
  void BeginPiece(std::size_t more);
  // Its number in all().
  PointNumber Add(MeshPoint point);
  const AlignedVector<MeshPoint>& all() const { return all_; }

 private:
  // Where the number of such a point is or will be.
  PointNumber& SlotOf(const MeshPoint& point);

  AlignedVector<MeshPoint> all_;
  std::size_t found_ = 0;           // how many of them are in the slots
  std::vector<PointNumber> slots_;  // a hash table, at most half full
};

}  // namespace slabstream
