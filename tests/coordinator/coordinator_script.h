// CoordinatorScript: the machines of a coordinator with a virtual clock, for tests that are told as scripts: join, submit, answer, let time
// pass, look at what they said.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/renderers/renderer_kind.h"
#include "common/wire/any_message.h"
#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/frames/frame_machine.h"
#include "coordinator/planner/planner.h"

namespace slabstream {

using CoordinatorAction = std::variant<FrameAction, DatasetAction>;
using Actions = std::vector<CoordinatorAction>;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

inline constexpr std::uint64_t kMebi = 1 << 20;
inline constexpr PeerToken kClient = 21, kOther = 22;  // connections of two clients

struct ScriptConfig : CoordinatorConfig {
  Catalogue datasets;
  std::set<std::string> folders;
  Duration check_interval = DatasetConfig().check_interval;
  std::size_t max_datasets = DatasetConfig().max_datasets;
};

inline ScriptConfig TestConfig() {
  ScriptConfig config;
  config.epoch = 77;
  config.pid = 4321;
  config.voxels_endpoint = "inproc://voxels";
  config.datasets = {{"block", {}}, {"other", {}}};
  return config;
}

// A block of voxels that are all visible: every box of a plan is rendered.
inline std::shared_ptr<const VolumeSummary> BlockSummary() {
  auto summary = std::make_shared<VolumeSummary>();
  summary->description.geometry.size = {32, 32, 48};
  summary->range = {0, 255};
  summary->histogram[255] = 32 * 32 * 48;
  summary->brick_counts = {2, 2, 3};
  summary->bricks.assign(12, {255, 255});
  return summary;
}

inline SubmitFrame Frame(RequestId request, int groups = 1, const std::string& dataset = "block") {
  SubmitFrame submit;
  submit.request = request;
  submit.frame.dataset = dataset;
  submit.frame.size = {64, 64};
  submit.frame.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.5}}};
  submit.frame.policy.decomposition = "slab";
  submit.frame.policy.axis = AxisChoice::kZ;
  submit.frame.policy.groups = groups;
  return submit;
}

// The action, if it is an A.
template <class A>
const A* Get(const CoordinatorAction& action) {
  const auto get = []<class Held>(const Held& held) -> const A* {
    if constexpr (std::is_same_v<Held, A>) return &held;
    return nullptr;
  };
  return std::visit([&](const auto& of_machine) { return std::visit(get, of_machine); }, action);
}

template <class M>
struct Sent {
  PeerToken to = 0;
  M message;
  Bytes payload;
};

template <class M>
std::vector<Sent<M>> ToWorkers(const Actions& actions) {
  std::vector<Sent<M>> sent;
  for (const CoordinatorAction& action : actions) {
    const auto* send = Get<TellWorkers>(action);
    if (send == nullptr || !std::holds_alternative<M>(send->message)) continue;
    for (const PeerToken to : send->to) sent.push_back({to, std::get<M>(send->message), {}});
  }
  return sent;
}

template <class M>
std::vector<Sent<M>> ToClients(const Actions& actions) {
  std::vector<Sent<M>> sent;
  for (const CoordinatorAction& action : actions) {
    const auto* send = Get<ToClient>(action);
    if (send != nullptr && std::holds_alternative<M>(send->message)) {
      sent.push_back({send->to, std::get<M>(send->message), send->payload});
    }
  }
  return sent;
}

template <class A>
std::vector<A> Of(const Actions& actions) {
  std::vector<A> wanted;
  for (const CoordinatorAction& action : actions) {
    if (const A* match = Get<A>(action)) wanted.push_back(*match);
  }
  return wanted;
}

// Each group that was handed out, once, in order (every worker of it gets a copy).
inline std::vector<GroupAssignment> HandedOut(const Actions& actions) {
  std::vector<GroupAssignment> groups;
  for (auto& sent : ToWorkers<GroupAssignment>(actions)) {
    const bool known = std::any_of(groups.begin(), groups.end(), [&](const auto& g) { return g.key == sent.message.key; });
    if (!known) groups.push_back(std::move(sent.message));
  }
  return groups;
}

inline std::vector<GroupKey> Keys(const std::vector<GroupAssignment>& groups) {
  std::vector<GroupKey> keys;
  keys.reserve(groups.size());
  for (const GroupAssignment& group : groups) keys.push_back(group.key);
  return keys;
}

inline std::set<WorkerId> WorkersOf(const GroupAssignment& group) {
  std::set<WorkerId> workers;
  for (const Placement& placement : group.group.placements) workers.insert(placement.worker);
  return workers;
}

struct FakeWorker {
  PeerToken token = 0;
  Incarnation incarnation = 0;
  WorkerId id = 0;
  std::uint32_t rendered_ranks = 0;
  bool leaving = false;
};

