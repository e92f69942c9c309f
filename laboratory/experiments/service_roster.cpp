#include "laboratory/experiments/service_roster.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/service_connection.h"
#include "common/planning/frame_window.h"

namespace slabstream {
namespace {

constexpr int kAhead = 2;  // frames requested beyond those that the coordinator has under way
constexpr std::int64_t kPixelBytes = 16;

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

}  // namespace slabstream
