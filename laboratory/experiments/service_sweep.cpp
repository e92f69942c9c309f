#include "laboratory/experiments/service_sweep.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/cli/service_connection.h"
#include "common/planning/frame_window.h"
#include "laboratory/experiments/client_frames.h"
#include "laboratory/experiments/frame_keys.h"

namespace slabstream {
namespace {

constexpr int kLatencyFrames = 5;
constexpr int kAhead = 2;  // frames requested beyond those that the coordinator has under way
constexpr std::int64_t kPixelBytes = 16;

Json RosterOf(const StatusReply& status) {
  std::vector<std::pair<std::string, std::uint32_t>> workers;
  for (const WorkerStatus& worker : status.workers) workers.emplace_back(worker.host, worker.threads);
  std::ranges::sort(workers);
  Json roster = Json::array();
  for (const auto& [host, threads] : workers) roster.push_back({{"host", host}, {"threads", threads}});
  return roster;
}

int FramesInFlight(int workers, const FrameCase& frame) {
  const auto teams = std::uint32_t(std::min(frame.policy.teams, workers));
  return WindowFor(std::size_t(workers), teams, std::int64_t(frame.size.width) * frame.size.height * kPixelBytes).frames + kAhead;
}

// `begin`: the service when the run began.
Trial FramesTrial(Client& client, const StatusReply& begin, const FrameCase& frame) {
  const int in_flight = FramesInFlight(int(begin.workers.size()), frame);
  const Json key = {{"what", "frames of a service"}, {"in flight", in_flight}, {"request", RequestJson(RequestOf(frame))}};
  const auto run = [&client, begin, frame, in_flight]() -> Json {
    const FrameRequest request = RequestOf(frame);
    // The connections between workers are made while frames are in flight, before the latency of a single one is measured.
    (void)MeasureLatency(client, request, WarmUpFrames(frame.policy), 1);
    const double period_ms = MeasurePeriod(client, request, in_flight);
    Json numbers = MeasureLatency(client, request, 1, kLatencyFrames);
    const StatusReply now = OrThrow(client.QueryStatus());
    if (now.workers_lost != begin.workers_lost || RosterOf(now) != RosterOf(begin)) {
      throw Failure(
          Status::Unavailable(fmt::format("the roster of the service has changed: {} workers of {} are there, {} were lost meanwhile",
                                          now.workers.size(), begin.workers.size(), now.workers_lost - begin.workers_lost)));
    }
    numbers["period_ms"] = period_ms;
    return numbers;
  };
  return {.key = key, .run = run};
}

}  // namespace

Json DescribeService(const ServiceChoice& service, const Sweep& sweep) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(service));
  const StatusReply status = OrThrow(connection.client().QueryStatus());
  if (status.workers.empty()) throw Failure(Status::Unavailable("the service has no workers"));
  Json datasets = Json::array();
  for (const BenchCase& volume : sweep.volumes) {
    if (std::ranges::find(status.datasets, volume.dataset, &DatasetStatus::name) == status.datasets.end()) {
      throw Failure(
          Status::NotFound(fmt::format("volumes: the service has no dataset '{}' (`slabstream status` lists them)", volume.dataset)));
    }
    datasets.push_back(volume.dataset);
  }
  return {{"roster", RosterOf(status)}, {"datasets", datasets}};
}

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
  std::vector<Json> workers;
  for (const Json& worker : roster)
    workers.push_back({{"worker", workers.size() + 1}, {"host", worker["host"]}, {"threads", worker["threads"]}});
  results.Attach("roster", std::move(workers));
}

}  // namespace slabstream