struct Machines {
  explicit Machines(const ScriptConfig& config)
      : frames(config),
        datasets({.datasets = config.datasets,
                  .folders = config.folders,
                  .memory_bytes = config.memory_bytes,
                  .max_questions = config.max_queued,
                  .check_interval = config.check_interval,
                  .max_datasets = config.max_datasets,
                  .log_level = config.log_level}) {}

  struct Sizes : FrameSizes, DatasetSizes {};
  Sizes sizes() const { return {frames.sizes(), datasets.sizes()}; }
  Time NextWake() const { return std::min(frames.NextWake(), datasets.NextWake()); }

  // All that comes of the event, but for what the machines tell each other.
  template <class Event>
  void Step(const Event& event, Time now, Actions& actions) {
    if constexpr (std::constructible_from<FrameEvent, Event>) {
      for (FrameAction& action : frames.Step(event, now)) {
        if (const auto* told = std::get_if<ToDatasets>(&action)) {
          Step(*told, now, actions);
        } else {
          actions.emplace_back(std::move(action));
        }
      }
    } else {
      for (DatasetAction& action : datasets.Step(event, now)) {
        if (const auto* news = std::get_if<DatasetNews>(&action)) {
          Step(*news, now, actions);
        } else {
          actions.emplace_back(std::move(action));
        }
      }
    }
  }

  FrameMachine frames;
  DatasetMachine datasets;
};

class CoordinatorScript {
 public:
  explicit CoordinatorScript(ScriptConfig c = TestConfig()) : config(std::move(c)), machine(config) {}

  const ScriptConfig config;
  Machines machine;
  Time now{seconds(1000)};
  std::vector<FakeWorker> workers;       // those that send heartbeats while time passes
  std::map<WorkerId, PeerToken> tokens;  // the tokens of all workers that have joined
  std::vector<PeerToken> clients;        // those that send pings
  std::string host;                      // the host that clients connect from; empty: not known
  std::string images_key;                // the key of workers that join
  std::vector<LoadDataset> loads;        // all that were asked for
  std::vector<CountDataset> counts;
  Planner planner;
  bool plans_at_once = true;       // else plans wait in `plans` for Plan()
  std::vector<PlanRequest> plans;  // plans that were not made yet
  std::function<void(FramePlan&)> alter_plan;

  // All that comes of the event, of the plans that are made at once, too.
  Actions Step(const auto& event) {
    Actions actions;
    machine.Step(event, now, actions);
    if constexpr (std::is_same_v<decltype(event), const CoordinatorTick&>) machine.Step(DatasetTick{}, now, actions);
    for (FrameMeasured& measured : Of<FrameMeasured>(actions)) planner.Learn(measured);
    for (PlanRequest& request : Of<PlanRequest>(actions)) plans.push_back(std::move(request));
    for (const DropPlan& drop : Of<DropPlan>(actions)) {
      std::erase_if(plans, [&](const PlanRequest& request) { return request.plan == drop.plan; });
    }
    for (const LoadDataset& load : Of<LoadDataset>(actions)) loads.push_back(load);
    for (const CountDataset& count : Of<CountDataset>(actions)) counts.push_back(count);
    while (plans_at_once && !plans.empty()) Append(actions, Plan());
    return actions;
  }
  // Makes the oldest plan that is waited for.
  Actions Plan() {
    const PlanRequest request = std::move(plans.front());
    plans.erase(plans.begin());
    auto planned = planner.Plan(request);
    if (alter_plan && planned.ok()) {
      auto altered = std::make_shared<PlannedFrame>(**planned);
      alter_plan(altered->plan);
      planned = std::shared_ptr<const PlannedFrame>(std::move(altered));
    }
    return Step(Planned{request.plan, planned});
  }
  Actions Worker(const FakeWorker& from, WorkerToCoordinator message, Bytes payload = {}) {
    return Step(FromWorker{from.token, std::move(message), std::move(payload)});
  }
  Actions Client(PeerToken from, const ClientToFrames& message) { return Step(FromClient{from, message, host}); }
  Actions Client(PeerToken from, const ClientToDatasets& message, const Bytes& payload = {}) {
    Actions actions = Step(ClientHeard{from, std::holds_alternative<AddVolume>(message)});
    Append(actions, Step(ClientAsked{from, message, payload}));
    return actions;
  }

