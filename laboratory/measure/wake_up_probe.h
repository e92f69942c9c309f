// WakeUpProbe: measures wake-ups (wake_up_fit.h) with frames of an embedded service of one worker: tiny ones in quick succession, and
// one that renders for some milliseconds. Take samples between other measurements, so that drift of the machine affects all alike.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "laboratory/measure/wake_up_fit.h"

namespace slabstream {

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
