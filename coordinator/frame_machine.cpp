#include "coordinator/frame_machine.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "common/planning/team.h"
#include "common/renderers/registry.h"
#include "coordinator/frame_machine_state.h"

namespace slabstream {

namespace {
constexpr std::size_t kCountAhead = 4;
static_assert(kCountAhead <= OccupancyTable::kMaxKept);
// Frames planned beyond the window's room: when a frame ends and makes room for another, that one's plan should be ready.
constexpr std::size_t kPlansAhead = 1;
}  // namespace

void FrameMachine::State::On(const DatasetLoaded& event) {
  if (!datasets.Loaded(event.name, event.dataset, event.summary)) return;
  const auto waits = [&](const OpenRequest& request) { return request.submit.frame.dataset == event.name && !request.volume; };
  queue.ForEach([&](OpenRequest& request) {
    if (waits(request) && FindVolume(request).ok()) SendQueued(request);
  });
  for (OpenRequest& request : queue.Extract(waits)) FailRequest(request, FindVolume(request));
}

void FrameMachine::State::On(const DatasetFailed& event) {
  if (!datasets.Failed(event.name, event.status)) return;
  const auto waiting = queue.Extract([&](const OpenRequest& request) { return request.submit.frame.dataset == event.name; });
  for (const OpenRequest& request : waiting) FailRequest(request, event.status);
}

void FrameMachine::State::On(const OccupiedCounted& event) {
  if (event.grid.ok()) {
    occupancy.Counted(event.count, *event.grid);
  } else if (const std::optional<ClassifiedVolume> failed = occupancy.Failed(event.count)) {
    const auto waits = [&](const OpenRequest& request) { return request.volume == failed && request.needs_occupancy; };
    for (const OpenRequest& request : queue.Extract(waits)) FailRequest(request, event.grid.status());
  }
}

// A request that has ended is not in the queue any more.
void FrameMachine::State::On(const Planned& event) {
  planning.erase(event.plan);
  if (event.frame.ok()) {
    queue.ForEach([&](OpenRequest& request) {
      if (request.plan == event.plan) request.planned = *event.frame;
    });
  } else {
    const auto is_it = [&](const OpenRequest& request) { return request.plan == event.plan && request.planned_for == roster.version(); };
    for (const OpenRequest& request : queue.Extract(is_it)) FailRequest(request, event.frame.status());
  }
}

// Sets request.volume; its dataset is loaded. NotFound: no such preset.
Status FrameMachine::State::FindVolume(OpenRequest& request) const {
  const FrameRequest& frame = request.submit.frame;
  const DatasetTable::Entry& dataset = *datasets.Find(frame.dataset);
  Result<TransferFunction> transfer = ResolveTransfer(frame.transfer, *dataset.summary);
  if (!transfer.ok()) return transfer.status();
  request.volume.emplace(dataset.id, *std::move(transfer), FindRenderer(frame.renderer));
  return Status::Ok();
}

// Counts for the next requests in turn. Those behind them wait, so that no grid is dropped before it is used.
void FrameMachine::State::CountAhead() {
  std::size_t ahead = 0;
  queue.VisitInTurn([&](const OpenRequest& request) {
    if (!request.volume || request.plan != 0 || !request.needs_occupancy) return true;
    const ClassifiedVolume& volume = *request.volume;
    if (!occupancy.Counting(volume) && occupancy.Find(volume) == nullptr) {
      const auto& summary = datasets.Find(request.submit.frame.dataset)->summary;
      actions.emplace_back(CountDataset{.count = occupancy.Begin(volume), .volume = volume, .summary = summary});
    }
    return ++ahead < kCountAhead;
  });
}

// Plans as many of the next requests in turn as can start soon.
void FrameMachine::State::PlanAhead() {
  std::size_t ahead = 0;
  const std::size_t most = frames.Room(roster.members().size()) + kPlansAhead;
  queue.VisitInTurn([&](OpenRequest& request) {
    if (!request.volume) return true;
    const bool under_way = request.plan != 0 && request.planned_for == roster.version();
    if (!under_way) {
      if (WaitsForCount(request)) return true;
      request.plan = ++last_plan;
      request.planned_for = roster.version();
      request.planned = nullptr;
      planning.insert(request.plan);
      actions.emplace_back(MakePlanRequest(request));
    }
    return ++ahead < most;
  });
}

PlanRequest FrameMachine::State::MakePlanRequest(const OpenRequest& request) {
  const FrameRequest& frame = request.submit.frame;
  Team team = TeamOf(roster.slots(), std::uint32_t(frame.policy.teams), request.plan);
  PlanRequest ask{.plan = request.plan,
                  .frame = frame,
                  .volume = *request.volume,
                  .summary = datasets.Find(frame.dataset)->summary,
                  .occupied = request.needs_occupancy ? occupancy.Find(*request.volume) : nullptr,
                  .roster = std::move(team.roster),
                  .turn = team.turn};
  for (const Member& member : roster.members()) {
    const Register& worker = member.description;
    ask.workers.push_back({worker.memory_scope, worker.lends_memory, worker.threads, worker.pid});
  }
  return ask;
}

// Drops plans of requests that have ended, or that need another plan now.
void FrameMachine::State::DropPlans() {
  if (planning.empty()) return;
  std::set<PlanId> wanted;
  queue.ForEach([&](const OpenRequest& request) { wanted.insert(request.plan); });
  std::erase_if(planning, [&](PlanId plan) {
    if (wanted.contains(plan)) return false;
    actions.emplace_back(DropPlan{plan});
    return true;
  });
}

void FrameMachine::State::AfterGroupDone(const RunningFrame& frame) {
  for (RunningFrame& older : frames) {
    if (older.id() < frame.id()) older.OnOvertaken(frame.HaveRendered(frame.groups_done() - 1));
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
  for (const PeerToken client : clients.Silent(now)) {
    if (clients.IsBehind(client)) actions.emplace_back(DropClient{client});
    FreeClient(client);
  }

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
    const bool counting = request.volume && occupancy.Counting(*request.volume);
    FailRequest(request, late(request, dataset.state != DatasetState::kReady ? "its dataset was still being loaded"
                                       : clients.IsBehind(request.client)    ? "this client did not read its earlier pictures"
                                       : counting                            ? "the occupied voxels of its dataset were still being counted"
                                       : request.plan != 0 && !HasPlan(request) ? "it was still being planned"
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
  PlanAhead();
}

// Starts the first frame in turn that is planned for the present workers. False: there is none.
bool FrameMachine::State::StartNextFrame() {
  std::optional<OpenRequest> request =
      queue.TakeNext([&](const OpenRequest& open) { return HasPlan(open) && !clients.IsBehind(open.client); });
  if (!request) return false;
  const RunningFrame& running = frames.Add(RunningFrame(frames.next_id(), *std::move(request), limits, now));
  SendClient(running.request().client, running.Progress());
  return true;
}

void FrameMachine::State::HandOut(RunningFrame& frame) {
  RunningFrame::HandOut out = frame.NextGroup(now);
  out.assignment.epoch = config.epoch;
  out.assignment.finished_before = frames.finished_before();
  for (Peer& peer : out.assignment.peers) {
    const Register& description = roster.Find(peer.worker)->description;
    peer.images_endpoint = description.images_endpoint;
    peer.memory_scope = description.memory_scope;
    peer.images_key = description.images_key;
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

Time FrameMachine::State::NextWake() {
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
    // The executor was held up (a stopped process, a busy machine): unread messages are no silence of the others.
    state.roster.Postpone(now - state.wake, now);
    state.clients.Postpone(now - state.wake);
    for (RunningFrame& frame : state.frames) frame.Postpone(now - state.wake);
  }
  std::visit([&state](const auto& e) { state.On(e); }, event);
  if (!state.stopped) {
    state.Expire();
    state.Advance();
    state.DropPlans();
  }
  state.wake = state.stopped ? Time::max() : state.NextWake();
  return std::exchange(state.actions, {});
}

Time FrameMachine::NextWake() const { return state_->wake; }

CoordinatorSizes FrameMachine::sizes() const {
  const State& state = *state_;
  return {.clients = state.clients.size(),
          .queued = state.queue.size(),
          .running = state.frames.size(),
          .over = state.frames.cancelled().size(),
          .planning = state.planning.size(),
          .counting = state.occupancy.counting(),
          .grids = state.occupancy.grids(),
          .workers = state.roster.members().size(),
          .slots = state.roster.slots().slots.size()};
}

}  // namespace slabstream
