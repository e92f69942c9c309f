// What it takes to hand something from one thread of the service to another (HandOvers), out of the instants of frames of one worker. A
// frame passes ten hand-overs, between which only planning, rendering and the making of the picture lie:
//
//   request    client -> coordinator -> planner -> coordinator -> worker -> render lane     5, until rendering begins
//   rendered   render lane -> worker -> finish lane                                         2, until the picture is begun
//   picture    finish lane -> worker -> coordinator -> client                               3, until the picture is there
//
// Frames that take less than HandOvers::doze find all threads awake: their hand-overs are a tenth of the time that is neither rendering
// nor making a picture (planning a frame like the last one takes next to no time). When rendering ends that took much longer, the worker's
// own thread and its finish lane have slept: half of the time until the picture is begun. So each constant is a stretch of time that was
// measured as such, never a difference of two. Pure.
#pragma once

#include <span>

#include "common/simulation/machine_model.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

struct FrameInstants {  // seconds, on one clock
  double submitted = 0, render_begin = 0, render_end = 0, finish_begin = 0, finish_end = 0;
  double received = 0;  // before it is decoded, or of a picture that takes no time to decode
};

struct HandOverEstimates {
  Estimate awake, asleep;  // seconds; medians, so that frames in which a thread had to wait for others' time slices do not count
  HandOvers Costs() const { return {.awake = awake.median, .asleep = asleep.median}; }
};

// `quick`: frames of less than doze, one after the other; `slow`: frames whose rendering takes longer. At least one of each.
HandOverEstimates FitHandOvers(std::span<const FrameInstants> quick, std::span<const FrameInstants> slow);

}  // namespace slabstream
