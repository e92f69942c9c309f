#include "coordinator/frames/frame_machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "common/base/overloaded.h"
#include "common/planning/team.h"
#include "common/planning/worker_memory.h"
#include "coordinator/frames/frame_machine_state.h"

namespace slabstream {

namespace {
constexpr std::size_t kCountAhead = 4;
static_assert(kCountAhead <= OccupancyTable::kMaxKept);
// Frames planned beyond the window's room: when a frame ends and makes room for another, that one's plan should be ready.
constexpr std::size_t kPlansAhead = 1;
}  // namespace

void FrameMachine::State::On(const OccupiedCounted& event) {
  if (event.grid.ok()) {
    occupancy.Counted(event.count, *event.grid);
  } else if (const std::optional<ClassifiedVolume> failed = occupancy.Failed(event.count)) {
    const auto waits = [&](const OpenRequest& request) {
      return request.needs_occupancy && request.dataset() != nullptr && request.dataset()->volume().Whole() == *failed;
    };
    for (const OpenRequest& request : queue.Extract(waits)) FailRequest(request, event.grid.status());
  }
}

// A request that has ended is not in the queue any more.
void FrameMachine::State::On(const Planned& event) {
  planning.erase(event.plan);
  const Status fit = event.frame.ok() ? (*event.frame)->fit.status() : event.frame.status();
  const auto asked = [&](const OpenRequest& request) {
    const auto* const ask = request.plan<PlanAsked>();
    return ask != nullptr && ask->plan == event.plan ? ask : nullptr;
  };
  if (fit.ok()) {
    return queue.ForEach([&](OpenRequest& request) {
      if (const PlanAsked* ask = asked(request)) request.dataset()->plan = PlanMade{*event.frame, ask->version};
    });
  }
  const auto is_it = [&](const OpenRequest& request) { return asked(request) != nullptr && asked(request)->version == roster.version(); };
  if (event.frame.ok()) {
    bool lowered = false;
    queue.ForEach([&](OpenRequest& request) { lowered |= is_it(request) && Lower(request, **event.frame); });
    if (lowered) return;
  }
  const bool bad = fit.code() == StatusCode::kInvalidArgument;
  const RefusedAs as = event.frame.ok() ? &RefusedRequests::too_large : bad ? &RefusedRequests::bad_request : nullptr;
  for (const OpenRequest& request : queue.Extract(is_it)) {
    FailRequest(request, event.frame.ok() ? WhyTooLarge(request, **event.frame) : fit, as);
  }
}

// The frame does not fit. If the request allows that, it seeks the level that does.
bool FrameMachine::State::Lower(OpenRequest& request, const PlannedFrame& planned) {
  if (request.submit.frame.detail != 0 || request.dataset()->levels == nullptr || !planned.level_that_fits) return false;
  const int level = *planned.level_that_fits;
  request.lowered =
      fmt::format("level {} is drawn instead of level {}: {}", level, request.dataset()->drawn.front(), planned.fit.status().message());
  FrameRequest coarser = request.submit.frame;
  coarser.level = std::to_string(level);
  actions.emplace_back(std::in_place_type<ToDatasets>, LeaveDataset{request.use});
  request.use = ++last_use;
  request.state = OpenRequest::AwaitsDataset{};
  actions.emplace_back(std::in_place_type<ToDatasets>, SeekDataset{request.use, std::make_shared<const FrameRequest>(std::move(coarser))});
  return true;
}

// In one line: what is needed, the limit, and what would fit.
Status FrameMachine::State::WhyTooLarge(const OpenRequest& request, const PlannedFrame& planned) {
  const Status& status = planned.fit.status();
  const bool has_levels = request.dataset()->levels != nullptr;
  std::string way_out = has_levels ? "; no coarser level fits" : "";
  if (planned.level_that_fits) {
    way_out = has_levels ? fmt::format("; --level {} would fit, and --detail auto chooses such a level", *planned.level_that_fits)
                         : "; the volume has no coarser levels, which would fit: slabstream convert makes them";
  }
  return {status.code(), status.message() + way_out};
}

std::vector<WorkerLimit> FrameMachine::State::WorkerLimits() const {
  std::vector<WorkerLimit> workers;
  for (const Member& member : roster.members()) workers.push_back({member.id, member.description.memory_bytes});
  return workers;
}

// Counts for the first request of each client, then for the next ones in turn. Those behind them wait, so that no grid is dropped before it
// is used.
void FrameMachine::State::CountAhead() {
  std::vector<ClassifiedVolume> ahead;
  const auto count = [&](const OpenRequest& request) {
    const auto* const dataset = request.dataset();
    if (dataset == nullptr || !request.needs_occupancy || !std::holds_alternative<std::monostate>(dataset->plan)) return true;
    const ClassifiedVolume volume = dataset->volume().Whole();
    if (std::ranges::find(ahead, volume) != ahead.end()) return true;
    if (!occupancy.Counting(volume) && occupancy.Find(volume) == nullptr) {
      actions.emplace_back(CountDataset{.count = occupancy.Begin(volume), .volume = volume, .summary = dataset->resolved->summary});
    }
    ahead.push_back(volume);
    return ahead.size() < kCountAhead;
  };
  queue.VisitFirsts(count);
  if (ahead.size() < kCountAhead) queue.VisitInTurn(count);
}

// Plans as many of the next requests in turn as can start soon, and the first one of each client without a frame: however long the plans of
// others take, its frame can start.
void FrameMachine::State::PlanAhead() {
  const auto is_present =
      Overloaded{[](std::monostate) { return false; }, [this](const auto& plan) { return plan.version == roster.version(); }};
  const auto plan = [&](OpenRequest& request) {  // false: its dataset or a count lacks
    auto* const dataset = request.dataset();
    if (dataset == nullptr) return false;
    if (std::visit(is_present, dataset->plan)) return true;
    const auto occupied = request.needs_occupancy ? occupancy.Find(dataset->volume().Whole()) : nullptr;
    if (request.needs_occupancy && occupied == nullptr) return false;
    dataset->plan = PlanAsked{++last_plan, roster.version()};
    planning.insert(last_plan);
    actions.emplace_back(MakePlanRequest(request, occupied));
    return true;
  };
  std::size_t ahead = 0;
  const std::size_t most = frames.Room(roster.staying()) + kPlansAhead;
  queue.VisitInTurn([&](OpenRequest& request) { return !plan(request) || ++ahead < most; });
  int clients_ahead = 0;
  queue.VisitFirsts(
      [&](OpenRequest& request) { return frames.RunsFor(request.client) || !plan(request) || ++clients_ahead < kMostInWindow; });
}

PlanRequest FrameMachine::State::MakePlanRequest(const OpenRequest& request, std::shared_ptr<const OccupancyGrid> occupied) {
  const auto [width, height] = request.submit.frame.size;
  const bool pays = SharesPay(std::uint64_t(width) * std::uint64_t(height), queue.size() + frames.size() == 1);
  const bool in_shares = pays && request.pictures && !request.submit.frame.previews;
  Team team = TeamOf(roster.slots(), std::uint32_t(request.submit.frame.policy.teams), last_plan);
  PlanRequest ask{.plan = last_plan,
                  .client = request.client,
                  .resolved = request.dataset()->resolved,
                  .occupied = std::move(occupied),
                  .roster = std::move(team.roster),
                  .turn = team.turn,
                  .share_pixels = in_shares ? config.share_pixels : 0,
                  .own_memory = config.memory_bytes,
                  .limits = WorkerLimits()};
  if (const OpenRequest::HasDataset& dataset = *request.dataset(); dataset.levels != nullptr) {
    FrameRequest frame = request.submit.frame;
    frame.view = dataset.view;
    ask.frame = std::make_shared<const FrameRequest>(std::move(frame));
    ask.levels = dataset.levels;
    ask.level = dataset.drawn.front();
  }
  if (ask.resolved->summary->owned != nullptr) {
    for (const WorkerId worker : ask.roster.slots) {
      const Member* const member = roster.Find(worker);
      ask.hosts.push_back(member == nullptr ? 0 : member->description.memory_scope);
    }
  }
  for (const Member& member : roster.members()) {
    const std::uint64_t bytes = member.description.memory_bytes;
    if (member.leaving || bytes == 0) continue;
    ask.worker_memory = ask.worker_memory == 0 ? bytes : std::min(ask.worker_memory, bytes);
  }
  return ask;
}

// Drops plans of requests that have ended, or that need another plan now.
void FrameMachine::State::DropPlans() {
  if (planning.empty()) return;
  std::set<PlanId> wanted;
  queue.ForEach([&](const OpenRequest& request) {
    if (const auto* asked = request.plan<PlanAsked>()) wanted.insert(asked->plan);
  });
  std::erase_if(planning, [&](PlanId plan) {
    if (wanted.contains(plan)) return false;
    actions.emplace_back(DropPlan{plan});
    return true;
  });
}

void FrameMachine::State::AfterGroupDone(const RunningFrame& frame) {
  for (RunningFrame& older : frames) {
    if (older.id() < frame.id() && older.request().client == frame.request().client)
      older.OnOvertaken(frame.HaveRendered(frame.groups_done() - 1));
  }
  SendProgress(frame);
}

void FrameMachine::State::EndFrame(FrameId id, std::string_view result, DeadlineForecast::Ended how) {
  const RunningFrame& frame = *frames.Find(id);
  if (!frame.request().coarse) forecast.End(id, how, now);
  forecast_due = true;
  const std::vector<WorkerId> workers = frame.Participants();
  const OpenRequest& request = frame.request();
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "frame {} of client {}: dataset {}, {}, {}x{}, {:.1f} ms, workers {}, attempts {}: {}", id,
       request.client, request.submit.frame.dataset, request.dataset()->resolved->frame.renderer, request.submit.frame.size.width,
       request.submit.frame.size.height, std::chrono::duration<double, std::milli>(now - request.arrived).count(), workers.size(),
       frame.attempt(), result);
  queue.Settle(frame.request(), frame.WorkerTime());
  actions.emplace_back(std::in_place_type<ToDatasets>, LeaveDataset{request.use});
  frames.Remove(id);
  for (const WorkerId worker : workers) SendWorker(worker, MakePing(worker));  // so that they drop it now
}

