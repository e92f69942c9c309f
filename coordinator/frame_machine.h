// FrameMachine: everything that the coordinator decides, as a pure state machine: (event, now) -> actions. It has no sockets, threads,
// clocks or voxels, and it does nothing that takes long: loading, counting and planning are actions that the executor answers with events.
//
//   clients    Requests are queued; the clients are served in turn, one frame each. The machine reports progress. A request ends when its
//              client cancels it or falls silent. The last answers of a client are kept, so that it costs nothing to submit a request
//              again.
//   datasets   A dataset is loaded when it is first used. Requests wait for it; a failed load fails them. Datasets that no request needs
//              are unloaded, the least recently used one first, if they take more than their share of memory_bytes, or if another one
//              cannot be loaded for want of memory.
//   files      A frame of a dataset begins only after a look at its files that began after the request came. If they have changed, they
//              are read anew, and what has not begun waits. Frames that have begun end with the voxels that they began with, which stay
//              until then. Watched folders are looked through every look_interval, and when somebody asks for a name that is not known;
//              files that come and go there are datasets that come and go. DataOrders add and remove datasets, too. A look never holds
//              the machine up: the executor answers it with an event, as it does for loads.
//   questions  What a dataset holds is asked of the executor once the dataset is loaded and its files were looked at, as for frames. A
//              question ends with its answer, with OrderRefused, or with its client.
//   uploads    A client may send a dataset (AddVolume): it is admitted if its name is free and the memory suffices, its bytes come in order
//              within a credit, and the executor stores them. It is a dataset once they are all there. If the client falls silent, gives
//              it up or sends anything else than the next bytes, nothing stays.
//   memory     A frame that does not fit the memory of its workers fails before they are given any of it (FramesThatFit). Frames that
//              fit one by one run one by one.
//   occupancy  Where a policy needs it, occupied voxels are counted once for each dataset, transfer function and renderer. Requests wait
//              for the count; a failed count fails them.
//   plans      The next requests in turn are planned ahead (PlanRequest), as many as the window has room for and kPlansAhead more, so
//              that a frame can start the moment there is room. A request stays in the queue until its frame starts. A plan that was
//              made for other workers than there are now is made again. A failed plan fails its request alone.
//   frames     Group after group is handed out, as many as the window allows over all frames, so that groups render while others
//              combine, across frames too. The display worker changes from frame to frame. A frame ends with its FrameImage or with
//              FrameFailed.
//   workers    Register gives an id and a slot (a vacant one first). Silence, an unreachable peer or Leave takes the worker out. Every
//              frame that it had a part in is re-planned over the others (attempt + 1) from its first unfinished group, or from the
//              first group if the display worker is lost. Slots that stay vacant for vacancy_grace are given up; the next frame is then
//              partitioned anew. A worker that cannot do its part of a frame (WorkerTrouble) is left out of that frame. A frame that
//              twice loses the worker of the same box fails: what it asks for may be what ends them.
//              Workers of an earlier coordinator say which slots they had: they get them again, and plans wait for them a while.
//   leaving    A worker that says that it is leaving loses its slot at once and gets no new frame. It finishes the groups that it has; the
//              rest of a frame is handed over to the workers that stay, if there are any. Without a part in any frame it gets Stop. What
//              the last worker has left behind in this way waits for another one until its deadline.
//   stalls     A frame without progress for stall_timeout is handed out again (attempt + 1); after max_stalls in a row it fails. If there
//              is no worker for worker_wait, everything that waits fails and says so. Every request has a deadline.
//   end        ShutDown ends the service: workers Stop. CoordinatorStopRequested ends the coordinator alone: workers Retire and wait for
//              another coordinator. Both fail the open requests and end with StopService; a stopped machine does nothing more.
//
// What the executor must do: call Step(CoordinatorTick) no later than NextWake(), which is Time::max() if nothing can happen by itself;
// carry out the actions in order; answer LoadDataset, LookAtDataset, LookAtFolders, FindDatasets, AnswerQuestion, BeginUpload,
// FinishUpload, CountDataset and PlanRequest with one event each, in any order; report WorkerGone
// or ClientGone when a send finds nobody. If the executor calls late, the machine assumes that the executor itself was held up, and
// extends everybody's time by as much.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/log.h"
#include "common/base/time.h"
#include "common/wire/any_message.h"
#include "common/wire/limits.h"
#include "coordinator/data_source.h"
#include "coordinator/datasets.h"
#include "coordinator/occupancy_table.h"
#include "coordinator/peer_token.h"
#include "coordinator/plan_request.h"

