// ReadIntoIndex: reads all voxels of a source once, and notes the ranges of their bricks.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>

#include "common/base/status.h"
#include "data/survey/brick_index.h"

namespace slabstream {

struct IndexProgress {
  std::uint64_t done_bytes = 0, all_bytes = 0;  // bytes of voxels in memory; what `index` knew before counts as done
};

struct IndexOptions {
  std::uint64_t memory = 0;  // bytes, for pieces that are read or looked at; two pieces at least
  std::stop_token stop = {};
  std::function<void(const IndexProgress&)> progress = [](const IndexProgress&) {};  // called often, on the thread that calls
};

// Reads what `index`, which is of `source`, does not know yet. Errors of VolumeSource::Read, and Cancelled if it was told to stop; `index`
// then knows what was read until then.
Status ReadIntoIndex(VolumeSource& source, const IndexOptions& options, BrickIndex& index);

}  // namespace slabstream
