// ChoosePolicy: fills in what a policy leaves open ("auto"), by predicted frame times. Pure and deterministic.
//
// Candidates come from the lists (Decompositions, BalanceByChoices, Assignments, CombiningSchemes), so a new entry takes part by itself.
// Each is judged by a simulated frame (frame_predictor.h). Choices are made one after the other, the most important first: the partition
// and what its boxes have equal shares of, each with one or two groups and under a few schemes, because the best partition depends on both;
// the number of groups and the assignment; the scheme and its arguments. A candidate must be predicted to gain more than kLeastGain over
// the ones before it; the first is the policy that holds without choosing (FixedPolicy).
//
// The measure is the latency of a frame that nobody asked for ahead: somebody who turns a volume waits for it. Frames that are asked for
// ahead gain, too: the partition that ends first has the least work for the busiest worker.
//
// Memory comes first: no candidate has fewer groups than its boxes need (FewestGroups).
#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>

#include "common/planning/frame_plan.h"
#include "common/planning/layout.h"
#include "common/stats/prediction.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

struct PolicyQuestion {
  const Policy* open = nullptr;  // settled, with known names (SettledPolicy, CheckNames)
  const ResolvedRequest* resolved = nullptr;
  const FrameSetup* setup = nullptr;  // of it (MakeFrameSetup)
  WorkKnowledge known;
  std::uint32_t slots = 1;                // workers, [1, kMaxRanks]
  const MachineModel* machine = nullptr;  // valid; see service_machine.h
  std::int64_t box_bytes_target = kBoxBytesTarget;
  double render_scale = 1;  // measured / predicted time of boxes so far; > 0
  // The present policy, if any; it fits the open one. It stays unless another one gains the share least_gain.
  const ResolvedPolicy* now = nullptr;
  double least_gain = 0;      // [0, 1)
  std::stop_token stop = {};  // once it is told to stop, the choice comes soon, and is of no use but to be dropped
};

struct PolicyChoice {
  ResolvedPolicy policy;                      // with a number of groups
  std::optional<FramePrediction> prediction;  // of it; none: its schedule is too long to be tried (FramePredictor::kMostSteps)
  int predicted = 0;                          // candidates
};

inline constexpr double kLeastGain = 0.02;

// Whether ChoosePolicy has something to choose for this machine and number of workers: an open name; or the number of groups, if it is open
// and workers of different hosts send each other images, so that the next group can render meanwhile. On one host a group costs more than
// it hides (docs/tuning.md).
bool LeavesChoice(const Policy& policy, const MachineModel& machine, std::size_t workers);

// The policy of a frame if nothing is chosen: open names are as in Policy{}.
Policy FixedPolicy(Policy policy);

// What to begin with where a policy leaves a choice, until it is made: a kd-tree by occupied voxels, and a tree of images or, for many
// workers, radix-k. Bricks alone tell enough to cut it.
Policy FirstPolicy(Policy policy, std::size_t workers);

PolicyChoice ChoosePolicy(const PolicyQuestion& question);

}  // namespace slabstream
