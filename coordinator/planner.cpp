#include "coordinator/planner.h"

#include <algorithm>
#include <exception>
#include <span>
#include <utility>

#include "common/planning/levels.h"
#include "common/planning/policy_names.h"
#include "common/planning/shown_zones.h"
#include "common/planning/worker_memory.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

// The worker with the least memory decides: any box may come to it after a loss.
std::int64_t BoxTarget(const FrameSetup& setup, std::span<const HostedWorker> workers) {
  std::int64_t target = kBoxBytesTarget;
  for (const HostedWorker& worker : workers) target = std::min(target, BoxBytesFor(setup, worker.memory_bytes));
  return target;
}

// Whether the frame fits if it is drawn from this level. Nobody may have loaded it, so it counts as one that is read in parts.
bool FitsAt(const VolumeDescription& level, const FrameRequest& frame, const VolumeLevels& levels, const PlanRequest& request) {
  constexpr Index3 kSomeBlock = {32, 32, 32};
  auto summary = std::make_shared<VolumeSummary>(UnreadSummary(level, *levels.overview));
  summary->stored = StoredAt{.source = {}, .block = {{0, 0, 0}, kSomeBlock}};
  Result<ResolvedRequest> resolved =
      ResolveRequest(AtLevel(frame, levels.levels.front().geometry, level.geometry), request.resolved->volume.dataset(), summary);
  if (!resolved.ok()) return false;
  resolved->frame.shading = {};  // its light volume is that of the dataset, whichever level is drawn
  Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return false;
  const std::size_t slots = request.roster.slots.size();
  const ResolvedPolicy policy =
      resolved->policy ? *resolved->policy : ResolvePolicy(FirstPolicy(resolved->frame.policy, slots), level.geometry);
  const std::shared_ptr<const LevelMap> map = ShownZones(*setup);
  auto layout = std::make_shared<const Layout>(MakeLayout({.summary = summary.get(),
                                                           .volume = &resolved->volume,
                                                           .policy = &policy,
                                                           .slots = std::uint32_t(slots),
                                                           .box_bytes_target = BoxTarget(*setup, request.workers),
                                                           .map = map.get(),
                                                           .stop = request.stop}));
  const Result<FramePlan> plan = PlanFrame(*std::move(setup), policy, request.roster, std::move(layout), request.turn);
  return plan.ok() && FramesThatFit(*plan, *summary, request.limits).ok();
}

// The levels that slabstream convert would make of a volume that has one.
VolumeLevels LevelsToMake(const std::shared_ptr<const VolumeSummary>& summary) {
  constexpr std::size_t kMost = 8;
  VolumeLevels levels{.levels = {summary->description}, .overview = summary};
  for (VolumeDescription next = summary->description; levels.levels.size() < kMost; levels.levels.push_back(next)) {
    VolumeGeometry& geometry = next.geometry;
    geometry.size = (geometry.size + Uniform(1)) / 2;
    geometry.spacing = 2.0 * geometry.spacing;
  }
  return levels;
}

// The finest of the levels that are coarser than what the request draws and that fit.
std::optional<int> LevelThatFits(const PlanRequest& request) {
  if (request.resolved->summary->layers().any() || !request.resolved->summary->cells.empty()) return std::nullopt;  // they have none
  const VolumeLevels levels = request.levels != nullptr ? *request.levels : LevelsToMake(request.resolved->summary);
  const FrameRequest& frame = request.levels != nullptr ? *request.frame : request.resolved->frame;
  for (std::size_t level = std::size_t(request.level) + 1; level < levels.levels.size(); ++level) {
    if (FitsAt(levels.levels[level], frame, levels, request)) return int(level);
  }
  return std::nullopt;
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
  if (resolved.summary->stored && resolved.map == nullptr) return std::nullopt;  // to find its ShownZones may take long
  LayoutTable::Request wanted{.policy = &*resolved.policy, .volume = &resolved.volume, .slots = std::uint32_t(slots), .map = resolved.map};
  if (!layouts_.HasMade(wanted)) return std::nullopt;
  Result<FrameSetup> setup = MakeFrameSetup(resolved);
  if (!setup.ok()) return setup.status();
  wanted.box_bytes_target = BoxTarget(*setup, request.workers);
  std::shared_ptr<const Layout> layout = layouts_.FindMade(wanted);
  if (layout == nullptr || layout->owners.size() > kMostBoxes) return std::nullopt;
  Result<PlannedFrame> planned = WithLayout({.asked = request, .policy = *resolved.policy}, *std::move(setup), std::move(layout));
  if (!planned.ok()) return planned.status();
  if (!planned->fit.ok()) return std::nullopt;  // Plan looks for a level that fits
  return std::make_shared<const PlannedFrame>(*std::move(planned));
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
  LayoutTable::Request wanted = WantedLayout(planned.asked, planned.policy, *setup);
  wanted.stop = request.stop;
  std::shared_ptr<const Layout> layout = layouts_.Find(wanted);
  if (layout == nullptr) return Status::Cancelled("the plan is not wanted any more");
  Result<PlannedFrame> with_layout = WithLayout(std::move(planned), *std::move(setup), std::move(layout));
  if (!with_layout.ok()) return with_layout.status();
  if (!with_layout->fit.ok()) with_layout->level_that_fits = LevelThatFits(request);
  return std::make_shared<const PlannedFrame>(*std::move(with_layout));
}

LayoutTable::Request Planner::WantedLayout(const PlanRequest& request, const ResolvedPolicy& policy, const FrameSetup& setup) {
  const ResolvedRequest& resolved = *request.resolved;
  return {.policy = &policy,
          .volume = &resolved.volume,
          .summary = resolved.summary.get(),
          .occupied = request.occupied,
          .slots = std::uint32_t(request.roster.slots.size()),
          .box_bytes_target = BoxTarget(setup, request.workers),
          .map = resolved.map != nullptr ? resolved.map : ShownZones(setup),
          .coarser = resolved.coarser};
}

Result<PlannedFrame> Planner::WithLayout(PlannedFrame planned, FrameSetup setup, std::shared_ptr<const Layout> layout) {
  const PlanRequest& asked = planned.asked;
  Result<FramePlan> plan = PlanFrame(std::move(setup), planned.policy, asked.roster, std::move(layout), asked.turn,
                                     {.share_pixels = asked.share_pixels, .straight8 = asked.resolved->frame.straight8});
  if (!plan.ok()) return plan.status();
  planned.plan = *std::move(plan);
  planned.fit = FramesThatFit(planned.plan, *asked.resolved->summary, asked.limits);
  return planned;
}

void Planner::Learn(const FrameMeasured& measured) {
  const PlannedFrame& frame = *measured.frame;
  layouts_.Learn(WantedLayout(frame.asked, frame.policy, frame.plan.setup), frame.plan, measured.reports);
  policies_.Learn(frame, measured.reports);
}

}  // namespace slabstream
