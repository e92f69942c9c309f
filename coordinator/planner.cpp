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
  FrameRequest frame = request.frame;
  frame.policy = SettledPolicy(frame, request.summary->description.geometry);
  const auto slots = std::uint32_t(request.roster.slots.size());
  if (LeavesChoice(frame.policy)) {
    const MachineModel machine = ServiceMachine(request.workers, config_.surroundings);
    const Result<ChosenPolicy> chosen = policies_.Find({.frame = &frame,
                                                        .volume = &request.volume,
                                                        .summary = request.summary.get(),
                                                        .occupied = request.occupied,
                                                        .slots = slots,
                                                        .machine = &machine,
                                                        .cost = &config_.cost,
                                                        .layouts = &layouts_});
    if (!chosen.ok()) return chosen.status();
    frame.policy = chosen->policy;
    planned->prediction = chosen->prediction;
    planned->render_scale = chosen->render_scale;
  }
  const Layout& layout = layouts_.Find({.frame = &frame,
                                        .volume = &request.volume,
                                        .summary = request.summary.get(),
                                        .occupied = request.occupied,
                                        .slots = slots,
                                        .slab_bytes_target = config_.cost.slab_bytes_target});
  Result<FramePlan> plan =
      PlanFrame(frame, request.volume.dataset(), *request.summary, request.roster, config_.cost, &layout, request.turn);
  if (!plan.ok()) return plan.status();
  planned->policy = std::move(frame.policy);
  planned->plan = *std::move(plan);
  return std::shared_ptr<const PlannedFrame>(std::move(planned));
}

void Planner::Learn(const FrameMeasured& measured) {
  const PlannedFrame& frame = *measured.frame;
  layouts_.Learn(frame.asked.volume, frame.plan, frame.policy, measured.reports);
  policies_.Learn(frame, measured.reports);
}

}  // namespace slabstream
