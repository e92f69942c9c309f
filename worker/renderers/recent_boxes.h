// RecentBoxes: what a renderer made for boxes inside a padded box that it used last.
#pragma once

#include <cstdint>
#include <utility>

#include "common/base/lru_map.h"
#include "common/volume/box.h"

namespace slabstream {

template <class Value>
using RecentBoxes = LruMap<Box, Value>;

// Boxes are limited by their voxels, not by their number: the boxes of one partition never overlap, so however many there are, all are
// kept. Boxes that overlap come from partitions that changed. Those not used for longest go until the rest, with this one, hold at most
// four times `padded_voxels`: frames may use as many partitions in turn. `box` lies in the padded box.
template <class Value>
const Value& KeepBox(RecentBoxes<Value>& boxes, const Box& box, Value value, std::int64_t padded_voxels) {
  const Value& kept = boxes.Put(box, std::move(value), std::uint64_t(box.voxel_count()));
  boxes.DropBeyond(4 * std::uint64_t(padded_voxels));
  return kept;
}

}  // namespace slabstream
