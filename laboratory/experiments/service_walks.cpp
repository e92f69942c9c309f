#include "laboratory/experiments/service_walks.h"

#include "client/report/frame_summary.h"
#include "laboratory/experiments/client_frames.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/request_json.h"
#include "laboratory/experiments/service_roster.h"

namespace slabstream {
namespace {

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
