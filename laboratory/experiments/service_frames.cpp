#include "laboratory/experiments/service_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/service_connection.h"
#include "client/report/frame_summary.h"
#include "common/planning/frame_window.h"
#include "laboratory/experiments/client_frames.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/request_json.h"

namespace slabstream {
namespace {

constexpr int kAhead = 2;  // frames requested beyond those that the coordinator has under way
constexpr std::int64_t kPixelBytes = 16;

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

Json KeyOf(const StatusReply& begin, const Walk& walk) {
  Json requests = Json::array();
  for (int step = 0; step < walk.frames; ++step) requests.push_back(RequestJson(RequestOf(FrameOf(walk, step))));
  return {{"what", "walk at a service"},
          {"path", walk.path->name},
          {"frames", walk.frames},
          {"in flight", FramesInFlight(int(begin.workers.size()), walk.frame)},
          {"digest", DigestText(requests.dump())},
          {"request", requests.front()}};
}

Json MeasureWalk(Client& client, const Walk& walk, int in_flight) {
  Json longest = Json::array(), imbalance = Json::array(), render = Json::array(), moved = Json::array(), latency = Json::array();
  std::vector<FrameRequest> requests;
  for (int step = 0; step < walk.frames; ++step) {
    requests.push_back(RequestOf(FrameOf(walk, step)));
    const Picture picture = OrThrow(client.Render(requests.back()));
    const FrameSummary summary = Summarize(picture.statistics);
    longest.push_back(double(summary.render_ns) * 1e-9);
    imbalance.push_back(summary.imbalance);
    render.push_back(double(summary.stage_ns[std::size_t(Stage::kRender)]) * 1e-9);
    moved.push_back(summary.voxel_bytes);
    latency.push_back(double(picture.latency.count()) * 1e-9);
  }
  return {{"longest", longest}, {"imbalance", imbalance}, {"render", render},
          {"moved", moved},     {"latency", latency},     {"period", MeasurePeriod(client, requests, in_flight) * 1e-3}};
}

}  // namespace

Json RosterOf(const StatusReply& status) {
  std::vector<std::pair<std::string, std::uint32_t>> workers;
  for (const WorkerStatus& worker : status.workers) workers.emplace_back(worker.host, worker.threads);
  std::ranges::sort(workers);
  Json roster = Json::array();
  for (const auto& [host, threads] : workers) roster.push_back({{"host", host}, {"threads", threads}});
  return roster;
}

Json DescribeService(const ServiceChoice& service, std::span<const BenchCase> volumes) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(service));
  const StatusReply status = OrThrow(connection.client().QueryStatus());
  if (status.workers.empty()) throw Failure(Status::Unavailable("the service has no workers"));
  Json datasets = Json::array();
  for (const BenchCase& volume : volumes) {
    if (std::ranges::find(status.datasets, volume.dataset, &DatasetStatus::name) == status.datasets.end()) {
      throw Failure(
          Status::NotFound(fmt::format("volumes: the service has no dataset '{}' (`slabstream status` lists them)", volume.dataset)));
    }
    datasets.push_back(volume.dataset);
  }
  return {{"roster", RosterOf(status)}, {"datasets", datasets}};
}

void CheckRoster(Client& client, const StatusReply& begin) {
  const StatusReply now = OrThrow(client.QueryStatus());
  if (now.workers_lost == begin.workers_lost && RosterOf(now) == RosterOf(begin)) return;
  throw Failure(Status::Unavailable(fmt::format("the roster of the service has changed: {} workers of {} are there, {} were lost meanwhile",
                                                now.workers.size(), begin.workers.size(), now.workers_lost - begin.workers_lost)));
}

void AttachRoster(Results& results, const Json& roster) {
  std::vector<Json> workers;
  for (const Json& worker : roster)
    workers.push_back({{"worker", workers.size() + 1}, {"host", worker["host"]}, {"threads", worker["threads"]}});
  results.Attach("roster", std::move(workers));
}

int FramesInFlight(int workers, const FrameCase& frame) {
  const auto teams = std::uint32_t(std::min(frame.policy.teams, workers));
  return WindowFor(std::size_t(workers), teams, std::int64_t(frame.size.width) * frame.size.height * kPixelBytes).frames + kAhead;
}

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

bool IsPossibleAtService(const Path& path) { return path.change == PathChange::kNothing || path.change == PathChange::kTransfer; }

Trial ServiceWalkTrial(Client& client, const StatusReply& begin, const Walk& walk) {
  const auto run = [&client, begin, walk] {
    Json numbers = MeasureWalk(client, walk, FramesInFlight(int(begin.workers.size()), walk.frame));
    CheckRoster(client, begin);
    return numbers;
  };
  return {.key = KeyOf(begin, walk), .run = run};
}

std::vector<Track> RecallServiceWalk(const TrialLog& log, const StatusReply& begin, const Walk& walk) {
  std::vector<Track> tracks;
  for (const Json* numbers : log.All(KeyOf(begin, walk))) {
    const auto list = [&](const char* name) { return numbers->at(name).get<std::vector<double>>(); };
    tracks.push_back({.longest_seconds = list("longest"),
                      .imbalance = list("imbalance"),
                      .render_seconds = list("render"),
                      .moved_bytes = list("moved"),
                      .latency_seconds = list("latency"),
                      .period_seconds = {numbers->at("period").get<double>()}});
    tracks.back().latency_seconds.erase(tracks.back().latency_seconds.begin());  // the first frame
  }
  return tracks;
}

}  // namespace slabstream
