#include "laboratory/experiments/service_sweep.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/cli/service_connection.h"
#include "laboratory/experiments/client_frames.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/service_roster.h"

namespace slabstream {
namespace {

constexpr int kLatencyFrames = 5;

// `begin`: the service when the run began.
Trial FramesTrial(Client& client, const StatusReply& begin, const FrameCase& frame) {
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

}  // namespace

void RunServiceSweep(ExperimentContext& context, const Sweep& sweep, Results& results) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(context.options().own.service));
  const StatusReply begin = OrThrow(connection.client().QueryStatus());
  const Json roster = RosterOf(begin);
  const std::vector<SweepFrame> frames = FramesOf(sweep);
  std::vector<Trial> trials;
  trials.reserve(frames.size());
  for (const SweepFrame& asked : frames) trials.push_back(FramesTrial(connection.client(), begin, asked.frame));
  context.Run(trials);

  constexpr struct {
    const char *metric, *number;
    double factor;
  } kFields[] = {{"latency", "latency_ms", 1e-3},    {"period", "period_ms", 1e-3},
                 {"render_time", "render_ms", 1e-3}, {"longest_render_time", "longest_render_ms", 1e-3},
                 {"imbalance", "imbalance", 1},      {"idle_share", "idle_share", 1},
                 {"image_bytes", "image_bytes", 1}};
  for (std::size_t i = 0; i < frames.size(); ++i) {
    FrameCase frame = frames[i].frame;
    frame.workers = int(roster.size());
    Json columns = ColumnsOf(frame);
    columns.update(frames[i].names);
    for (const auto& [metric, number, factor] : kFields) {
      results.Add(columns, metric, ValuesOf(context.log(), trials[i].key, number, factor), Origin::kMeasured);
    }
  }
  AttachRoster(results, roster);
}

}  // namespace slabstream
