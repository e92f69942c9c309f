#include "coordinator/planner/planner.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "common/planning/levels.h"
#include "common/planning/shown_zones.h"
#include "common/planning/worker_memory.h"
#include "common/threads/guarded.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

// The worker with the least memory decides: any box may come to it after a loss.
std::int64_t BoxTarget(const FrameSetup& setup, const PlanRequest& request) {
  const std::int64_t target = BoxBytesFor(setup, request.worker_memory);
  if (!setup.cells || request.own_memory == 0) return target;
  // The coordinator holds the lattice and what every coordinator takes. Beside these it has the cells of a box four times: those that it
  // sent last once, and those that it cuts out three times. Four times are twice what BoxBytesOfCells says; a third part stays free.
  constexpr std::uint64_t kLeast = 2 << 20;
  const std::uint64_t taken = kIdleMemoryBytes / 2 + std::uint64_t(setup.description.voxel_bytes());
  const std::uint64_t room = request.own_memory - std::min(request.own_memory, taken);
  return std::min(target, std::int64_t(std::max(room / 3, kLeast)));
}

// Each field as it is drawn beside the finest level.
ShownFields AtOneLevel(ShownFields fields) {
  for (FieldVolume& field : fields.others) field.of_volume = {field.of_volume.front()};
  return fields;
}

// Whether the frame fits if it is drawn from this level. Nobody may have loaded it, so it counts as one that is read in parts.
bool FitsAt(const VolumeDescription& level, const FrameRequest& frame, const VolumeLevels& levels, const PlanRequest& request) {
  constexpr Index3 kSomeBlock = {32, 32, 32};
  auto summary = std::make_shared<VolumeSummary>(UnreadSummary(level, *levels.overview));
  summary->stored = StoredAt{.source = {}, .block = {{0, 0, 0}, kSomeBlock}};
  Result<ResolvedRequest> resolved = ResolveRequest(AtLevel(frame, levels.levels.front().geometry, level.geometry),
                                                    request.resolved->volume.dataset(), summary, AtOneLevel(request.resolved->fields));
  if (!resolved.ok()) return false;
  resolved->frame.shading = {};  // its light volume is that of the dataset, whichever level is drawn
  Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return false;
  const std::size_t slots = request.roster.slots.size();
  const std::shared_ptr<const LevelMap> map = ShownZones(*setup);
  auto layout = std::make_shared<const Layout>(MakeLayout({.summary = summary.get(),
                                                           .volume = &resolved->volume,
                                                           .policy = &resolved->policy,
                                                           .slots = std::uint32_t(slots),
                                                           .box_bytes_target = BoxTarget(*setup, request),
                                                           .map = map.get(),
                                                           .stop = request.stop}));
  const Result<FramePlan> plan = PlanFrame(*std::move(setup), resolved->policy, request.roster, std::move(layout), request.turn);
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
  const VolumeSummary& summary = *request.resolved->summary;
  if (!summary.cells.empty() || summary.description.geometry.rectilinear()) return std::nullopt;  // they have none
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
  if (resolved.summary->stored && resolved.map == nullptr) return std::nullopt;  // to find its ShownZones may take long
  LayoutTable::Request wanted{
      .policy = &resolved.policy, .volume = &resolved.volume, .slots = std::uint32_t(slots), .hosts = request.hosts, .map = resolved.map};
  if (!layouts_.HasMade(wanted)) return std::nullopt;
  Result<FrameSetup> setup = MakeFrameSetup(resolved);
  if (!setup.ok()) return setup.status();
  wanted.box_bytes_target = BoxTarget(*setup, request);
  std::shared_ptr<const Layout> layout = layouts_.FindMade(wanted);
  if (layout == nullptr || layout->owners.size() > kMostBoxes) return std::nullopt;
  Result<PlannedFrame> planned = WithLayout(request, *std::move(setup), std::move(layout));
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
  LayoutTable::Request wanted = WantedLayout(request, *setup);
  wanted.stop = request.stop;
  std::shared_ptr<const Layout> layout = layouts_.Find(wanted);
  if (layout == nullptr) return Status::Cancelled("the plan is not wanted any more");
  Result<PlannedFrame> with_layout = WithLayout(request, *std::move(setup), std::move(layout));
  if (!with_layout.ok()) return with_layout.status();
  if (!with_layout->fit.ok()) with_layout->level_that_fits = LevelThatFits(request);
  return std::make_shared<const PlannedFrame>(*std::move(with_layout));
}

LayoutTable::Request Planner::WantedLayout(const PlanRequest& request, const FrameSetup& setup) {
  const ResolvedRequest& resolved = *request.resolved;
  return {.policy = &resolved.policy,
          .volume = &resolved.volume,
          .summary = resolved.summary.get(),
          .occupied = request.occupied,
          .slots = std::uint32_t(request.roster.slots.size()),
          .hosts = request.hosts,
          .box_bytes_target = BoxTarget(setup, request),
          .map = resolved.map != nullptr ? resolved.map : ShownZones(setup),
          .coarser = resolved.coarser};
}

Result<PlannedFrame> Planner::WithLayout(const PlanRequest& asked, FrameSetup setup, std::shared_ptr<const Layout> layout) {
  Result<FramePlan> plan = PlanFrame(
      std::move(setup), asked.resolved->policy, asked.roster, std::move(layout), asked.turn,
      {.share_pixels = asked.share_pixels, .straight8 = asked.resolved->frame.straight8 && !asked.resolved->frame.straight8_over});
  if (!plan.ok()) return plan.status();
  Result<int> fit = FramesThatFit(*plan, *asked.resolved->summary, asked.limits);
  return PlannedFrame{.asked = asked, .plan = *std::move(plan), .fit = std::move(fit)};
}

void Planner::Learn(const FrameMeasured& measured) {
  const PlannedFrame& frame = *measured.frame;
  layouts_.Learn(WantedLayout(frame.asked, frame.plan.setup), frame.plan, measured.reports);
}

}  // namespace slabstream
