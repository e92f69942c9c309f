// The images plane: partial images between workers. Every worker binds a ROUTER; a sender connects a DEALER to it. One way only.
#pragma once

#include <cstdint>
#include <vector>

#include "common/wire/control_messages.h"
#include "common/wire/ids.h"

namespace slabstream {

// One step of a group's schedule, carried out; or, with step == number of steps, the whole group image on its way from the root to the
// display worker. Payload: the runs, always Codec::kRaw.
struct PartialImage {
  Epoch epoch = 0;
  WorkerId from_worker = 0;
  GroupKey key;
  std::uint32_t step = 0;  // index into schedule.steps
  RankInterval interval;   // ranks whose images these pixels hold
  PixelRange pixels;       // of the frame, as in the step
  RunImageHeader image;
  std::vector<RankReport> reports;  // of the ranks in `interval` that have not been passed on yet
  friend bool operator==(const PartialImage&, const PartialImage&) = default;
};

}  // namespace slabstream
