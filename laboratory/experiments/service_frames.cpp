#include "laboratory/experiments/service_frames.h"

#include <string>

#include "client/cli/service_connection.h"
#include "laboratory/experiments/client_frames.h"
#include "laboratory/experiments/request_json.h"
#include "laboratory/experiments/service_roster.h"

namespace slabstream {
namespace {

constexpr int kLatencyFrames = 5;

// `begin`: the service when the run began.
Trial ServiceFramesTrial(Client& client, const StatusReply& begin, const FrameCase& frame) {
  const int in_flight = FramesInFlight(int(begin.workers.size()), frame);
  const Json key = {{"what", "frames of a service"}, {"in flight", in_flight}, {"request", RequestJson(RequestOf(frame))}};
  const auto run = [&client, begin, frame, in_flight]() -> Json {
    const FrameRequest request = RequestOf(frame);
    // The connections between workers are made while frames are in flight, before the latency of a single one is measured.
    (void)MeasureLatency(client, request, WarmUpFrames(frame.policy), 1);
    const double period_ms = MeasurePeriod(client, std::span(&request, 1), in_flight);
    Json numbers = MeasureLatency(client, request, 1, kLatencyFrames);
    CheckRoster(client, begin);
    numbers["period_ms"] = period_ms;
    return numbers;
  };
  return {.key = key, .run = run};
}

void AddServiceFrames(Results& results, const Json& of, const TrialLog& log, const Trial& trial) {
  constexpr struct {
    const char *metric, *number;
    double factor;
  } kFields[] = {{"latency", "latency_ms", 1e-3},      {"period", "period_ms", 1e-3},
                 {"render_time", "render_ms", 1e-3},   {"longest_render_time", "longest_render_ms", 1e-3},
                 {"picture_time", "picture_ms", 1e-3}, {"imbalance", "imbalance", 1},
                 {"idle_share", "idle_share", 1},      {"image_bytes", "image_bytes", 1}};
  for (const auto& [metric, number, factor] : kFields) {
    results.Add(of, metric, ValuesOf(log, trial.key, number, factor), Origin::kMeasured);
  }
  for (const Stage stage : {Stage::kTransform, Stage::kShade, Stage::kSplat, Stage::kComposite, Stage::kZBuffer}) {
    const std::string name(ToString(stage));
    const std::vector<double> seconds = ValuesOf(log, trial.key, "/longest_stages_ms/" + name, 1e-3);
    if (MedianOf(seconds).median <= 0) continue;
    Json at = of;
    at["stage"] = name;
    results.Add(at, "stage_time", seconds, Origin::kMeasured);
  }
}

}  // namespace

void MeasureAtService(ExperimentContext& context, Results& results, const std::function<std::vector<ServedFrame>(int workers)>& frames) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(context.options().own.service));
  const StatusReply begin = OrThrow(connection.client().QueryStatus());
  const Json roster = RosterOf(begin);
  const std::vector<ServedFrame> served = frames(int(roster.size()));
  std::vector<Trial> trials;
  trials.reserve(served.size());
  for (const ServedFrame& of : served) trials.push_back(ServiceFramesTrial(connection.client(), begin, of.frame));
  context.Run(trials);
  for (std::size_t i = 0; i < served.size(); ++i) AddServiceFrames(results, served[i].columns, context.log(), trials[i]);
  AttachRoster(results, roster);
}

}  // namespace slabstream
