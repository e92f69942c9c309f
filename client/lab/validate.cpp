#include "client/lab/validate.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "client/client.h"
#include "client/embedded/embedded_service.h"
#include "client/lab/calibrate.h"
#include "client/lab/frame_costs.h"
#include "client/lab/thread_time.h"
#include "common/planning/placement.h"

namespace slabstream {
namespace {

constexpr char kDataset[] = "volume";

FrameParts Mean(const std::vector<FrameParts>& frames) {
  FrameParts mean;
  for (const FrameParts& frame : frames) {
    mean.render += frame.render / double(frames.size());
    mean.picture += frame.picture / double(frames.size());
    mean.latency += frame.latency / double(frames.size());
  }
  return mean;
}

// Each part by itself.
FrameParts Median(const std::vector<FrameParts>& frames) {
  const auto median = [&](double FrameParts::*part) {
    std::vector<double> values;
    for (const FrameParts& frame : frames) values.push_back(frame.*part);
    return UpperMedian(std::move(values));
  };
  return {median(&FrameParts::render), median(&FrameParts::picture), median(&FrameParts::latency)};
}

FrameParts PartsOf(const Picture& picture) {
  FrameParts parts{.latency = double(picture.latency.count()) * 1e-9};
  std::map<std::uint32_t, double> render;  // by worker
  for (const RankReport& report : picture.statistics.reports) {
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

std::vector<FrameRequest> Views(const ValidationCase& what, int views) {
  std::vector<FrameRequest> requests(std::size_t(views), what.request);
  for (int i = 0; i < views; ++i) {
    requests[std::size_t(i)].dataset = kDataset;
    requests[std::size_t(i)].view.azimuth_degrees = 360.0 * i / views;
  }
  return requests;
}

// Medians by view; turn after turn, so that what disturbs the machine for a while disturbs all views.
Result<std::vector<FrameParts>> MeasureService(const ValidationCase& what, const std::vector<FrameRequest>& requests, int turns) {
  Context context;
  EmbeddedOptions options;
  options.workers = what.workers;
  options.coordinator.catalogue[kDataset] = [volume = what.volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  Result<std::unique_ptr<EmbeddedService>> service = EmbeddedService::Start(context, std::move(options));
  if (!service.ok()) return service.status();
  Result<Client> client = Client::Connect(context, (*service)->endpoint());
  if (!client.ok()) return client.status();
  std::vector<std::vector<FrameParts>> frames(requests.size());
  for (int turn = -1; turn < turns; ++turn) {  // the first one fetches voxels and makes normals
    for (std::size_t i = 0; i < requests.size(); ++i) {
      const Result<Picture> picture = client->Render(requests[i]);
      if (!picture.ok()) return picture.status();
      if (turn >= 0) frames[i].push_back(PartsOf(*picture));
    }
  }
  std::vector<FrameParts> medians;
  for (const std::vector<FrameParts>& of_view : frames) medians.push_back(Median(of_view));
  return medians;
}

}  // namespace

FrameParts ValidationRow::MeanMeasured() const { return Mean(measured); }
FrameParts ValidationRow::MeanSimulated() const { return Mean(simulated); }

double ValidationRow::worst_error() const {
  double worst = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const double error = simulated[i].latency / measured[i].latency - 1;
    if (std::abs(error) > std::abs(worst)) worst = error;
  }
  return worst;
}

Result<ValidationRow> ValidateSimulation(const ValidationCase& what, const ValidationOptions& options) {
  ValidationRow row{.name = what.name, .workers = what.workers};
  const std::vector<FrameRequest> requests = Views(what, options.views);
  Result<MachineModel> machine = CalibrateThisHost(what.workers);
  if (!machine.ok()) return machine.status();
  const Roster roster = RosterOf(std::uint32_t(what.workers));
  const VolumeSummary summary = Summarize(*what.volume);
  for (const FrameRequest& request : requests) {
    const Result<FramePlan> plan = PlanFrame(request, 1, summary, roster, CostModel{});
    if (!plan.ok()) return plan.status();
    if (row.simulated.empty()) {
      machine->memory_slowdown = row.memory_slowdown = MeasureMemorySlowdown(*what.volume, plan->setup);
    }
    const FrameCosts costs = MeasureFrameCosts(*what.volume, *plan, options.repeats);
    const FrameInput input = costs.Input(*plan);
    const Result<Timeline> timeline = SimulateFrames(std::span(&input, 1), *machine);
    if (!timeline.ok()) return timeline.status();
    row.simulated.push_back(PartsOf(*timeline));
  }
  Result<std::vector<FrameParts>> measured = MeasureService(what, requests, options.turns);
  if (!measured.ok()) return measured.status();
  row.measured = *std::move(measured);
  return row;
}

}  // namespace slabstream
