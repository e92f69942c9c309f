// RecentBoxes: what a renderer made for boxes inside a padded box that it used last. Boxes are limited by their voxels, not by their
// number: the boxes of one partition never overlap, so however many there are, all are kept. Boxes that overlap come from partitions that
// changed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <list>
#include <utility>

#include "common/volume/box.h"

namespace slabstream {

template <class Value>
class RecentBoxes {
 public:
  struct Entry {
    Box box;
    Value value;
  };

  // Null if nothing was kept for `box`. Valid until the value is dropped.
  const Value* Find(const Box& box) {
    const auto kept = std::ranges::find(entries_, box, &Entry::box);
    if (kept == entries_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, kept);
    return &entries_.front().value;
  }

  // Drops the boxes not used for longest until the rest, with this one, hold at most kMostTimes times `padded_voxels`. `box` lies in the
  // padded box and is not kept yet.
  const Value& Add(const Box& box, Value value, std::int64_t padded_voxels) {
    entries_.push_front({box, std::move(value)});
    voxels_ += box.voxel_count();
    while (voxels_ > kMostTimes * padded_voxels && entries_.size() > 1) {
      voxels_ -= entries_.back().box.voxel_count();
      entries_.pop_back();
    }
    return entries_.front().value;
  }

  void Clear() {
    entries_.clear();
    voxels_ = 0;
  }

  const std::list<Entry>& entries() const { return entries_; }  // most recently used first

 private:
  static constexpr std::int64_t kMostTimes = 4;  // partitions that frames may use in turn

  std::list<Entry> entries_;
  std::int64_t voxels_ = 0;  // voxels of all boxes
};

}  // namespace slabstream
