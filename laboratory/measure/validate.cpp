#include "laboratory/measure/validate.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/mesh/summarize_cells.h"
#include "common/planning/placement.h"
#include "laboratory/measure/calibrate.h"
#include "laboratory/measure/frame_costs.h"
#include "laboratory/measure/lab_service.h"
#include "laboratory/measure/plan_renderings.h"
#include "simulator/simulate_frames.h"

namespace slabstream {
namespace {

constexpr int kWakeUpSamples = 4;  // a turn

FrameParts PartsOf(const TimedPicture& timed) {
  FrameParts parts{.latency = double((timed.received - timed.submitted).count()) * 1e-9};
  std::map<std::uint32_t, double> render;  // by worker
  for (const RankReport& report : timed.picture.statistics.reports) {
    render[report.worker] += double(report.stage_ns[std::size_t(Stage::kRender)]) * 1e-9;
    parts.picture += double(PictureNs(report)) * 1e-9;
  }
  for (const auto& [worker, seconds] : render) parts.render = std::max(parts.render, seconds);
  return parts;
}

FrameParts PartsOf(const Timeline& timeline) {
  FrameParts parts{.latency = timeline.frames[0].latency()};
  std::map<std::uint32_t, double> render;
  for (const SimulatedSpan& span : timeline.spans) {
    if (span.stage == Stage::kRender) render[span.worker] += span.end - span.begin;
    if (span.stage == Stage::kResolve) parts.picture += span.end - span.begin;
  }
  for (const auto& [worker, seconds] : render) parts.render = std::max(parts.render, seconds);
  return parts;
}

FrameParts MedianParts(const std::vector<FrameParts>& frames) {
  const auto median = [&](double FrameParts::*part) { return MedianOf(EachOf(frames, part)).median; };
  return {median(&FrameParts::render), median(&FrameParts::picture), median(&FrameParts::latency)};
}

// Everything that belongs to one view.
struct View {
  FrameRequest request;
  FramePlan plan;
  std::vector<CoverageMap> coverage;  // by BoxId
  std::vector<FrameParts> measured, simulated;
};

Result<std::vector<View>> MakeViews(const ValidationCase& what, int count) {
  const Roster roster = RosterOf(std::uint32_t(what.workers));
  const VolumeSummary summary = SummaryOf(*what.volume);
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    View& view = views.emplace_back(View{.request = what.request});
    view.request.dataset = what.name;
    view.request.straight8 = true;
    *view.request.view.azimuth_degrees += 360.0 * i / count;
    Result<FramePlan> plan = PlanFrame(view.request, 1, summary, roster);
    if (!plan.ok()) return plan.status();
    view.plan = *std::move(plan);
    const std::vector<Placement> placements = PlacementsOf(view.plan);
    std::vector<BoxCost> boxes = MeasureBoxCosts(*what.volume, view.plan, 1);
    view.coverage.resize(view.plan.layout->partition.boxes().size());
    for (std::size_t box = 0; box < boxes.size(); ++box) view.coverage[placements[box].id] = std::move(boxes[box].coverage);
  }
  return views;
}

}  // namespace

ValidatedView ValidationRow::Mean() const {
  ValidatedView mean;
  const double share = 1.0 / double(views.size());
  const auto add = [&](FrameParts& to, const FrameParts& from) {
    to.render += share * from.render;
    to.picture += share * from.picture;
    to.latency += share * from.latency;
  };
  for (const ValidatedView& view : views) {
    add(mean.measured, view.measured);
    add(mean.simulated, view.simulated);
    mean.measured_low += share * view.measured_low;
    mean.measured_high += share * view.measured_high;
    mean.simulated_low += share * view.simulated_low;
    mean.simulated_high += share * view.simulated_high;
  }
  return mean;
}

Result<ValidationRow> ValidateSimulation(const ValidationCase& what, const ValidationOptions& options) {
  if (what.workers < 1 || what.workers > 2) {
    return Status::InvalidArgument("workers " + std::to_string(what.workers) + " is out of range [1, 2]");
  }
  Result<std::vector<View>> views = MakeViews(what, options.views);
  if (!views.ok()) return views.status();
  WakeUpProbe probe;
  Result<ServiceConnection> service = OpenLabService(what.workers, {what.volume});
  if (!service.ok()) return service.status();
  for (View& view : *views) view.request.dataset = service->dataset();
  PlanRenderings renderings(*what.volume, what.workers);
  PictureMeter pictures(*what.volume, what.workers);
  MachineModel machine = ThisHost(what.workers);
  std::vector<double> slowdowns;

  for (int turn = -1; turn < options.turns; ++turn) {  // the first turn fetches voxels and makes normals
    if (Status status = probe.Sample(kWakeUpSamples); !status.ok()) return status;
    for (View& view : *views) {
      if (const Result<Picture> first = service->client().Render(view.request); !first.ok()) return first.status();
      const Result<TimedPicture> timed = RenderTimed(service->client(), view.request);
      if (!timed.ok()) return timed.status();
      renderings.Measure(view.plan);
      const PlanSeconds seconds = renderings.Measure(view.plan);
      pictures.Measure(view.plan.setup);
      const PictureCost picture = pictures.Measure(view.plan.setup);
      if (turn < 0) continue;

      // A picture is measured with all the threads that make it.
      FrameInput input{&view.plan, {}, picture.finish_elapsed, picture.receive_seconds};
      for (std::size_t box = 0; box < view.coverage.size(); ++box) {
        const CoverageMap& coverage = view.coverage[box];
        input.boxes.push_back({seconds.boxes[box], coverage.share.empty() ? nullptr : &coverage, 0});
      }
      slowdowns.push_back(seconds.slowdown);
      machine.wake_ups = probe.Estimates().Costs();
      machine.memory_slowdown = std::clamp(seconds.slowdown, 0.0, 0.99);
      const Result<Timeline> timeline = SimulateFrames(std::span(&input, 1), machine);
      if (!timeline.ok()) return timeline.status();
      view.measured.push_back(PartsOf(*timed));
      view.simulated.push_back(PartsOf(*timeline));
    }
  }

  ValidationRow row{.name = what.name, .workers = what.workers, .machine = machine, .wake_ups = probe.Estimates()};
  if (what.workers == 2) row.slowdown = MedianOf(std::move(slowdowns));
  for (const View& view : *views) {
    const auto quartile = [&](const std::vector<FrameParts>& frames, double share) {
      return Quantile(EachOf(frames, &FrameParts::latency), share);
    };
    row.views.push_back({view.request.view, MedianParts(view.measured), MedianParts(view.simulated), quartile(view.measured, 0.25),
                         quartile(view.measured, 0.75), quartile(view.simulated, 0.25), quartile(view.simulated, 0.75)});
  }
  return row;
}

}  // namespace slabstream
