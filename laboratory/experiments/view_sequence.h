// Sequences of views: one volume from step to step under a moving view, or a transfer function that changes. The boxes of each step are
// rendered alone; with dynamic balance their times are learnt, and before the next step the coordinator's own table of layouts may change
// the layout.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

struct ViewMotion {
  std::string_view name;
  std::string_view purpose;           // one line for --help
  ViewParameters (*at)(double part);  // of the way, in [0, 1)
};
// The only list.
const std::vector<ViewMotion>& ViewMotions();

struct ViewSequence {
  FrameCase frame;  // its view is that of the first step
  const ViewMotion* motion = nullptr;
  int steps = 1;
  std::optional<TransferChoice> later;  // the transfer function from the middle on
  bool slowed = false;                  // worker 1 takes kSlowdown times as long for each box
};
inline constexpr double kSlowdown = 2;

FrameCase FrameOf(const ViewSequence& sequence, int step);

// Measures the boxes of all steps. A worker that is slowed has no trial of its own unless its times are learnt.
Trial SequenceTrial(ExperimentContext& context, const ViewSequence& sequence);
Json SequenceKey(ExperimentContext& context, const ViewSequence& sequence);

// The steps of one repeat: boxes know what their workers must fetch because the layout has changed. SequenceTrial, and FinishTrial of
// every step's frame, must have been run.
using SequenceFrames = std::vector<MeasuredFrame>;
std::vector<SequenceFrames> RecallSequence(ExperimentContext& context, const ViewSequence& sequence);

}  // namespace slabstream
