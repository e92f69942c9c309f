// Teams divide the workers; each team renders whole frames in turn. So each team holds the whole volume: it trades memory for the costs of
// a frame that do not depend on how many workers share it (boxes that overlap by their halos, images to combine, messages). With one team,
// all workers share every frame, which makes a single frame soonest.
#pragma once

#include "common/planning/frame_plan.h"

namespace slabstream {

struct Team {
  Roster roster;  // its slots
  Turn turn;
};

// The team that renders the frame. Teams are consecutive slots; their sizes differ by at most one. There are `teams` >= 1 of them, but no
// more than slots. Teams without workers are skipped. Without any worker: all slots. Pure.
Team TeamOf(const Roster& roster, std::uint32_t teams, std::uint64_t frame);

}  // namespace slabstream
