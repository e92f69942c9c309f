// FrameMachine::State: what the machine knows, and its handlers. Not for executors: only the sources frame_machine*.cpp include it.
//
// Every Step: take the event in (On), let time take effect (Expire), then start whatever can start (Advance). Handlers append to `actions`.
//   frame_machine.cpp          plans, frames, time, and the Step itself
//   frame_machine_previews.cpp quick pictures from coarse levels
//   frame_machine_workers.cpp  messages of workers
//   frame_machine_clients.cpp  messages of clients, news of datasets, and the ends of requests
#pragma once

#include <fmt/format.h>

#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/overloaded.h"
#include "coordinator/frames/clients.h"
#include "coordinator/frames/frame_machine.h"
#include "coordinator/frames/frames_in_flight.h"
#include "coordinator/frames/occupancy_table.h"
#include "coordinator/frames/request_queue.h"
#include "coordinator/frames/roster.h"

namespace slabstream {

inline std::uint32_t Milliseconds(Duration duration) {
  return std::uint32_t(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count());
}

// What pictures that clients have not read may take of a coordinator's memory. `memory_bytes` 0: no limit.
inline std::uint64_t UnreadShare(std::uint64_t memory_bytes) { return memory_bytes == 0 ? UINT64_MAX : memory_bytes / 16; }

struct FrameMachine::State {
  explicit State(CoordinatorConfig c)
      : config(std::move(c)),
        roster(config.worker_timeout, config.vacancy_grace, config.return_wait),
        clients(config.client_timeout, UnreadShare(config.memory_bytes)),
        limits{.stall_timeout = config.stall_timeout,
               .max_stalls = config.max_stalls,
               .pause = config.heartbeat,
               .proof_of_life = config.heartbeat,
               .suspicion = config.worker_timeout} {}

  const CoordinatorConfig config;
  LiveRoster roster;
  ClientTable clients;
  RequestQueue queue;
  FramesInFlight frames;
  DeadlineForecast forecast;
  bool forecast_due = false;  // requests have come, or a frame has ended
  OccupancyTable occupancy;
  std::set<PlanId> planning;  // requested and neither answered nor dropped
  PlanId last_plan = 0;
  UseId last_use = 0;
  const FrameLimits limits;

  Time now;                     // the time of this Step
  Time wake = Time::max();      // promised at the end of the last Step
  std::optional<Time> started;  // the first Step
  Time next_ping;               // while there are workers
  bool stopped = false;
  std::uint64_t frames_done = 0, frames_failed = 0, frames_cancelled = 0, workers_lost = 0;
  RefusedRequests refused;

  std::vector<FrameAction> actions;  // the actions of this Step

  // ---- events
  void On(const FromWorker& event) {
    std::visit([&](const auto& message) { OnWorkerMessage(event, message); }, event.message);
  }
  void On(const FromClient& event) {
    clients.Touch(event.from, now);
    std::visit(Overloaded{[&](const SubmitFrame& message) { OnSubmit(event, message); },
                          [&](const ClientPing& message) { OnPing(event, message); },
                          [&](const auto& message) { OnClientMessage(event.from, message); }},
               event.message);
  }
  void On(const WorkerGone& event) {
    for (const WorkerId worker : roster.At(event.who)) LoseWorker(worker, LiveRoster::Loss::kGone);
  }
  void On(const ClientHeard& event) { event.sends_volume ? clients.Meet(event.from, now) : clients.Touch(event.from, now); }
  void On(const ClientGone& event) { FreeClient(event.who); }
  void On(const DatasetNews& event);
  void On(const OccupiedCounted& event);
  void On(const Planned& event);
  void On(const CoordinatorStopRequested& event) { StopAll(Retire{.epoch = config.epoch}, event.reason); }
  void On(const CoordinatorTick&) {}

  // ---- messages of workers
  void OnWorkerMessage(const FromWorker& event, const Register& message);
  void OnWorkerMessage(const FromWorker& event, const Heartbeat& message);
  void OnWorkerMessage(const FromWorker& event, const GroupDone& message);
  void OnWorkerMessage(const FromWorker& event, const FrameImage& message);
  void OnWorkerMessage(const FromWorker& event, const WorkerTrouble& message);
  void OnWorkerMessage(const FromWorker& event, const Leave& message);
  // What a worker says counts on its own connection, which its heartbeats tell: nobody speaks for another one.
  bool IsFrom(const FromWorker& event, Epoch epoch, WorkerId worker) const {
    return epoch == config.epoch && roster.PeerOf(worker) == event.from;
  }

