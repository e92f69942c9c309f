// FrameMachine::State: what the machine knows, and its handlers. Not for executors: only the sources frame_machine*.cpp include it.
//
// Every Step: take the event in (On), let time take effect (Expire), then start whatever can start (Advance). Handlers append to `actions`.
//   frame_machine.cpp           frames, time, and the Step itself
//   frame_machine_data.cpp      datasets: the catalogue, files, voxels
//   frame_machine_workers.cpp   messages of workers
//   frame_machine_clients.cpp   messages of clients and the ends of their requests
//   frame_machine_questions.cpp questions about what datasets hold
//   frame_machine_uploads.cpp   datasets that clients send
#pragma once

#include <fmt/format.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/clients.h"
#include "coordinator/datasets.h"
#include "coordinator/frame_machine.h"
#include "coordinator/frames_in_flight.h"
#include "coordinator/occupancy_table.h"
#include "coordinator/request_queue.h"
#include "coordinator/roster.h"

namespace slabstream {

// Fits the wire's limit for texts, whatever a worker or a file name contributed.
inline Status Bounded(const Status& status) {
  return status.message().size() <= kMaxTextBytes ? status : Status(status.code(), status.message().substr(0, kMaxTextBytes));
}

inline std::uint32_t Milliseconds(Duration duration) {
  return std::uint32_t(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count());
}

// What datasets, and pictures that clients have not read, may take of a coordinator's memory; the rest is for a volume that is being read
// and for pictures on their way. `memory_bytes` 0: no limit.
inline std::uint64_t DatasetShare(std::uint64_t memory_bytes) { return memory_bytes == 0 ? UINT64_MAX : memory_bytes / 4 * 3; }
inline std::uint64_t UnreadShare(std::uint64_t memory_bytes) { return memory_bytes == 0 ? UINT64_MAX : memory_bytes / 16; }

struct FrameMachine::State {
  explicit State(CoordinatorConfig c)
      : config(std::move(c)),
        roster(config.worker_timeout, config.vacancy_grace, config.return_wait),
        datasets(config.datasets, config.folders),
        clients(config.client_timeout, UnreadShare(config.memory_bytes)),
        limits{.stall_timeout = config.stall_timeout,
               .max_stalls = config.max_stalls,
               .pause = config.heartbeat,
               .proof_of_life = config.heartbeat,
               .suspicion = config.worker_timeout} {}

  const CoordinatorConfig config;
  LiveRoster roster;
  DatasetTable datasets;
  ClientTable clients;
  RequestQueue queue;
  FramesInFlight frames;
  OccupancyTable occupancy;
  std::set<PlanId> planning;  // requested and neither answered nor dropped
  PlanId last_plan = 0;
  const FrameLimits limits;

  Time now;                     // of this Step
  Time wake = Time::max();      // promised at the end of the last Step
  std::optional<Time> started;  // the first Step
  Time last_end;                // of a frame
  Time next_ping;               // while there are workers
  bool stopped = false;
  std::uint64_t frames_done = 0, frames_failed = 0, workers_lost = 0;
  RefusedRequests refused;

  // An order that waits for a look at files. kList: for that at the folders and those at datasets.
  struct OpenOrder {
    PeerToken client = 0;
    DataOrder order;
    LookId folders = 0;
    std::map<std::string, LookId> datasets = {};
  };
  std::map<OrderId, OpenOrder> orders;  // at most one of each client
  OrderId last_order = 0;
  // A question that has no answer yet.
  struct OpenQuestion {
    PeerToken client = 0;
    Question question;
    LookId look = 0;     // at its dataset's files, which must be over before; 0: none
    bool asked = false;  // of the executor
  };
  std::map<QuestionId, OpenQuestion> questions;  // in order of arrival
  QuestionId last_question = 0;
  // A dataset on its way from a client.
  struct OpenUpload {
    PeerToken client = 0;
    AddVolume order;
    std::uint64_t received = 0, allowed = 0;  // bytes
  };
  std::map<UploadId, OpenUpload> uploads;  // at most one of each client
  UploadId last_upload = 0;
  LookCounter folder_looks;
  Time next_round;                            // when the folders are looked through, if there are any
  std::set<std::string> complaints;           // about what lies in the folders
  std::map<std::string, std::string> hidden;  // names that were removed though their files are still there, and the folder of each

  std::vector<CoordinatorAction> actions;  // of this Step