void FrameMachine::State::FailFrame(const RunningFrame& frame, const Status& status) {
  AnswerFailure(frame.request(), status);
  const bool late = status.code() == StatusCode::kDeadlineExceeded;
  EndFrame(frame.id(), status.message(), late ? DeadlineForecast::Ended::kLate : DeadlineForecast::Ended::kGivenUp);
}

void FrameMachine::State::Expire() {
  for (const WorkerId worker : roster.Silent(now)) LoseWorker(worker, LiveRoster::Loss::kSilent);
  roster.GiveUpVacancies(now);
  for (const PeerToken client : clients.Silent(now)) {
    if (clients.IsBehind(client)) actions.emplace_back(DropClient{client});
    FreeClient(client);
  }

  const auto out_of_time = [&](const OpenRequest& request) { return now >= request.deadline(); };
  const auto without_workers = [&](const OpenRequest& request) { return now >= EndOfWait(request); };
  const auto late = [&](const OpenRequest& request, std::string_view state) {
    return Status::DeadlineExceeded(fmt::format("the frame was not finished within its {} ms: {}", request.submit.deadline_ms, state));
  };
  const auto wait_seconds = std::chrono::duration_cast<std::chrono::seconds>(config.worker_wait).count();
  const Status no_worker = Status::Unavailable("no worker registered within " + std::to_string(wait_seconds) +
                                               " s, at least one is needed; start one with slabstream-worker");

  for (const OpenRequest& request : queue.Extract(out_of_time)) FailRequest(request, late(request, WhatLacks(request)));
  for (const OpenRequest& request : queue.Extract(without_workers)) FailRequest(request, no_worker);
  for (auto it = frames.begin(); it != frames.end();) {
    RunningFrame& frame = *it++;  // FailFrame removes it
    const OpenRequest& request = frame.request();
    if (out_of_time(request)) {
      FailFrame(frame, late(request, fmt::format("{} of {} groups were done at attempt {}", frame.groups_done(), frame.group_count(),
                                                 frame.attempt())));
    } else if (without_workers(request)) {
      FailFrame(frame, Status::Unavailable("all workers were lost, and " + no_worker.message()));
    } else if (const Status status = frame.Expire(now); !status.ok()) {
      FailFrame(frame, status);
    }
  }

  if (!roster.empty() && now >= next_ping) {
    for (const Member& member : roster.members()) SendWorker(member.id, MakePing(member.id));
    next_ping = now + config.heartbeat;
  }
}