  // ---- messages of clients
  void OnSubmit(const FromClient& event, const SubmitFrame& message);
  void OnClientMessage(PeerToken client, const CancelFrame& message);
  void OnPing(const FromClient& event, const ClientPing& message);
  void OnClientMessage(PeerToken client, const StatusQuery& message);
  std::vector<WebTraffic> WebTrafficOfAll() const;  // what this process and its workers read, by server
  void OnClientMessage(PeerToken client, const ShutDown& message);

  // ---- requests
  bool IsOpen(PeerToken client, RequestId request) { return queue.Find(client, request) != nullptr || frames.FindRequest(client, request); }
  Status WithinQuota(PeerToken client) const;
  Status Resolve(OpenRequest& request, const DatasetReady& ready) const;
  void SendQueued(const OpenRequest& request, const DatasetAwaited* awaited);  // null: its dataset is there
  void EndRequest(PeerToken client, RequestId request, CoordinatorToClient message, Bytes payload);
  // `as`: it is refused; else it has failed.
  void FailRequest(const OpenRequest& request, const Status& status, RefusedAs as = nullptr);
  void AnswerFailure(const OpenRequest& request, const Status& status, RefusedAs as = nullptr);
  void SendAnswer(PeerToken client, Answer& answer);
  void QueueCoarse(const OpenRequest& request);
  bool IsWanted(const OpenRequest& coarse);
  bool AwaitsCoarse(const OpenRequest& request) const;
  void DropCoarse();
  void FreeClient(PeerToken client);

  // ---- frames and workers
  void Expire();
  void Advance();
  bool MayBegin(const OpenRequest& request) const;
  void RefuseLate();
  void BeginAttempts();
  bool AwaitsTrial(const RunningFrame& frame);
  std::set<WorkerId> HoldersOf(const RunningFrame& frame) const;
  void DismissWorkers();
  Time EndOfWait(const OpenRequest& request) const;
  std::vector<WorkerLimit> WorkerLimits() const;
  bool Lower(OpenRequest& request, const PlannedFrame& planned);
  static Status WhyTooLarge(const OpenRequest& request, const PlannedFrame& planned);
  void CountAhead();
  void PlanAhead();
  void DropPlans();
  PlanRequest MakePlanRequest(const OpenRequest& request, std::shared_ptr<const OccupancyGrid> occupied);
  const PlanMade* ReadyPlan(const OpenRequest& request) const {  // null: its present workers have none
    const auto* const made = request.plan<PlanMade>();
    return made != nullptr && made->version == roster.version() ? made : nullptr;
  }
  std::string_view WhatLacks(const OpenRequest& request) const;  // until its frame can begin
  bool StartNextFrame(std::size_t workers);
  void HandOut(RunningFrame& frame);
  void SendProgress(const RunningFrame& frame) {
    if (!frame.request().coarse) SendClient(frame.request().client, frame.Progress());
  }
  void AfterGroupDone(const RunningFrame& frame);
  void EndFrame(FrameId id, std::string_view result, DeadlineForecast::Ended how = DeadlineForecast::Ended::kGivenUp);
  void FailFrame(const RunningFrame& frame, const Status& status);
  void LoseWorker(WorkerId worker, LiveRoster::Loss loss);
  void RemoveWorker(WorkerId worker, LiveRoster::Loss loss);
  void StopAll(const CoordinatorToWorker& goodbye, const std::string& reason);
  Ping MakePing(WorkerId to) const {
    return {.epoch = config.epoch,
            .finished_before = frames.finished_before(),
            .cancelled = frames.cancelled(),
            .place = roster.PlaceOf(to),
            .gone = roster.Gone(now)};
  }
  Time NextWake();

  // ---- actions
  template <class... Values>
  void Tell(NoteAbout about, LogLevel level, fmt::format_string<Values...> format, Values&&... values) {
    if (level < config.log_level) return;
    actions.emplace_back(Note{about, level, fmt::format(format, std::forward<Values>(values)...)});
  }
  void SendWorkers(std::span<const WorkerId> workers, CoordinatorToWorker message) {
    std::vector<PeerToken> to;
    for (const WorkerId worker : workers) {
      if (const Member* const member = roster.Find(worker)) to.push_back(member->peer);
    }
    if (!to.empty()) actions.emplace_back(TellWorkers{.to = std::move(to), .message = std::move(message)});
  }
  void SendWorker(WorkerId worker, CoordinatorToWorker message) { SendWorkers(std::span(&worker, 1), std::move(message)); }
  void SendClient(PeerToken client, CoordinatorToClient message, Bytes payload = {}) {
    clients.Sent(client, payload.size());
    actions.emplace_back(ToClient{.to = client, .message = std::move(message), .payload = std::move(payload)});
  }
};

}  // namespace slabstream