  // ---- events
  void On(const FromWorker& event) {
    std::visit([&](const auto& message) { OnWorkerMessage(event, message); }, event.message);
  }
  void On(const FromClient& event) {
    clients.Touch(event.from, now);
    if (const auto* part = std::get_if<VolumePart>(&event.message)) return OnVolumePart(event.from, *part, event.payload);
    std::visit([&](const auto& message) { OnClientMessage(event.from, message); }, event.message);
  }
  void On(const WorkerGone& event) {
    for (const WorkerId worker : roster.At(event.who)) LoseWorker(worker, LiveRoster::Loss::kGone);
  }
  void On(const BadRequest& event);
  void On(const ClientGone& event) {
    std::erase_if(orders, [&](const auto& order) { return order.second.client == event.who; });
    FreeClient(event.who);
  }
  void On(const QuestionAnswered& event);
  void On(const UploadBegun& event);
  void On(const UploadFinished& event);
  void On(const DatasetLoaded& event);
  void On(const DatasetFailed& event);
  void On(const DatasetSeen& event);
  void On(const FoldersSeen& event);
  void On(const DatasetsFound& event);
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
  void OnClientMessage(PeerToken client, const SubmitFrame& message);
  void OnClientMessage(PeerToken client, const CancelFrame& message);
  void OnClientMessage(PeerToken client, const ClientPing& message);
  void OnClientMessage(PeerToken client, const StatusQuery& message);
  void OnClientMessage(PeerToken client, const ShutDown& message);
  void OnClientMessage(PeerToken client, const DataOrder& message);
  void OnClientMessage(PeerToken client, const SummaryQuery& message) { Ask(client, message); }
  void OnClientMessage(PeerToken client, const SampleQuery& message) { Ask(client, message); }
  void OnClientMessage(PeerToken client, const PickQuery& message) { Ask(client, message); }
  void OnClientMessage(PeerToken client, const AddVolume& message);
  void OnClientMessage(PeerToken client, const DropVolume& message);
  void OnClientMessage(PeerToken, const VolumePart&) {}  // see On(FromClient)
  void OnVolumePart(PeerToken client, const VolumePart& part, const Bytes& payload);
  void OnClientMessage(PeerToken, const KeysOrder&) {}  // its executor carries them out

  // ---- requests
  bool IsOpen(PeerToken client, RequestId request) { return queue.Contains(client, request) || frames.FindRequest(client, request); }
  Status WithinQuota(PeerToken client) const;
  void SendQueued(const OpenRequest& request);
  void EndRequest(PeerToken client, RequestId request, CoordinatorToClient message, Bytes payload);
  using Refusal = std::uint64_t RefusedRequests::*;
  void RefuseRequest(const OpenRequest& request, const Status& status, Refusal reason);
  void FailRequest(const OpenRequest& request, const Status& status);
  void AnswerFailure(const OpenRequest& request, const Status& status);
  void SendAnswer(PeerToken client, Answer& answer);
  void FreeClient(PeerToken client);

  // ---- questions
  void Ask(PeerToken client, Question question);
  void AskExecutor();
  bool IsAskedAbout(const std::string& dataset) const;  // by a question that the executor has not been asked
  // Those about the dataset that the executor has not been asked.
  void RefuseQuestions(const std::string& dataset, const Status& status);
  void RefuseQuestion(const OpenQuestion& open, const Status& status);

  // ---- uploads
  Status AdmitUpload(const AddVolume& order);
  std::uint64_t UploadBytes() const;  // of those under way
  void GrantCredit(OpenUpload& upload);
  using Upload = std::map<UploadId, OpenUpload>::iterator;
  Upload UploadOf(PeerToken client, std::optional<std::uint64_t> nonce = {});  // end: it has none, or another one
  void EndUpload(Upload upload, const Status& why);                            // without a dataset

  // ---- datasets
  Status FindVolume(OpenRequest& request) const;
  LookId SeekData(const std::string& name);
  Status Seek(OpenRequest& request);
  bool IsSeen(const OpenRequest& request) const {
    return request.look == 0 || datasets.Find(request.submit.frame.dataset)->looks.IsOver(request.look);
  }
  bool InUse(DatasetId dataset);
  bool UnloadOne();  // false: all are in use
  void UnloadRetired();
  void LoadData(const std::string& name);
  void LookAt(const std::string& name);
  void LookThroughFolders();
  void LookAtEverything();
  void FailData(const std::string& name, const Status& status);
  void RenewData(const std::string& name);
  void AddData(const std::string& name, const DataSource& source);
  void RemoveData(const std::string& name, const std::string& why);
  void StopWatching(const std::string& folder);
  void MergeFolder(const std::string& folder, const Catalogue& found, const std::string& gone);
  Status Remove(const std::vector<std::string>& items);
  Status Reload(const std::vector<std::string>& items);
  Status AddFound(const FoundData& found);
  void AnswerOrder(PeerToken client, const DataOrder& order, const Status& status);
  void AnswerLists();

  // ---- frames and workers
  void Expire();
  void Advance();
  void BeginAttempts();
  void DismissWorkers();
  Time EndOfWait(const OpenRequest& request) const;
  Result<int> FramesThatFitWorkers(const FramePlan& plan, const VolumeSummary& summary) const;
  bool WaitsForCount(const OpenRequest& request) { return request.needs_occupancy && !occupancy.Find(request.volume->Whole()); }
  void CountAhead();
  void PlanAhead();
  void DropPlans();
  PlanRequest MakePlanRequest(const OpenRequest& request);
  bool HasPlan(const OpenRequest& request) const { return request.planned != nullptr && request.planned_for == roster.version(); }
  bool StartNextFrame();
  void HandOut(RunningFrame& frame);
  void AfterGroupDone(const RunningFrame& frame);
  void EndFrame(FrameId id, std::string_view result);
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
  void SendWorker(WorkerId worker, CoordinatorToWorker message) {
    if (const Member* member = roster.Find(worker)) actions.emplace_back(ToWorker{.to = member->peer, .message = std::move(message)});
  }
  void SendClient(PeerToken client, CoordinatorToClient message, Bytes payload = {}) {
    clients.Sent(client, payload.size());
    actions.emplace_back(ToClient{.to = client, .message = std::move(message), .payload = std::move(payload)});
  }
};

}  // namespace slabstream