std::string_view FrameMachine::State::WhatLacks(const OpenRequest& request) const {
  const auto* const dataset = request.dataset();
  if (dataset == nullptr) return "its dataset was still being loaded";
  if (!dataset->seen) return "its dataset's files were still being looked at";
  if (clients.IsBehind(request.client)) return "this client did not read its earlier pictures";
  if (roster.empty()) return "there was no worker";
  if (request.needs_occupancy && occupancy.Counting(dataset->volume().Whole()))
    return "the occupied voxels of its dataset were still being counted";
  const bool under_way = request.plan<PlanAsked>() != nullptr || (request.plan<PlanMade>() != nullptr && ReadyPlan(request) == nullptr);
  return under_way ? "it was still being planned" : "it was still queued";
}

// Workers that are leaving finish what they have. If nobody else is there, that includes the frames that run; the others wait.
void FrameMachine::State::Advance() {
  if (roster.empty()) return;
  RefuseLate();
  const std::size_t staying = roster.staying();
  if (staying < roster.members().size()) {
    for (RunningFrame& frame : frames) frame.HandOver(roster.Refill(frame.roster()));
  }
  if (staying > 0) BeginAttempts();
  while (true) {
    if (RunningFrame* const next = frames.NextToHandOut(staying)) {
      HandOut(*next);
    } else if (!StartNextFrame(staying)) {
      break;
    }
  }
  if (staying > 0 && !roster.AwaitsReturn()) {
    CountAhead();
    PlanAhead();
  }
  DismissWorkers();
}

