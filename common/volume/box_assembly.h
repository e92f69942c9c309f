// Assembles a box of voxels from boxes at hand: which parts are copied from which box, and which are missing. Fetching voxels and
// predicting how many will travel use the same function.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

// The part of `whole` outside `hole`: at most six disjoint boxes, none empty. Cut off along z first, then y, then x: samples are stored by
// slices, so the largest pieces are the most contiguous ones.
std::vector<Box> Difference(const Box& whole, const Box& hole);

struct BoxAssembly {
  struct Part {
    std::size_t source = 0;  // index into the boxes at hand
    Box box;                 // inside it
    friend bool operator==(const Part&, const Part&) = default;
  };
  std::vector<Part> copied;
  std::vector<Box> missing;
  friend bool operator==(const BoxAssembly&, const BoxAssembly&) = default;

  std::int64_t missing_voxels() const;
};

// The boxes of `copied` and `missing` tile `wanted`. The box of `at_hand` that holds most of what is still missing is copied first (ties:
// the first one). Boxes of `at_hand` may overlap and may be empty. One that would leave more than `most_missing` >= 1 boxes missing is
// skipped; without that limit, no voxel that a box of `at_hand` holds is missing.
BoxAssembly Assemble(const Box& wanted, std::span<const Box> at_hand, std::size_t most_missing = std::numeric_limits<std::size_t>::max());

// `box` cut at multiples of `block`, x fastest: none is empty.
std::vector<Box> CutAtBlocks(const Box& box, const Index3& block);

// The limit for fetching what is missing from another process. Each missing box takes a request, and a request may get lost. So there are
// at most as many as it would take to fetch all of `wanted` in pieces of 2^20 voxels.
inline std::size_t MostMissing(const Box& wanted) { return std::size_t(std::max<std::int64_t>(wanted.voxel_count() >> 20, 1)); }

}  // namespace slabstream
