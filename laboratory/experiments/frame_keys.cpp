#include "laboratory/experiments/frame_keys.h"

#include <utility>

#include "common/base/find_named.h"
#include "common/planning/policy_names.h"
#include "common/planning/resolved_policy.h"
#include "laboratory/experiments/owner_arrangements.h"
#include "laboratory/experiments/request_json.h"

namespace slabstream {
namespace {

template <class T>
void LeaveOut(KeyedFrame& keyed, const char* name, T Policy::*field) {
  keyed.frame.policy.*field = Policy().*field;
  keyed.key["policy"].erase(name);
}

void LeaveOutCombining(KeyedFrame& keyed) {
  LeaveOut(keyed, "combine", &Policy::combine);
  LeaveOut(keyed, "pixel_error", &Policy::pixel_error);
  LeaveOut(keyed, "teams", &Policy::teams);
}

}  // namespace

Json CaseJson(ExperimentContext& context, const FrameCase& frame) {
  // All fields are named: if there is one more, this does not compile. RequestOf takes those that are not mentioned below, but for
  // `parameters`: experiments have their own.
  const auto& [volume, size, view, policy, workers, look] = frame;
  const auto& [name, purpose, dataset, source, renderer, transfer, opacity, parameters] = volume;
  Json json = {{"look", name}, {"volume", context.volumes().Identity(volume)}};
  if (opacity) json["opacity"] = *opacity;  // for readers: the transfer function decides
  json.update(RequestJson(RequestOf(frame)));
  json["workers"] = workers;
  return json;
}

Trial KeyedFrame::MakeTrial(ExperimentContext& context, std::function<Json()> run, double effort) const {
  return {.key = key, .run = std::move(run), .effort = effort, .inputs = {{"case", CaseJson(context, frame)}, {"counts", counts}}};
}

KeyedFrame WholeCase(ExperimentContext& context, std::string_view what, const FrameCase& frame, Json counts) {
  KeyedFrame keyed{frame, {{"what", what}}, std::move(counts)};
  keyed.key.update(CaseJson(context, frame));
  keyed.key.update(keyed.counts);
  return keyed;
}

KeyedFrame WithoutCombining(ExperimentContext& context, std::string_view what, const FrameCase& frame, Json counts) {
  KeyedFrame keyed = WholeCase(context, what, frame, std::move(counts));
  LeaveOutCombining(keyed);
  return keyed;
}

KeyedFrame ForBoxCosts(ExperimentContext& context, const FrameCase& frame) {
  FrameCase settled = frame;
  settled.policy.balance_by = BalanceByOf(frame.policy);
  KeyedFrame keyed = WithoutCombining(context, "box costs", settled);
  // With an open number of groups, boxes also depend on what is known about the volume, and with it on assignment and balance.
  if (frame.policy.groups == 0) return keyed;
  LeaveOut(keyed, "balance", &Policy::balance);
  // Other boxes than those of equal volume are cut for the quickest frame (MakeLayout), which depends on who owns which. Owners have boxes
  // of their own.
  const bool of_owners = FindNamed(OwnerArrangements(), frame.policy.assignment) != nullptr;
  if (settled.policy.balance_by == NameOf(BalanceBy::kVoxels) && !of_owners) LeaveOut(keyed, "assignment", &Policy::assignment);
  return keyed;
}

KeyedFrame ForFinish(ExperimentContext& context, const FrameCase& frame) {
  KeyedFrame keyed = WholeCase(context, "encoded picture", frame);
  keyed.frame.policy = {.groups = 1};
  keyed.frame.workers = 1;
  keyed.key.erase("policy");
  keyed.key.erase("workers");
  return keyed;
}

}  // namespace slabstream