// A frame on trial waits until what the others have under way is over.
bool FrameMachine::State::AwaitsTrial(const RunningFrame& frame) {
  return frames.OnTrial() == &frame && frame.between_attempts() && frames.OthersWait(frame);
}

// Workers that hold what they have accumulated of other frames.
std::set<WorkerId> FrameMachine::State::HoldersOf(const RunningFrame& frame) const {
  std::set<WorkerId> holders;
  for (const RunningFrame& other : frames) {
    if (&other != &frame && other.groups_done() > 0) holders.insert(other.display());
  }
  return holders;
}

void FrameMachine::State::BeginAttempts() {
  for (auto it = frames.begin(); it != frames.end();) {
    RunningFrame& frame = *it++;  // FailFrame removes it
    if (!frame.AttemptDue(now) || AwaitsTrial(frame)) continue;
    const std::string why = frame.WhyAgain();
    Status status = frame.BeginAttempt(roster.Refill(frame.roster()), HoldersOf(frame), now);
    if (status.ok()) {
      // The boxes of those that were lost may be too much for the others.
      const Result<int> fit = FramesThatFit(frame.plan(), *frame.planned()->asked.resolved->summary, WorkerLimits());
      if (fit.ok()) {
        frame.SetFit(*fit);
      } else {
        status = {fit.status().code(), fmt::format("{} (attempt {}, since {})", fit.status().message(), frame.attempt(), why)};
      }
    }
    if (!status.ok()) {
      FailFrame(frame, status);
    } else {
      Tell(NoteAbout::kFrames, LogLevel::kWarning, "frame {} of client {}: attempt {}, since {}", frame.id(), frame.request().client,
           frame.attempt(), why);
      SendProgress(frame);
    }
  }
}

