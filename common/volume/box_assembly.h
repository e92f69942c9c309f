// How a box of voxels is put together from boxes that are at hand: what is copied from which of them, and what is missing. Whoever fetches
// voxels and whoever foretells how many will travel ask the same function.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

// What of `whole` lies outside `hole`: at most six boxes, disjoint, none empty. Cut off along z first, then y, then x: samples lie in
// memory by slices, so the largest pieces are the most contiguous ones.
std::vector<Box> Difference(const Box& whole, const Box& hole);

struct BoxAssembly {
  struct Part {
    std::size_t source = 0;  // index among the boxes at hand
    Box box;                 // inside it
    friend bool operator==(const Part&, const Part&) = default;
  };
  std::vector<Part> copied;
  std::vector<Box> missing;
  friend bool operator==(const BoxAssembly&, const BoxAssembly&) = default;

  std::int64_t missing_voxels() const;
};

// The boxes of `copied` and `missing` tile `wanted`. The one of `at_hand` that holds most of what is still wanted gives its part first, of
// equal ones the first; they may overlap one another, and be empty. One that would leave more than `most_missing` >= 1 boxes missing gives
// nothing; without that limit nothing is missing that one of `at_hand` holds.
BoxAssembly Assemble(const Box& wanted, std::span<const Box> at_hand, std::size_t most_missing = std::numeric_limits<std::size_t>::max());

// The limit for who asks another process for what is missing. Each box is a request of its own, which may get lost: no more of them than
// `wanted` would be if it were asked for as a whole, in pieces of 2^20 voxels.
inline std::size_t MostMissing(const Box& wanted) { return std::size_t(std::max<std::int64_t>(wanted.voxel_count() >> 20, 1)); }

}  // namespace slabstream
