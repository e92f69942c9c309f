// Who renders and combines what: the part of a plan that depends on the roster.
#pragma once

#include "common/planning/frame_plan.h"

namespace slabstream {

// Fills in the workers of all placements, the display worker and the schedules. The display worker is kept if it is in the roster.
// Unavailable if nobody is; the plan is then unchanged.
Status AssignWorkers(const Roster& roster, FramePlan& plan);

}  // namespace slabstream