namespace slabstream {

using OrderId = std::uint64_t;     // of an order about datasets that waits; never given twice
using QuestionId = std::uint64_t;  // likewise
using UploadId = std::uint64_t;    // likewise, of a dataset that a client sends

struct CoordinatorConfig {
  Epoch epoch = 0;  // random, not 0
  std::uint32_t pid = 0;
  std::string slabs_endpoint;
  Catalogue datasets;
  std::set<std::string> folders;                        // that are watched, as WatchedFolder says them
  std::uint64_t memory_bytes = 0;                       // limit of the coordinator's memory; 0: none
  Duration heartbeat = std::chrono::milliseconds(500);  // also the interval of Ping
  Duration worker_timeout = std::chrono::seconds(6);
  Duration client_timeout = std::chrono::seconds(10);
  Duration worker_wait = std::chrono::seconds(10);  // for the first worker
  Duration vacancy_grace = std::chrono::seconds(30);
  Duration return_wait = std::chrono::seconds(5);  // for the workers of an earlier coordinator, once one of them is there
  Duration stall_timeout = std::chrono::seconds(60);
  int max_stalls = 5;
  std::size_t max_queued = 1024;                     // frames of all clients
  Duration look_interval = std::chrono::seconds(5);  // between looks at the watched folders
  std::size_t max_datasets = kMaxListed;             // in the catalogue
  LogLevel log_level = LogLevel::kOff;               // Notes of lower levels are not made
};

// ---- events
struct FromWorker {
  PeerToken from = 0;
  WorkerToCoordinator message;
  Bytes payload;
};
struct FromClient {
  PeerToken from = 0;
  ClientToCoordinator message;
  Bytes payload = {};
};
// A SubmitFrame or question that could not be decoded, with the answer for its client (RefusalOf).
struct BadRequest {
  PeerToken from = 0;
  CoordinatorToClient answer;
  Status why;
};
// The socket says that nobody is there.
struct WorkerGone {
  PeerToken who = 0;
};
struct ClientGone {
  PeerToken who = 0;
};
struct DatasetLoaded {
  std::string name;
  LoadId load = 0;
  DatasetId dataset = 0;  // not 0
  std::shared_ptr<const VolumeSummary> summary;
  std::uint64_t bytes = 0;                           // memory of its voxels beside what the source holds
  std::shared_ptr<const FileStamp> stamp = nullptr;  // of its files as they were read; null: they never change
};
struct DatasetFailed {
  std::string name;
  LoadId load = 0;
  Status status;
};
// The end of a LookAtDataset.
struct DatasetSeen {
  std::string name;
  LoadId load = 0;
  Result<bool> changed;
};
// The end of a LookAtFolders.
struct FoldersSeen {
  std::map<std::string, Result<FoundData>> folders;
};
// The end of a FindDatasets.
struct DatasetsFound {
  OrderId order = 0;
  Result<FoundData> found;
};
// The end of an AnswerQuestion: a reply, or OrderRefused.
struct QuestionAnswered {
  QuestionId question = 0;
  CoordinatorToClient answer;
};
// The end of a BeginUpload: whether there is room.
struct UploadBegun {
  UploadId upload = 0;
  Status status;
};
// The end of a FinishUpload.
struct UploadFinished {
  UploadId upload = 0;
  Result<DataSource> source;
};
// The end of a count.
struct OccupiedCounted {
  CountId count = 0;
  Result<std::shared_ptr<const OccupancyGrid>> grid;  // of the dataset's size
};
// The end of a PlanRequest.
struct Planned {
  PlanId plan = 0;
  Result<std::shared_ptr<const PlannedFrame>> frame;
};
// SIGTERM, or a failure of the executor that leaves it no choice.
struct CoordinatorStopRequested {
  std::string reason = "the coordinator is going down";
};
struct CoordinatorTick {};
using CoordinatorEvent = std::variant<FromWorker, FromClient, BadRequest, WorkerGone, ClientGone, DatasetLoaded, DatasetFailed, DatasetSeen,
                                      FoldersSeen, DatasetsFound, QuestionAnswered, UploadBegun, UploadFinished, OccupiedCounted, Planned,
                                      CoordinatorStopRequested, CoordinatorTick>;

// ---- actions
struct ToWorker {
  PeerToken to = 0;
  CoordinatorToWorker message;
};
struct ToClient {
  PeerToken to = 0;
  CoordinatorToClient message;
  Bytes payload;
};
// -> DatasetLoaded or DatasetFailed
struct LoadDataset {
  std::string name;
  LoadId load = 0;
  DataSource source;
};
// Its voxels are not needed any more.
struct UnloadDataset {
  DatasetId dataset = 0;
};
// -> DatasetSeen: whether the files of a loaded dataset have changed.
struct LookAtDataset {
  std::string name;
  LoadId load = 0;
  std::shared_ptr<const FileStamp> stamp;
};
// -> FoldersSeen: what lies in each of these folders.
struct LookAtFolders {
  std::set<std::string> folders;
};
// -> DatasetsFound: what these arguments of an order mean, and whether it can be read.
struct FindDatasets {
  OrderId order = 0;
  std::vector<std::string> arguments;
};
// -> QuestionAnswered. The voxels may be unloaded as soon as the action is performed: the executor holds them until it has answered.
struct AnswerQuestion {
  QuestionId id = 0;
  Question question;
  DatasetId dataset = 0;
  std::shared_ptr<const VolumeSummary> summary;
};
// -> UploadBegun: room for the bytes of `order`.
struct BeginUpload {
  UploadId upload = 0;
  AddVolume order;
};
// The next bytes, of an upload that was begun.
struct StoreUpload {
  UploadId upload = 0;
  std::uint64_t begin = 0;
  Bytes bytes;
};
// -> UploadFinished: all bytes are there.
struct FinishUpload {
  UploadId upload = 0;
};
struct DropUpload {
  UploadId upload = 0;
};
// -> OccupiedCounted: counts the voxels of the volume that its renderer draws (DrawnTable, CountOccupied). The dataset was loaded.
struct CountDataset {
  CountId count = 0;
  ClassifiedVolume volume;
  std::shared_ptr<const VolumeSummary> summary;
};
// PlanRequest (coordinator/plan_request.h) -> Planned, with the Planner's result.
struct DropPlan {
  PlanId plan = 0;
};
struct StopService {};  // everything was sent; end
// End the connection of a client that reads nothing and says nothing: what waits for it must not stay in memory.
struct DropClient {
  PeerToken client = 0;
};
// A line for the log.
enum class NoteAbout : std::uint8_t { kWorkers, kDatasets, kFrames };
struct Note {
  NoteAbout about = NoteAbout::kWorkers;
  LogLevel level = LogLevel::kInfo;
  std::string text;
};
using CoordinatorAction =
    std::variant<ToWorker, ToClient, DropClient, LoadDataset, UnloadDataset, LookAtDataset, LookAtFolders, FindDatasets, AnswerQuestion,
                 BeginUpload, StoreUpload, FinishUpload, DropUpload, CountDataset, PlanRequest, DropPlan, FrameMeasured, Note, StopService>;

// Entries in the machine's tables. At rest, with nothing asked for and every client gone, they are 0 but for the workers, their slots and
// the grids of earlier counts (at most OccupancyTable::kMaxKept).
struct CoordinatorSizes {
  std::size_t clients = 0, queued = 0, running = 0;
  std::size_t over = 0;  // frames that workers must still be told of
  std::size_t planning = 0, counting = 0, grids = 0;
  std::size_t workers = 0, slots = 0;
  std::size_t orders = 0, awaited = 0;  // that wait for a look at files; names that do
  std::size_t retired = 0;              // voxels that only frames under way use
  std::size_t questions = 0, uploads = 0;
};

class FrameMachine {
 public:
  explicit FrameMachine(CoordinatorConfig config);
  ~FrameMachine();
  FrameMachine(FrameMachine&&) noexcept;

  std::vector<CoordinatorAction> Step(const CoordinatorEvent& event, Time now);
  Time NextWake() const;
  CoordinatorSizes sizes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
