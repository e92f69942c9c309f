#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <string_view>

#include "client/cli/option_groups.h"
#include "client/cli/service_connection.h"
#include "client/request/volume_argument.h"
#include "common/cli/add_option.h"
#include "laboratory/experiments/compared_policies.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/experiments/service_frames.h"
#include "laboratory/experiments/subjects.h"
#include "laboratory/experiments/track.h"

namespace slabstream {
namespace {

constexpr std::size_t kStandardPaths = 6;
constexpr int kQuickFrames = 24;  // with steps as small as those of a whole path
constexpr int kTableWorkers = 16;

struct Balance {
  std::vector<BenchCase> volumes;  // a volume for each of its renderers
  std::vector<int> workers;        // the first one on all paths, the others on the first path
  std::vector<const Path*> paths;
  std::vector<NamedPolicy> methods;
  std::optional<TransferChoice> later;  // that the user named
  int pixels = 512, frames = kPathFrames;

  std::optional<TransferChoice> LaterOf(const BenchCase& volume) const {
    if (later || !volume.opacity) return later;
    return TransferChoice{HalfShown(*volume.opacity)};
  }
  // Nothing is said of those that are not possible.
  std::vector<Walk> Walks(const BenchCase& volume) const {
    std::vector<Walk> walks;
    for (const int p : workers) {
      for (const Path* path : paths) {
        if (p != workers.front() && path != paths.front()) continue;
        for (const auto& [name, policy] : methods) {
          Walk walk{{volume, {pixels, pixels}, {}, Combined(policy, kUsualScheme, policy.groups, policy.assignment), p},
                    path,
                    frames,
                    LaterOf(volume)};
          if (IsPossible(walk)) walks.push_back(std::move(walk));
        }
      }
    }
    return walks;
  }
};

std::vector<const Path*> PathsOf(const OwnOptions& own) {
  std::vector<const Path*> paths;
  for (const Path& path : Paths()) {
    const bool wanted = own.paths.empty() ? paths.size() < kStandardPaths : std::ranges::find(own.paths, path.name) != own.paths.end();
    if (wanted) paths.push_back(&path);
  }
  return paths;
}

Balance BalanceOf(const ExperimentContext& context, std::vector<BenchCase> volumes) {
  const OwnOptions& own = context.options().own;
  Balance balance{.volumes = std::move(volumes),
                  .workers = own.workers,
                  .paths = PathsOf(own),
                  .methods = BalanceMethods(),
                  .pixels = context.Scaled(512),
                  .frames = context.quick() ? kQuickFrames : kPathFrames};
  if (balance.workers.empty()) balance.workers = {kTableWorkers, 64};
  if (context.quick() && own.workers.empty()) balance.workers.resize(1);
  std::erase_if(balance.methods, [&](const NamedPolicy& method) {
    if (own.methods.empty()) return own.at_service() && IsCompared(method.policy);
    return std::ranges::find(own.methods, method.name) == own.methods.end();
  });
  if (!own.transfers.empty()) balance.later = own.transfers.back();
  return balance;
}

std::vector<Trial> TrialsOf(ExperimentContext& context, const Balance& balance) {
  std::vector<Trial> trials = {HostTrial()};
  for (const BenchCase& volume : balance.volumes) {
    for (const Walk& walk : balance.Walks(volume)) {
      trials.push_back(WalkTrial(context, walk));
      for (int step = 0; step < walk.frames; ++step) {
        if (IsSampled(step)) trials.push_back(FinishTrial(context, FrameOf(walk, step)));
      }
    }
  }
  return trials;
}

std::vector<Track> TracksOf(const std::vector<std::vector<WalkFrame>>& repeats, const std::vector<MachineModel>& machines,
                            double bytes_per_second) {
  std::vector<Track> tracks;
  for (std::size_t repeat = 0; repeat < std::min(repeats.size(), machines.size()); ++repeat) {
    Track& track = tracks.emplace_back();
    for (const WalkFrame& frame : repeats[repeat]) {
      const auto sum = [](const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); };
      track.longest_seconds.push_back(std::ranges::max(frame.worker_seconds));
      track.imbalance.push_back(Imbalance(frame.worker_seconds));
      track.render_seconds.push_back(sum(frame.worker_seconds));
      track.moved_bytes.push_back(sum(frame.moved_bytes));
      track.most_voxel_bytes = std::max(track.most_voxel_bytes, frame.most_voxel_bytes);
      if (&frame != &repeats[repeat].front()) track.moving_seconds += std::ranges::max(frame.moved_bytes) / bytes_per_second;
      if (!frame.whole) continue;
      track.latency_seconds.push_back(Simulate(*frame.whole, machines[repeat]).frames.front().latency());
      track.period_seconds.push_back(SteadySeconds(*frame.whole, machines[repeat]));
    }
  }
  return tracks;
}

// Adds the tracks of all walks. `tracks(walk)`: its repeats.
void AddAll(const Balance& balance, Results& results, const Json& also, bool simulated,
            const std::function<std::vector<Track>(const Walk&)>& tracks) {
  for (const BenchCase& volume : balance.volumes) {
    std::map<std::string, std::vector<Json>> steps;  // by path, with the first number of workers
    for (const Walk& walk : balance.Walks(volume)) {
      const std::vector<Track> repeats = tracks(walk);
      Json of = ColumnsOf(walk);
      of.update(also);
      AddTracks(results, walk, of, repeats, simulated);
      if (walk.frame.workers == balance.workers.front()) AddSteps(steps[std::string(walk.path->name)], walk, repeats);
    }
    for (auto& [path, rows] : steps) {
      results.Attach(fmt::format("path-{}-{}-{}", volume.dataset, volume.renderer->name(), path), std::move(rows));
    }
  }
}

void RunHere(ExperimentContext& context, Results& results) {
  const Balance balance = BalanceOf(context, SubjectsOf(context.options(), context.Scaled(context.quick() ? 256 : 512)));
  context.Run(TrialsOf(context, balance));
  const LinkModel link = Link(kLink);
  const std::vector<MachineModel> machines = Clusters(context, link);
  AddAll(balance, results, {{"link", kLink}}, true,
         [&](const Walk& walk) { return TracksOf(RecallWalk(context, walk), machines, link.bytes_per_second); });
}

void RunAtService(ExperimentContext& context, Results& results) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(context.options().own.service));
  const StatusReply begin = OrThrow(connection.client().QueryStatus());
  const Json roster = RosterOf(begin);
  Balance balance = BalanceOf(context, SubjectsAtService(context.options()));
  balance.workers = {int(roster.size())};
  std::erase_if(balance.paths, [](const Path* path) { return !IsPossibleAtService(*path); });
  std::vector<Trial> trials;
  for (const BenchCase& volume : balance.volumes) {
    for (const Walk& walk : balance.Walks(volume)) trials.push_back(ServiceWalkTrial(connection.client(), begin, walk));
  }
  context.Run(std::move(trials));
  AddAll(balance, results, Json::object(), false, [&](const Walk& walk) { return RecallServiceWalk(context.log(), begin, walk); });
  AttachRoster(results, roster);
}

}  // namespace