// Ends the workers that are leaving and have no part in any frame.
void FrameMachine::State::DismissWorkers() {
  for (const WorkerId worker : roster.Leaving()) {
    if (std::ranges::any_of(frames, [worker](const RunningFrame& frame) { return frame.HasPart(worker); })) continue;
    SendWorker(worker, Stop{.epoch = config.epoch});
    RemoveWorker(worker, LiveRoster::Loss::kLeft);
  }
}

// Starts the first frame in turn that is planned for the present workers and may start. False: there is none, or the workers' memory has no
// room for it yet. None overtakes it then, so that it gets the room.
bool FrameMachine::State::StartNextFrame(std::size_t workers) {
  const auto ready = [&](const OpenRequest& open) {
    const PlanMade* const plan = ReadyPlan(open);
    return plan != nullptr && open.dataset()->seen && !AwaitsCoarse(open) && !clients.IsBehind(open.client) &&
           frames.MayStart(open.client, *plan, workers) && MayBegin(open);
  };
  const OpenRequest* const next = queue.FindNext(ready);
  if (next == nullptr || !frames.HasRoomFor(*ReadyPlan(*next))) return false;
  actions.emplace_back(std::in_place_type<ToDatasets>, KeepDataset{next->use, next->dataset()->datasets()});
  const RunningFrame& running = frames.Add(RunningFrame(frames.next_id(), queue.Take(*next), limits, now));
  const OpenRequest& begun = running.request();
  if (!begun.coarse) forecast.Begin(running.id(), {begun.client, begun.kind, begun.deadline(), begun.used}, now);
  SendProgress(running);
  return true;
}

bool FrameMachine::State::MayBegin(const OpenRequest& request) const {
  return request.coarse || forecast.MayBegin({request.client, request.kind, request.deadline(), queue.UsedBy(request.client)}, now);
}

// Requests that could not be in time even if everything cost half as much as was measured. Clients that ask for too much hear it at once,
// rather than at the deadline.
void FrameMachine::State::RefuseLate() {
  if (!std::exchange(forecast_due, false) || frames.size() == 0) return;
  const PeerToken first = frames.begin()->request().client;
  const bool runs_alone = std::ranges::all_of(frames, [first](const RunningFrame& frame) { return frame.request().client == first; });
  if (runs_alone && queue.clients() == (queue.CountOf(first) > 0 ? 1 : 0)) return;
  std::map<UseId, Duration> late;  // when they would be ready
  Duration ahead = forecast.Left(now);
  queue.VisitInTurn([&](const OpenRequest& request) {
    const Duration cost = request.coarse ? Duration::zero() : forecast.Least(request.kind);
    if (cost == Duration::zero()) return true;
    if (now + (ahead + cost) / 2 > request.deadline()) {
      late.emplace(request.use, ahead + cost);
    } else {
      ahead += cost;
    }
    return true;
  });
  if (late.empty()) return;
  for (const OpenRequest& request : queue.Extract([&](const OpenRequest& each) { return late.contains(each.use); })) {
    FailRequest(request, Status::DeadlineExceeded(fmt::format(
                             "the service has too much to do: the frame would be ready in some {} ms, and its deadline is in {} ms",
                             Milliseconds(late.at(request.use)), Milliseconds(std::max(request.deadline() - now, Duration::zero())))));
  }
}

