#include "coordinator/planner.h"

#include <utility>

#include "common/base/guarded.h"
#include "common/planning/policy_names.h"

namespace slabstream {

Result<std::shared_ptr<const PlannedFrame>> Planner::Plan(const PlanRequest& request) {
  return Guarded("planning", [&] { return TryPlan(request); });
}

Result<std::shared_ptr<const PlannedFrame>> Planner::TryPlan(const PlanRequest& request) {
  auto planned = std::make_shared<PlannedFrame>(PlannedFrame{.asked = request, .policy = {}, .prediction = {}, .plan = {}});
  const VolumeGeometry& geometry = request.summary->description.geometry;
  const auto slots = std::uint32_t(request.roster.slots.size());
  if (LeavesChoice(request.frame.policy)) {
    FrameRequest frame = request.frame;
    frame.policy = SettledPolicy(frame, geometry);
    const MachineModel machine = ServiceMachine(request.workers, config_.surroundings);
    const Result<ChosenPolicy> chosen = policies_.Find({.frame = &frame,
                                                        .volume = &request.volume,
                                                        .summary = request.summary.get(),
                                                        .occupied = request.occupied,
                                                        .slots = slots,
                                                        .machine = &machine,
                                                        .slab_bytes_target = config_.slab_bytes_target,
                                                        .layouts = &layouts_});
    if (!chosen.ok()) return chosen.status();
    planned->policy = chosen->policy;
    planned->prediction = chosen->prediction;
    planned->render_scale = chosen->render_scale;
  } else {
    Result<ResolvedPolicy> policy = ResolvePolicy(request.frame, geometry);
    if (!policy.ok()) return policy.status();
    planned->policy = *std::move(policy);
  }
  std::shared_ptr<const Layout> layout = layouts_.Find({.policy = &planned->policy,
                                                        .volume = &request.volume,
                                                        .summary = request.summary.get(),
                                                        .occupied = request.occupied,
                                                        .slots = slots,
                                                        .slab_bytes_target = config_.slab_bytes_target});
  Result<FramePlan> plan = PlanFrame(request.frame, planned->policy, request.volume.dataset(), *request.summary, request.roster,
                                     std::move(layout), request.turn);
  if (!plan.ok()) return plan.status();
  planned->plan = *std::move(plan);
  return std::shared_ptr<const PlannedFrame>(std::move(planned));
}

void Planner::Learn(const FrameMeasured& measured) {
  const PlannedFrame& frame = *measured.frame;
  layouts_.Learn(frame.asked.volume, frame.plan, frame.policy, measured.reports);
  policies_.Learn(frame, measured.reports);
}

}  // namespace slabstream
