// Who renders and combines what: the part of a plan that depends on the roster.
#pragma once

#include "common/planning/frame_plan.h"

namespace slabstream {

// Workers 1 ... `workers`, one a slot: what plans are made for that no service runs.
Roster RosterOf(std::uint32_t workers);

// Groups of `plan.slots` boxes of its layout that show something, in visibility order; at least one group.
void PlaceBoxes(FramePlan& plan);

// Fills in the workers of all placements, the display worker and the schedules. The display worker is kept if it is in the roster; else it
// is the one whose turn it is among the workers that hold a rank in the most groups (in an empty frame: among all), in the order of slots.
// Unavailable if nobody is; the plan is then unchanged.
Status AssignWorkers(const Roster& roster, FramePlan& plan);

// Whose rank the group's image should end at: the display worker's, so that it need not travel; 0 if it has none.
Rank RootOf(const GroupPlan& group, WorkerId display);

}  // namespace slabstream