  static Register RegisterOf(const FakeWorker& worker) {
    return {.incarnation = worker.incarnation,
            .pid = std::uint32_t(worker.incarnation),
            .host = "here",
            .images_endpoint = "inproc://images" + std::to_string(worker.incarnation)};
  }
  // A worker that stays: its id is filled in, and it is heard while time passes. `out`: what the machine did.
  FakeWorker Join(PeerToken token, Incarnation incarnation, Actions* out = nullptr) {
    FakeWorker worker{.token = token, .incarnation = incarnation};
    Register hello = RegisterOf(worker);
    hello.images_key = images_key;
    const Actions actions = Worker(worker, hello);
    const auto welcomes = ToWorkers<Welcome>(actions);
    EXPECT_EQ(welcomes.size(), 1U);
    if (!welcomes.empty()) worker.id = welcomes[0].message.worker;
    tokens[worker.id] = token;
    workers.push_back(worker);
    if (out != nullptr) *out = actions;
    return worker;
  }
  Actions Beat(const FakeWorker& worker) {
    return Worker(worker, Heartbeat{.epoch = config.epoch,
                                    .incarnation = worker.incarnation,
                                    .worker = worker.id,
                                    .rendered_ranks = worker.rendered_ranks,
                                    .leaving = worker.leaving});
  }
  // From now on it says that it is leaving.
  Actions Leave(WorkerId id) {
    WorkerOf(id).leaving = true;
    return Beat(WorkerOf(id));
  }
  FakeWorker& WorkerOf(WorkerId id) {
    return *std::find_if(workers.begin(), workers.end(), [id](const FakeWorker& w) { return w.id == id; });
  }
  // From now on it is silent.
  void Mute(FakeWorker worker) {
    std::erase_if(workers, [&](const FakeWorker& w) { return w.token == worker.token; });
  }
  Actions Kill(FakeWorker worker) {
    Mute(worker);
    return Step(WorkerGone{worker.token});
  }

  // A frame of a dataset that is there; the client pings while time passes.
  Actions Submit(PeerToken client, const SubmitFrame& submit) {
    if (std::find(clients.begin(), clients.end(), client) == clients.end()) clients.push_back(client);
    const std::size_t loads_before = loads.size();
    Actions actions = Client(client, submit);
    for (std::size_t i = loads_before; i < loads.size(); ++i) {
      const LoadDataset load = loads[i];
      Append(actions, Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary()}));
    }
    return actions;
  }

  Actions Done(const GroupAssignment& group, std::vector<RankReport> reports = {}, OcclusionMask hidden = {}) {
    return Worker(
        WorkerOf(group.display),
        GroupDone{
            .epoch = config.epoch, .worker = group.display, .key = group.key, .reports = std::move(reports), .hidden = std::move(hidden)});
  }
  Actions Image(const GroupAssignment& group, std::uint32_t groups_done, Bytes payload = {}) {
    FrameImage image{.epoch = config.epoch,
                     .worker = group.display,
                     .frame = group.key.frame,
                     .attempt = group.key.attempt,
                     .groups_done = groups_done,
                     .group_count = group.group_count};
    return Step(FromWorker{.from = tokens.at(group.display), .message = image, .payload = std::move(payload)});
  }
  // The display worker reports the group and, after the last one, hands the frame over.
  Actions Answer(const GroupAssignment& group) {
    Actions actions = Done(group);
    if (group.key.group + 1 == group.group_count) Append(actions, Image(group, group.group_count));
    return actions;
  }
  // Answers everything that is handed out from `actions` on, in order. All actions, with `actions` first.
  Actions AnswerAll(Actions actions) {
    std::vector<GroupAssignment> groups = HandedOut(actions);
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const Actions more = Answer(groups[i]);
      for (GroupAssignment& group : HandedOut(more)) groups.push_back(std::move(group));
      Append(actions, more);
    }
    return actions;
  }

  // Ticks whenever the machine asks to be woken; workers and clients are heard every heartbeat interval. Everything that the machine does
  // meanwhile.
  Actions Pass(Duration duration) {
    Actions actions;
    const Time end = now + duration;
    Time next_signs = now + config.heartbeat;
    while (true) {
      const Time next = std::min({next_signs, machine.NextWake(), end});
      EXPECT_GE(next, now) << "a wake-up in the past spins";
      now = std::max(now, next);
      if (now >= next_signs) {
        for (const FakeWorker& worker : workers) Append(actions, Beat(worker));
        for (const PeerToken client : clients) Append(actions, Client(client, ClientPing{}));
        next_signs = now + config.heartbeat;
      }
      Append(actions, Step(CoordinatorTick{}));
      EXPECT_GT(machine.NextWake(), now) << "a wake-up in the past spins";
      if (now >= end) return actions;
    }
  }

  StatusReply QueryStatus() {
    const auto replies = ToClients<StatusReply>(Client(9999, StatusQuery{.nonce = 5}));
    EXPECT_EQ(replies.size(), 1U);
    return replies.empty() ? StatusReply{} : replies[0].message;
  }

  static void Append(Actions& to, const Actions& from) { to.insert(to.end(), from.begin(), from.end()); }
};

}  // namespace slabstream
