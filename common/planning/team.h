// Teams: frames may go to parts of the workers in turn. A team renders its frames alone, so each team holds the whole volume among its
// members: memory against what a frame costs however many workers share it (boxes that overlap by their halos, images to combine,
// messages). One team is everybody on every frame, which makes a single frame soonest.
#pragma once

#include "common/planning/frame_plan.h"

namespace slabstream {

struct Team {
  Roster roster;  // its slots
  Turn turn;
};

// Whose turn the frame is. Teams are consecutive slots, alike in number to one; at most as many as there are slots (`teams` >= 1 says how
// many there should be). One without workers is passed over. Without any worker: all slots. Pure.
Team TeamOf(const Roster& roster, std::uint32_t teams, std::uint64_t frame);

}  // namespace slabstream