void FrameMachine::State::HandOut(RunningFrame& frame) {
  RunningFrame::HandOut out = frame.NextGroup(now);
  out.assignment.epoch = config.epoch;
  out.assignment.finished_before = frames.finished_before();
  for (std::vector<Peer>* const peers : {&out.assignment.peers, &out.assignment.others}) {
    for (Peer& peer : *peers) {
      const Register& description = roster.Find(peer.worker)->description;
      peer.images_endpoint = description.images_endpoint;
      peer.memory_scope = description.memory_scope;
      peer.images_key = description.images_key;
    }
  }
  if (const Member* display = roster.Find(out.assignment.display); display != nullptr && !display->description.images_key.empty()) {
    out.assignment.pictures = frame.request().pictures;
  }
  SendWorkers(out.workers, std::move(out.assignment));
}

void FrameMachine::State::StopAll(const CoordinatorToWorker& goodbye, const std::string& reason) {
  const auto everything = [](const OpenRequest&) { return true; };
  for (const OpenRequest& request : queue.Extract(everything)) FailRequest(request, Status::Unavailable(reason));
  for (const RunningFrame& frame : frames) AnswerFailure(frame.request(), Status::Unavailable(reason));
  actions.emplace_back(std::in_place_type<ToDatasets>, EndDatasets{reason});
  for (const Member& member : roster.members()) SendWorker(member.id, goodbye);
  actions.emplace_back(StopService{});
  stopped = true;
}

// When a request fails for want of a worker; Time::max(): not now. If the last worker gave notice, others are expected, and what it left
// behind waits for them.
Time FrameMachine::State::EndOfWait(const OpenRequest& request) const {
  const bool left_behind = roster.last_gave_notice() && request.arrived <= roster.empty_since();
  if (!roster.empty() || left_behind) return Time::max();
  return std::max(request.arrived, roster.empty_since()) + config.worker_wait;
}

Time FrameMachine::State::NextWake() {
  Time next = std::min(roster.NextWake(), clients.NextWake());
  const auto consider = [&](const OpenRequest& request) {
    next = std::min(next, request.deadline());
    next = std::min(next, EndOfWait(request));
  };
  queue.ForEach(consider);
  for (const RunningFrame& frame : frames) {
    consider(frame.request());
    const bool waits_for_others = (roster.staying() == 0 && frame.between_attempts()) || AwaitsTrial(frame);
    if (!waits_for_others) next = std::min(next, frame.NextWake());
  }
  if (!roster.empty()) return std::min(next, next_ping);
  // Often enough that a coordinator that was held up notices how long.
  const bool anything_waits = queue.size() + frames.size() > 0;
  return anything_waits ? std::min(next, now + config.heartbeat) : next;
}

FrameMachine::FrameMachine(CoordinatorConfig config) : state_(std::make_unique<State>(std::move(config))) {
  CHECK_NE(state_->config.epoch, Epoch{0});
}
FrameMachine::~FrameMachine() = default;
FrameMachine::FrameMachine(FrameMachine&&) noexcept = default;

std::vector<FrameAction> FrameMachine::Step(const FrameEvent& event, Time now) {
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
    state.DropCoarse();
    state.Advance();
    state.DropPlans();
  }
  state.wake = state.stopped ? Time::max() : state.NextWake();
  return std::exchange(state.actions, {});
}

Time FrameMachine::NextWake() const { return state_->wake; }

FrameSizes FrameMachine::sizes() const {
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

FrameCounts FrameMachine::counts() const {
  const State& state = *state_;
  const std::size_t staying = state.roster.staying();
  return {.clients = state.clients.size(),
          .queued = state.queue.size(),
          .running = state.frames.size(),
          .workers_staying = staying,
          .workers_leaving = state.roster.members().size() - staying,
          .slots_vacant = std::size_t(std::ranges::count(state.roster.slots().slots, WorkerId{0})),
          .frames_done = state.frames_done,
          .frames_failed = state.frames_failed,
          .frames_cancelled = state.frames_cancelled,
          .workers_lost = state.workers_lost,
          .refused = state.refused};
}

std::uint64_t FrameMachine::frames_done() const { return state_->frames_done; }

}  // namespace slabstream
