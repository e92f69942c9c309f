// ChoosePolicy: fills in what a policy leaves open ("auto") by what frames should take. Pure and deterministic.
//
// Candidates come from the lists (Decompositions, WorkSplits, Assignments, CombiningSchemes), so that a new entry takes part by itself.
// Each is judged by a simulated frame (frame_predictor.h). One thing after the other is chosen, what matters most first: the partition and
// what its boxes have equal shares of; the number of groups and the assignment; the scheme and its arguments. Where two are predicted
// within kLeastGain of each other the one that came first stays, the policy that would hold without choosing (FixedPolicy) before all
// others.
//
// What counts is the latency of a frame that nobody asked for ahead: it is what somebody who turns a volume waits for. Frames that are
// asked for ahead gain with it: the partition that ends first is the one with least to do for the worker with most.
//
// Memory comes first: no candidate has fewer groups than its slabs need (FewestGroups).
#pragma once

#include <optional>

#include "common/planning/frame_plan.h"
#include "common/planning/layout.h"
#include "common/simulation/machine_model.h"
#include "common/stats/prediction.h"

namespace slabstream {

struct PolicyQuestion {
  const FrameRequest* frame = nullptr;  // whose policy has names that there are (CheckNames)
  const VolumeSummary* summary = nullptr;
  WorkKnowledge known;
  std::uint32_t slots = 1;                // workers, [1, kMaxRanks]
  const MachineModel* machine = nullptr;  // valid; see service_machine.h
  const CostModel* cost = nullptr;
  double render_scale = 1;  // by how much longer boxes took so far than was predicted; > 0
  // What holds already, if anything: a policy that leaves nothing open, and fits the frame's. It stays unless another one gains that share.
  const Policy* now = nullptr;
  double least_gain = 0;  // [0, 1)
};

struct PolicyChoice {
  Policy policy;                              // leaves nothing open, nor the number of groups
  std::optional<FramePrediction> prediction;  // of it; none: its schedule is too long to be tried (FramePredictor::kMostSteps)
  int predicted = 0;                          // candidates
};

inline constexpr double kLeastGain = 0.02;

// The policy that a frame has where nothing is chosen: what is left open is as in Policy{}.
Policy FixedPolicy(Policy policy);

// Errors as of MakeFrameSetup.
Result<PolicyChoice> ChoosePolicy(const PolicyQuestion& question);

}  // namespace slabstream
