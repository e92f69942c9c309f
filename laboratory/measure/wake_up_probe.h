// WakeUpProbe: measures wake-ups with frames of an embedded service of one worker: tiny ones in quick succession, and one that renders for
// some milliseconds. Take samples between other measurements, so that drift of the machine affects all alike.
//
// FitWakeUps fits the time to hand work from one thread of the service to another (WakeUps) to the instants of frames of one worker. A
// frame passes ten wake-ups; between them lie only planning, rendering and making the picture:
//
//   request    client -> coordinator -> planner -> coordinator -> worker -> render lane     5, until rendering begins
//   rendered   render lane -> worker -> finish lane                                         2, until the picture is begun
//   picture    finish lane -> worker -> coordinator -> client                               3, until the picture is there
//
// Frames that take less than WakeUps::doze find all threads awake: one wake-up is a tenth of the time that is neither rendering nor
// making a picture (planning a frame like the last one takes next to no time). After a rendering that took much longer, the worker's own
// thread and its finish lane have slept: one wake-up is half of the time until the picture is begun. So each constant was measured as a
// stretch of time of its own, never as a difference of two.
#pragma once

#include <span>
#include <vector>

#include "common/base/status.h"
#include "laboratory/measure/statistics.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

struct FrameInstants {  // seconds, on one clock
  double submitted = 0, render_begin = 0, render_end = 0, finish_begin = 0, finish_end = 0;
  double received = 0;  // before decoding, or of a picture that takes no time to decode
};

struct WakeUpEstimates {
  Estimate awake, asleep;  // seconds; medians, so frames in which a thread had to wait for others' time slices do not count
  WakeUps Costs() const { return {.awake = awake.median, .asleep = asleep.median}; }
};

// `quick`: frames shorter than doze, one after the other; `slow`: frames with longer rendering. At least one of each. Pure.
WakeUpEstimates FitWakeUps(std::span<const FrameInstants> quick, std::span<const FrameInstants> slow);

class WakeUpProbe {
 public:
  // Renders some frames for each of `count` samples, 10 ms or so, by a service that lives only during the call: beside it, workers of this
  // process would have one more thread to make pictures with (worker/service/thread_share.h). Fails with the service.
  Status Sample(int count);

  // At least one sample must have been taken.
  WakeUpEstimates Estimates() const { return FitWakeUps(quick_, slow_); }

 private:
  std::vector<FrameInstants> quick_, slow_;
};

}  // namespace slabstream
