// HandOverProbe: frames of an embedded service of one worker that tell what hand-overs take (hand_over_fit.h): tiny ones in quick
// succession, and one that renders for some milliseconds. Take samples between other measurements, so that the same weather hits all.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "laboratory/measure/hand_over_fit.h"

namespace slabstream {

class HandOverProbe {
 public:
  // Some frames for each of `count` samples, 10 ms or so, by a service that lives as long as the call: beside it, workers of this process
  // would have one thread more to make pictures with (worker/thread_share.h). Fails with the service.
  Status Sample(int count);

  // At least one sample must have been taken.
  HandOverEstimates Estimates() const { return FitHandOvers(quick_, slow_); }

 private:
  std::vector<FrameInstants> quick_, slow_;
};

}  // namespace slabstream
