#include "coordinator/planner.h"

#include <exception>
#include <utility>

#include "common/base/guarded.h"
#include "common/planning/policy_names.h"

namespace slabstream {

Result<std::shared_ptr<const PlannedFrame>> Planner::Plan(const PlanRequest& request) {
  return Guarded("planning", [&] { return TryPlan(request); });
}

std::optional<Result<std::shared_ptr<const PlannedFrame>>> Planner::PlanAtHand(const PlanRequest& request) try {
  constexpr std::size_t kMostBoxes = 4096;  // a plan places each of them
  if (LeavesChoice(request.frame.policy, ServiceMachine(request.workers, surroundings_), request.roster.slots.size())) return std::nullopt;
  Result<ResolvedPolicy> policy = ResolvePolicy(request.frame, request.summary->description.geometry);
  if (!policy.ok()) return std::nullopt;
  std::shared_ptr<const Layout> layout =
      layouts_.FindMade({.policy = &*policy, .volume = &request.volume, .slots = std::uint32_t(request.roster.slots.size())});
  if (layout == nullptr || layout->owners.size() > kMostBoxes) return std::nullopt;
  return WithLayout({.asked = request, .policy = *std::move(policy)}, std::move(layout));
} catch (const std::exception&) {
  return std::nullopt;  // Plan meets the same and says what it is
}

Result<std::shared_ptr<const PlannedFrame>> Planner::TryPlan(const PlanRequest& request) {
  PlannedFrame planned{.asked = request};
  const MachineModel machine = ServiceMachine(request.workers, surroundings_);
  if (LeavesChoice(request.frame.policy, machine, request.roster.slots.size())) {
    Result<ChosenPolicy> chosen = policies_.Find(request, machine, layouts_);
    if (!chosen.ok()) return chosen.status();
    planned.policy = std::move(chosen->policy);
    if (!chosen->chosen) planned.asked.occupied = nullptr;
    planned.prediction = chosen->prediction;
    planned.render_scale = chosen->render_scale;
  } else {
    Result<ResolvedPolicy> policy = ResolvePolicy(request.frame, request.summary->description.geometry);
    if (!policy.ok()) return policy.status();
    planned.policy = *std::move(policy);
  }
  std::shared_ptr<const Layout> layout = layouts_.Find({.policy = &planned.policy,
                                                        .volume = &request.volume,
                                                        .summary = request.summary.get(),
                                                        .occupied = planned.asked.occupied,
                                                        .slots = std::uint32_t(request.roster.slots.size()),
                                                        .stop = request.stop});
  if (layout == nullptr) return Status::Cancelled("the plan is not wanted any more");
  return WithLayout(std::move(planned), std::move(layout));
}

Result<std::shared_ptr<const PlannedFrame>> Planner::WithLayout(PlannedFrame planned, std::shared_ptr<const Layout> layout) {
  const PlanRequest& request = planned.asked;
  Result<FramePlan> plan =
      PlanFrame(request.frame, planned.policy, request.volume.dataset(), *request.summary, request.roster, std::move(layout), request.turn);
  if (!plan.ok()) return plan.status();
  planned.plan = *std::move(plan);
  return std::make_shared<const PlannedFrame>(std::move(planned));
}

void Planner::Learn(const FrameMeasured& measured) {
  const PlannedFrame& frame = *measured.frame;
  layouts_.Learn(frame.asked.volume, frame.plan, frame.policy, measured.reports);
  policies_.Learn(frame, measured.reports);
}

}  // namespace slabstream
