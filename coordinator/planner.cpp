#include "coordinator/planner.h"

#include <algorithm>
#include <exception>
#include <span>
#include <utility>

#include "common/base/guarded.h"
#include "common/planning/policy_names.h"
#include "common/planning/worker_memory.h"

namespace slabstream {
namespace {

// The worker with the least memory decides: any box may come to it after a loss.
std::int64_t BoxTarget(const FrameSetup& setup, std::span<const HostedWorker> workers) {
  std::int64_t target = kBoxBytesTarget;
  for (const HostedWorker& worker : workers) target = std::min(target, BoxBytesFor(setup, worker.memory_bytes));
  return target;
}

}  // namespace

Result<std::shared_ptr<const PlannedFrame>> Planner::Plan(const PlanRequest& request) {
  return Guarded("planning", [&] { return TryPlan(request); });
}

std::optional<Result<std::shared_ptr<const PlannedFrame>>> Planner::PlanAtHand(const PlanRequest& request) try {
  constexpr std::size_t kMostBoxes = 4096;  // a plan places each of them
  const ResolvedRequest& resolved = *request.resolved;
  const std::size_t slots = request.roster.slots.size();
  if (LeavesChoice(resolved.frame.policy, ServiceMachine(request.workers, surroundings_), slots)) return std::nullopt;
  Result<FrameSetup> setup = MakeFrameSetup(resolved);
  if (!setup.ok()) return setup.status();
  std::shared_ptr<const Layout> layout = layouts_.FindMade({.policy = &*resolved.policy,
                                                            .volume = &resolved.volume,
                                                            .slots = std::uint32_t(slots),
                                                            .box_bytes_target = BoxTarget(*setup, request.workers),
                                                            .map = resolved.map});
  if (layout == nullptr || layout->owners.size() > kMostBoxes) return std::nullopt;
  return WithLayout({.asked = request, .policy = *resolved.policy}, *std::move(setup), std::move(layout));
} catch (const std::exception&) {
  return std::nullopt;  // Plan meets the same and says what it is
}

Result<std::shared_ptr<const PlannedFrame>> Planner::TryPlan(const PlanRequest& request) {
  const ResolvedRequest& resolved = *request.resolved;
  Result<FrameSetup> setup = MakeFrameSetup(resolved);
  if (!setup.ok()) return setup.status();
  PlannedFrame planned{.asked = request};
  const MachineModel machine = ServiceMachine(request.workers, surroundings_);
  const std::size_t slots = request.roster.slots.size();
  const bool unknown = setup->stored || resolved.map != nullptr;
  if (unknown && LeavesChoice(resolved.frame.policy, machine, slots)) {
    // Nothing is known of the work in voxels that nobody has read, or that are drawn from several levels.
    planned.policy = ResolvePolicy(FirstPolicy(resolved.frame.policy, slots), setup->description.geometry);
  } else if (LeavesChoice(resolved.frame.policy, machine, slots)) {
    ChosenPolicy chosen = policies_.Find(request, machine, layouts_);
    planned.policy = std::move(chosen.policy);
    if (!chosen.chosen) planned.asked.occupied = nullptr;
    planned.prediction = chosen.prediction;
    planned.render_scale = chosen.render_scale;
  } else {
    planned.policy = *resolved.policy;
  }
  std::shared_ptr<const Layout> layout = layouts_.Find({.policy = &planned.policy,
                                                        .volume = &resolved.volume,
                                                        .summary = resolved.summary.get(),
                                                        .occupied = planned.asked.occupied,
                                                        .slots = std::uint32_t(slots),
                                                        .box_bytes_target = BoxTarget(*setup, request.workers),
                                                        .map = resolved.map,
                                                        .coarser = resolved.coarser,
                                                        .stop = request.stop});
  if (layout == nullptr) return Status::Cancelled("the plan is not wanted any more");
  return WithLayout(std::move(planned), *std::move(setup), std::move(layout));
}

Result<std::shared_ptr<const PlannedFrame>> Planner::WithLayout(PlannedFrame planned, FrameSetup setup,
                                                                std::shared_ptr<const Layout> layout) {
  Result<FramePlan> plan = PlanFrame(std::move(setup), planned.policy, planned.asked.roster, std::move(layout), planned.asked.turn);
  if (!plan.ok()) return plan.status();
  planned.plan = *std::move(plan);
  return std::make_shared<const PlannedFrame>(std::move(planned));
}

void Planner::Learn(const FrameMeasured& measured) {
  const PlannedFrame& frame = *measured.frame;
  layouts_.Learn(frame.asked.resolved->volume, frame.plan, frame.policy, measured.reports);
  policies_.Learn(frame, measured.reports);
}

}  // namespace slabstream