void DeclareBalance(const Command& app, OwnOptions& options) {
  DeclareSubjects(app, options, "16,64: 16 on all paths, 64 on the first one; with --quick 16");
  std::vector<std::string_view> names;
  for (const Path& path : Paths()) names.push_back(path.name);
  AddParsedList(app, "--paths", options.paths, OneOf(names),
                "What changes from frame to frame, in 180 frames; with --quick 24 (default: the first six)" + Explained(Paths()));
  static const std::vector<NamedPolicy> methods = BalanceMethods();
  std::vector<std::string_view> method_names;
  for (const NamedPolicy& method : methods) method_names.push_back(method.name);
  AddParsedList(app, "--methods", options.methods, OneOf(method_names), "Ways to balance (default: all)");
  AddService(app, options.service)
      .Description("Lead a service at this endpoint along the paths, with its workers and datasets; simulate nothing")
      .Default("none: boxes are rendered alone on this machine");
  AddParsedList(
      app, "--transfer", options.transfers,
      [](const std::string& option, const std::string& text) -> Result<TransferChoice> {
        auto parsed = ParseTransfer(option, text);
        if (!parsed.ok()) return parsed.status();
        return TransferChoice{*std::move(parsed)};
      },
      "Two transfer functions, as for `slabstream render`: the first on all paths; on the path `transfer` the second from the middle on. "
      "Files need them for that path")
      .TypeName("A,B");
}

void CheckBalance(const ExperimentOptions& options) {
  const std::size_t transfers = options.own.transfers.size();
  if (transfers != 0 && transfers != 2)
    throw Failure(
        Status::InvalidArgument(fmt::format("--transfer needs two transfer functions that differ, A,B; {} was given", transfers)));
  for (const NamedPolicy& method : BalanceMethods()) {
    const bool named = std::ranges::find(options.own.methods, method.name) != options.own.methods.end();
    if (named && options.own.at_service() && IsCompared(method.policy))
      throw Failure(Status::InvalidArgument(fmt::format("--methods: a service has no '{}'; leave --service out", method.name)));
  }
  const std::vector<BenchCase> subjects = options.own.at_service() ? SubjectsAtService(options) : SubjectsOf(options, kLeastScaledSide);
  for (const Path* path : PathsOf(options.own)) CheckSubjects(subjects, path->at(0, false));
  const auto is_possible = [](const Path* path) { return IsPossibleAtService(*path); };
  if (options.own.at_service() && std::ranges::none_of(PathsOf(options.own), is_possible))
    throw Failure(Status::InvalidArgument("--paths: a service can be led along paths without a slow worker and without a time series"));
}

void RunBalance(ExperimentContext& context, Results& results) {
  context.options().own.at_service() ? RunAtService(context, results) : RunHere(context, results);
}

}  // namespace slabstream
