// Keys of the trials of a FrameCase. A key begins as the whole case, so that it holds all that decides the trial's numbers. What does not
// decide them is then left out, and the trial measures a frame in which these fields have their defaults. Cases that differ only there
// share one trial.
#pragma once

#include <functional>
#include <string_view>

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

// Everything about a case: what the request says (RequestJson), what the volume holds (VolumeCache::Identity), and the number of workers.
Json CaseJson(ExperimentContext& context, const FrameCase& frame);

struct KeyedFrame {
  FrameCase frame;  // to measure
  Json key;         // {"what": ..., the case, the counts}
  Json counts;      // what else is given to the trial, such as how many frames it renders

  // A trial with this key that measures this frame.
  Trial MakeTrial(ExperimentContext& context, std::function<Json()> run, double effort) const;
};

// Leaves out nothing. `what` names the trial.
KeyedFrame WholeCase(ExperimentContext& context, std::string_view what, const FrameCase& frame, Json counts = Json::object());
// Leaves out how images are combined, and the number of teams: `workers` are those of one team.
KeyedFrame WithoutCombining(ExperimentContext& context, std::string_view what, const FrameCase& frame, Json counts = Json::object());

// BoxCostTrial: leaves out all of the policy that does not decide where the boxes are.
KeyedFrame ForBoxCosts(ExperimentContext& context, const FrameCase& frame);
// FinishTrial: leaves out policy and workers.
KeyedFrame ForFinish(ExperimentContext& context, const FrameCase& frame);

}  // namespace slabstream
