#include "coordinator/frame_machine.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "coordinator/frame_machine_state.h"

namespace slabstream {

void FrameMachine::State::On(const DatasetLoaded& event) {
  if (!datasets.Loaded(event.name, event.dataset, event.summary)) return;
  queue.ForEach([&](const OpenRequest& request) {
    if (request.submit.frame.dataset == event.name) SendQueued(request);
  });
}

void FrameMachine::State::On(const DatasetFailed& event) {
  if (!datasets.Failed(event.name, event.status)) return;
  const auto waiting = queue.Extract([&](const OpenRequest& request) { return request.submit.frame.dataset == event.name; });
  for (const OpenRequest& request : waiting) FailRequest(request, event.status);
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
    const bool ready = datasets.Find(request.submit.frame.dataset)->state == DatasetState::kReady;
    FailRequest(request, late(request, ready ? "it was still queued" : "its dataset was still being loaded"));
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
  while (frames.unfinished_groups() < std::uint32_t(kGroupWindow)) {
    if (RunningFrame* frame = frames.NextToHandOut()) {
      HandOut(*frame);
    } else if (!frames.HasRoom() || !StartNextFrame()) {
      break;
    }
  }
}

// Plans the next frame in turn, as late as possible, so that it is made for the workers that there are. False: nothing can start.
bool FrameMachine::State::StartNextFrame() {
  const auto ready = [&](const OpenRequest& request) { return datasets.Find(request.submit.frame.dataset)->state == DatasetState::kReady; };
  std::optional<OpenRequest> request = queue.TakeNext(ready);
  if (!request) return false;
  const DatasetTable::Entry& dataset = *datasets.Find(request->submit.frame.dataset);
  const Roster slots = roster.slots();
  Result<FramePlan> plan = PlanFrame(request->submit.frame, dataset.id, *dataset.summary, slots, config.cost);
  if (!plan.ok()) {
    FailRequest(*request, plan.status());
    return true;
  }
  const RunningFrame& frame = frames.Add(RunningFrame(frames.next_id(), *std::move(request), std::move(plan).value(), slots, limits, now));
  SendClient(frame.request().client, frame.Progress());
  return true;
}

void FrameMachine::State::HandOut(RunningFrame& frame) {
  RunningFrame::HandOut out = frame.NextGroup(now);
  out.assignment.epoch = config.epoch;
  out.assignment.finished_before = frames.finished_before();
  for (Peer& peer : out.assignment.peers) peer.images_endpoint = roster.Find(peer.worker)->description.images_endpoint;
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
