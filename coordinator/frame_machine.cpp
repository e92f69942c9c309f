#include "coordinator/frame_machine.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "common/planning/policy_names.h"
#include "common/planning/team.h"
#include "common/renderers/registry.h"
#include "coordinator/frame_machine_state.h"

namespace slabstream {

namespace {
constexpr std::size_t kCountAhead = 4;
static_assert(kCountAhead <= OccupancyTable::kMaxKept);
}  // namespace

void FrameMachine::State::On(const DatasetLoaded& event) {
  if (!datasets.Loaded(event.name, event.dataset, event.summary)) return;
  queue.Update([&](OpenRequest& request) {
    if (request.submit.frame.dataset != event.name) return;
    FindOutCount(request);
    SendQueued(request);
  });
}

void FrameMachine::State::On(const DatasetFailed& event) {
  if (!datasets.Failed(event.name, event.status)) return;
  const auto waiting = queue.Extract([&](const OpenRequest& request) { return request.submit.frame.dataset == event.name; });
  for (const OpenRequest& request : waiting) FailRequest(request, event.status);
}

void FrameMachine::State::On(const OccupiedCounted& event) {
  if (event.grid.ok()) {
    occupancy.Counted(event.count, *event.grid);
  } else if (const std::optional<OccupancyTable::Subject> failed = occupancy.Failed(event.count)) {
    const auto waits = [&](const OpenRequest& request) { return request.counted != nullptr && *request.counted == *failed; };
    for (const OpenRequest& request : queue.Extract(waits)) FailRequest(request, event.grid.status());
  }
}

// The dataset must be known; nothing is found out before it is loaded. What is wrong with the request is told when it is planned.
void FrameMachine::State::FindOutCount(OpenRequest& request) const {
  const FrameRequest& frame = request.submit.frame;
  const DatasetTable::Entry& dataset = *datasets.Find(frame.dataset);
  if (dataset.state != DatasetState::kReady || !CheckNames(frame.policy).ok() || !NeedsOccupancy(frame.policy)) return;
  Result<TransferFunction> transfer = ResolveTransfer(frame.transfer, *dataset.summary);
  if (!transfer.ok()) return;
  request.counted = std::make_shared<const OccupancyTable::Subject>(
      OccupancyTable::Subject{dataset.id, *std::move(transfer), FindRenderer(frame.renderer)});
}

// For the next requests in turn. Those behind them wait, so that no grid is dropped before it was used.
void FrameMachine::State::CountAhead() {
  std::size_t ahead = 0;
  queue.ForEach([&](const OpenRequest& request) {
    if (request.counted == nullptr || ahead == kCountAhead) return;
    ++ahead;
    const OccupancyTable::Subject& subject = *request.counted;
    if (occupancy.Counting(subject) || occupancy.Find(subject) != nullptr) return;
    const VolumeSummary& summary = *datasets.Find(request.submit.frame.dataset)->summary;
    actions.emplace_back(
        CountDataset{.count = occupancy.Begin(subject),
                     .dataset = subject.dataset,
                     .table = std::make_shared<const ClassificationTable>(subject.renderer->DrawnTable(subject.transfer, summary))});
  });
}

void FrameMachine::State::AfterGroupDone(const RunningFrame& frame) {
  for (RunningFrame& older : frames) {
    if (older.id() < frame.id()) older.OnOvertaken(frame.Renderers(frame.groups_done() - 1));
  }
  SendClient(frame.request().client, frame.Progress());
}

void FrameMachine::State::EndFrame(FrameId id) {
  const std::vector<WorkerId> workers = frames.Find(id)->Participants();
  frames.Remove(id);
  for (const WorkerId worker : workers) SendWorker(worker, MakePing());  // so that they drop it now
}

void FrameMachine::State::FailFrame(const RunningFrame& frame, const Status& status) {
  FailRequest(frame.request(), status);
  EndFrame(frame.id());
}

void FrameMachine::State::Expire() {
  for (const WorkerId worker : roster.Silent(now)) LoseWorker(worker);
  roster.GiveUpVacancies(now);
  for (const PeerToken client : clients.Silent(now)) FreeClient(client);

  const auto out_of_time = [&](const OpenRequest& request) { return now >= request.deadline(); };
  const auto without_workers = [&](const OpenRequest& request) {
    return roster.empty() && now >= std::max(request.arrived, roster.empty_since()) + config.worker_wait;
  };
  const auto late = [&](const OpenRequest& request, const std::string& state) {
    return Status::DeadlineExceeded("the frame was not finished within its " + std::to_string(request.submit.deadline_ms) +
                                    " ms: " + state);
  };
  const auto wait_seconds = std::chrono::duration_cast<std::chrono::seconds>(config.worker_wait).count();
  const Status no_worker = Status::Unavailable("no worker registered within " + std::to_string(wait_seconds) +
                                               " s, at least one is needed; start one with slabstream-worker");

  for (const OpenRequest& request : queue.Extract(out_of_time)) {
    const DatasetTable::Entry& dataset = *datasets.Find(request.submit.frame.dataset);
    const bool counting = request.counted != nullptr && occupancy.Counting(*request.counted);
    FailRequest(request, late(request, dataset.state != DatasetState::kReady ? "its dataset was still being loaded"
                                       : counting                            ? "the occupied voxels of its dataset were still being counted"
                                                                             : "it was still queued"));
  }
  for (const OpenRequest& request : queue.Extract(without_workers)) FailRequest(request, no_worker);
  for (auto it = frames.begin(); it != frames.end();) {
    RunningFrame& frame = *it++;  // FailFrame removes it
    const OpenRequest& request = frame.request();
    if (out_of_time(request)) {
      FailFrame(frame, late(request, std::to_string(frame.groups_done()) + " of " + std::to_string(frame.group_count()) +
                                         " groups were done at attempt " + std::to_string(frame.attempt())));
    } else if (without_workers(request)) {
      FailFrame(frame, Status::Unavailable("all workers were lost, and " + no_worker.message()));
    } else if (const Status status = frame.Expire(now); !status.ok()) {
      FailFrame(frame, status);
    }
  }

  if (!roster.empty() && now >= next_ping) {
    for (const Member& member : roster.members()) SendWorker(member.id, MakePing());
    next_ping = now + config.heartbeat;
  }
}

void FrameMachine::State::Advance() {
  if (roster.empty()) return;
  for (auto it = frames.begin(); it != frames.end();) {
    RunningFrame& frame = *it++;  // FailFrame removes it
    if (!frame.AttemptDue(now)) continue;
    const Status status = frame.BeginAttempt(roster.Refill(frame.roster()), now);
    if (!status.ok()) {
      FailFrame(frame, status);
    } else {
      SendClient(frame.request().client, frame.Progress());
    }
  }
  while (true) {
    const FramesInFlight::Choice next = frames.Next(roster.members().size());
    if (next.step == FramesInFlight::Step::kHandOut) {
      HandOut(*next.frame);
    } else if (next.step == FramesInFlight::Step::kWait || !StartNextFrame()) {
      break;
    }
  }
  CountAhead();
}

// Plans the next frame in turn, as late as possible, so that it is made for the workers that there are. False: nothing can start.
bool FrameMachine::State::StartNextFrame() {
  CountAhead();
  const auto ready = [&](const OpenRequest& request) {
    const DatasetTable::Entry& dataset = *datasets.Find(request.submit.frame.dataset);
    return dataset.state == DatasetState::kReady && (request.counted == nullptr || occupancy.Find(*request.counted) != nullptr);
  };
  std::optional<OpenRequest> request = queue.TakeNext(ready);
  if (!request) return false;
  FrameRequest& frame = request->submit.frame;
  const DatasetTable::Entry& dataset = *datasets.Find(frame.dataset);
  frame.policy = SettledPolicy(frame, dataset.summary->description.geometry);
  const Team team = TeamOf(roster.slots(), std::uint32_t(frame.policy.teams), frames.next_id());
  const Roster& slots = team.roster;
  const Layout* layout = nullptr;
  const Result<TransferFunction> transfer = ResolveTransfer(frame.transfer, *dataset.summary);
  if (transfer.ok() && CheckNames(frame.policy).ok()) {
    if (Status status = MakeChoice(*request, *transfer, std::uint32_t(slots.slots.size())); !status.ok()) {
      FailRequest(*request, status);
      return true;
    }
    layout = &layouts.Find({.frame = &frame,
                            .dataset = dataset.id,
                            .summary = dataset.summary.get(),
                            .transfer = &*transfer,
                            .occupied = request->counted ? occupancy.Find(*request->counted) : nullptr,
                            .slots = std::uint32_t(slots.slots.size()),
                            .slab_bytes_target = config.cost.slab_bytes_target});
  }
  Result<FramePlan> plan = PlanFrame(frame, dataset.id, *dataset.summary, slots, config.cost, layout, team.turn);
  if (!plan.ok()) {
    FailRequest(*request, plan.status());
    return true;
  }
  const RunningFrame& running =
      frames.Add(RunningFrame(frames.next_id(), *std::move(request), std::move(plan).value(), slots, limits, now));
  SendClient(running.request().client, running.Progress());
  return true;
}

MachineModel FrameMachine::State::DescribeMachine() const {
  std::vector<HostedWorker> workers;
  for (const Member& member : roster.members())
    workers.push_back(
        {member.description.memory_scope, member.description.lends_memory, member.description.threads, member.description.pid});
  return ServiceMachine(workers, config.surroundings);
}

// Fills in what the request's policy leaves open.
Status FrameMachine::State::MakeChoice(OpenRequest& request, const TransferFunction& transfer, std::uint32_t slots) {
  FrameRequest& frame = request.submit.frame;
  if (!LeavesChoice(frame.policy)) return Status::Ok();
  const DatasetTable::Entry& dataset = *datasets.Find(frame.dataset);
  const MachineModel machine = DescribeMachine();
  Result<ChosenPolicy> chosen = policies.Find({.frame = &frame,
                                               .dataset = dataset.id,
                                               .summary = dataset.summary.get(),
                                               .transfer = &transfer,
                                               .occupied = request.counted ? occupancy.Find(*request.counted) : nullptr,
                                               .slots = slots,
                                               .machine = &machine,
                                               .cost = &config.cost,
                                               .layouts = &layouts});
  if (!chosen.ok()) return chosen.status();
  frame.policy = chosen->policy;
  request.chosen = *std::move(chosen);
  return Status::Ok();
}

void FrameMachine::State::HandOut(RunningFrame& frame) {
  RunningFrame::HandOut out = frame.NextGroup(now);
  out.assignment.epoch = config.epoch;
  out.assignment.finished_before = frames.finished_before();
  for (Peer& peer : out.assignment.peers) {
    const Register& description = roster.Find(peer.worker)->description;
    peer.images_endpoint = description.images_endpoint;
    peer.memory_scope = description.memory_scope;
  }
  for (const WorkerId worker : out.workers) SendWorker(worker, out.assignment);
}

void FrameMachine::State::StopAll(const AnyMessage& goodbye, const std::string& reason) {
  const auto everything = [](const OpenRequest&) { return true; };
  for (const OpenRequest& request : queue.Extract(everything)) FailRequest(request, Status::Unavailable(reason));
  for (const RunningFrame& frame : frames) FailRequest(frame.request(), Status::Unavailable(reason));
  for (const Member& member : roster.members()) SendWorker(member.id, goodbye);
  actions.emplace_back(StopService{});
  stopped = true;
}

Time FrameMachine::State::NextWake() const {
  Time next = std::min(roster.NextWake(), clients.NextWake());
  const auto consider = [&](const OpenRequest& request) {
    next = std::min(next, request.deadline());
    if (roster.empty()) next = std::min(next, std::max(request.arrived, roster.empty_since()) + config.worker_wait);
  };
  queue.ForEach(consider);
  for (const RunningFrame& frame : frames) {
    consider(frame.request());
    if (!roster.empty()) next = std::min(next, frame.NextWake());  // without workers no attempt can begin
  }
  return roster.empty() ? next : std::min(next, next_ping);
}

FrameMachine::FrameMachine(CoordinatorConfig config) : state_(std::make_unique<State>(std::move(config))) {
  CHECK_NE(state_->config.epoch, Epoch{0});
}
FrameMachine::~FrameMachine() = default;
FrameMachine::FrameMachine(FrameMachine&&) noexcept = default;

std::vector<CoordinatorAction> FrameMachine::Step(const CoordinatorEvent& event, Time now) {
  State& state = *state_;
  if (state.stopped) return {};
  state.now = now;
  if (!state.started) state.started = now;
  if (now > state.wake) {
    // The executor was held up (a stopped process, a busy machine): what was not read meanwhile is not the others' silence.
    state.roster.Postpone(now - state.wake);
    state.clients.Postpone(now - state.wake);
  }
  std::visit([&state](const auto& e) { state.On(e); }, event);
  if (!state.stopped) {
    state.Expire();
    state.Advance();
  }
  state.wake = state.stopped ? Time::max() : state.NextWake();
  return std::exchange(state.actions, {});
}

Time FrameMachine::NextWake() const { return state_->wake; }

}  // namespace slabstream
