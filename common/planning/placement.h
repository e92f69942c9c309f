// Who renders and combines what: the part of a plan that depends on the roster.
#pragma once

#include "common/planning/frame_plan.h"

namespace slabstream {

// Workers 1 ... `workers`, one for each slot: for plans that no service runs.
Roster RosterOf(std::uint32_t workers);

// Groups of `plan.slots` boxes of its layout that show something, in visibility order; at least one group.
void PlaceBoxes(FramePlan& plan);

// Fills in the workers of all placements, the display worker and the schedules. The display worker stays if it is in the roster. Else the
// turn picks one of the workers that hold a rank in the most groups (in an empty frame: of all), in the order of slots. Unavailable: no
// worker in the roster; the plan is then unchanged.
Status AssignWorkers(const Roster& roster, FramePlan& plan);

// The rank where the group's image should end: the display worker's, so that it need not travel; 0 if it has none.
Rank RootOf(const GroupPlan& group, WorkerId display);

}  // namespace slabstream
