// EmptyDistances: how far rays may leap. For each cell, and each octant of directions, the Chebyshev distance in cells to the nearest
// visible cell in that octant; 0 in a visible cell. A ray of the octant that is in a cell of distance d may leap over all cells less than d
// away: proximity clouds (Zuiderveld et al. 1992) for each direction. A ray that has left an object leaps to its end. For a visible
// cell it also holds which eighths are visible. Rays leap over the others.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/parallel/parallel.h"
#include "worker/rays/macrocell_ranges.h"
#include "worker/rays/view_rays.h"

namespace slabstream {

// Octant o: bit i of o is set if rays move towards lower coordinates along axis i. A set of octants has bit o for octant o.
inline constexpr unsigned kOctants = 8;
using OctantSet = unsigned;
using OctantStarts = std::array<std::int32_t, kOctants>;
// Those of all rays of a frame, and perhaps some more.
OctantSet OctantsOf(const ViewRays& rays);

// By cell, [z][y][x]: 0 if any_between(least, greatest value) is true of it, else 255. Parallel.
template <class AnyBetween>
std::vector<std::uint8_t> VisibleCells(const MacrocellRanges& cells, AnyBetween&& any_between) {
  std::vector<std::uint8_t> shown(cells.ranges.size(), 255);
  const std::size_t slice = std::size_t(cells.counts.x) * std::size_t(cells.counts.y);
  ParallelFor(0, cells.counts.z, [&](std::int32_t z) {
    for (std::size_t i = std::size_t(z) * slice; i < (std::size_t(z) + 1) * slice; ++i) {
      if (any_between(cells.ranges[i].min, cells.ranges[i].max)) shown[i] = 0;
    }
  });
  return shown;
}

class EmptyDistances {
 public:
  EmptyDistances() = default;
  // `visible`: VisibleCells, of a grid of cells with these counts.
  EmptyDistances(const Index3& counts, std::vector<std::uint8_t> visible);

  // VisibleEighths. Until this call, all eighths of a visible cell count as visible. Forgets all distances: call Find afterwards.
  void SetEighths(std::vector<std::uint8_t> eighths);
  // Finds the distances of these octants, and forgets others if some are new. Parallel.
  void Find(OctantSet octants);

  const std::vector<std::uint8_t>& visible() const { return visible_; }
  // By octant, where its cells [z][y][x] begin in data(): 256 times the distance, at most 255, plus VisibleEighths. Kernels may read two
  // bytes more.
  const OctantStarts& starts() const { return starts_; }
  const std::uint16_t* data() const { return cells_.data(); }
  std::size_t bytes() const { return visible_.capacity() + eighths_.capacity() + sizeof(cells_[0]) * cells_.capacity(); }

 private:
  Index3 counts_;
  std::vector<std::uint8_t> visible_, eighths_;
  std::vector<std::uint16_t> cells_;
  OctantStarts starts_{};
  OctantSet found_ = 0;
};

}  // namespace slabstream
