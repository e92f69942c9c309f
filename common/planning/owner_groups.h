// Groups of boxes that stay with their owners. Owners' boxes interleave in any way, so a worker's boxes are in front of those of another
// one here and behind them there. A group takes from each worker boxes that follow one another in visibility order: they have ranks in a
// row, so their images become one before any of them travels. The groups, nearest first, are exact for any arrangement: no voxel moves,
// whoever owns what. (Sort-last renderers ask for convex parts, or ship fragments.)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/decomposition/partition.h"

namespace slabstream {

struct OwnerGroupsRequest {
  const Partition* partition = nullptr;
  std::span<const TouchingBoxes> touching;  // FindTouching(*partition)
  std::span<const std::uint32_t> slots;     // by box: its slot, or kNoSlot: nobody draws it
  const Camera* camera = nullptr;
  const Stretch* stretch = nullptr;
  std::span<const std::uint64_t> bytes;  // by box; empty: any number of boxes of a slot fits
  std::uint64_t most_bytes = 0;          // of a slot's boxes in a group, which has one of them in any case
};

// Each group by rank; no slot has two runs of ranks in a group. Pure.
//
// Groups are made from the front. Of the slots that have no run yet, the next one is that which loses least if it takes all of its boxes
// that can be taken now: as many as it could take if all other such slots went first, as often as they like. Who loses nothing may go first
// in any best order of the group. Finding the fewest groups is a search otherwise; small cases meet the optimum of an exhaustive search
// (tests/common/planning/owner_groups_test.cpp says how often).
std::vector<std::vector<BoxId>> GroupByOwner(const OwnerGroupsRequest& request);

}  // namespace slabstream
