// ChosenPolicy: what a frame got whose policy left a choice.
#pragma once

#include <optional>

#include "common/frame/frame_request.h"
#include "common/stats/prediction.h"

namespace slabstream {

struct ChosenPolicy {
  Policy asked, policy;                       // `policy` leaves nothing open
  std::optional<FramePrediction> prediction;  // none: too much to simulate
  double render_scale = 1;                    // by which it was corrected (PolicyQuestion)
};

}  // namespace slabstream
