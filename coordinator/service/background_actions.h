// BackgroundActions: the actions of the coordinator's machines that take long, on threads of their own: up to kLoadsAtOnce load datasets
// from files or take memory for uploads, up to kChecksAtOnce check files, up to kAnswersAtOnce answer questions about voxels of files, and
// as many of each beside them about what lies at each server; up to kCountsAtOnce count occupied voxels, each of another dataset, and up to
// kPlansAtOnce plan, each for another client. None waits for another, and who has used least time is next (FairTasks). An exception in one
// fails only what it was doing. What they find comes back as events for the machines. A plan that is dropped stops soon.
//
// One thread uses an object of this class: the one that runs the machines.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>

#include "common/classification/count_occupied.h"
#include "common/transport/mailbox.h"
#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/frames/frame_machine.h"
#include "coordinator/planner/planner.h"
#include "coordinator/service/fair_tasks.h"
#include "coordinator/service/folder_memory.h"
#include "coordinator/service/upload_buffer.h"
#include "coordinator/service/voxel_server.h"
#include "data/catalogue/catalogue.h"

namespace slabstream {

using CoordinatorEvent = Merged<FrameEvent, DatasetEvent>;

// Called by the planning and the counting threads. Tests replace them by functions that fail or wait.
using CountFunction = std::function<OccupancyGrid(const VoxelBricks&, const ClassificationTable&, const VolumeSummary*)>;
using PlanFunction = std::function<Result<std::shared_ptr<const PlannedFrame>>(Planner&, const PlanRequest&)>;

inline constexpr std::size_t kLoadsAtOnce = 4;
inline constexpr std::size_t kAnswersAtOnce = 2;
inline constexpr std::size_t kMostThreads = 1024;  // of each kind: files never wait for servers, and a thread that waits costs little
inline constexpr std::size_t kChecksAtOnce = 4;    // so one file system that does not answer leaves the others alone
inline constexpr std::size_t kCountsAtOnce = 4;
inline constexpr std::size_t kPlansAtOnce = 8;

class BackgroundActions {
 public:
  // `voxels` serves the voxels of the datasets that are loaded, and must outlive this.
  BackgroundActions(PlanFunction make_plan, CountFunction count_occupied, VoxelServer& voxels);

  // Each begins an action. An event: the action is over already, or could not begin.
  using AtOnce = std::optional<CoordinatorEvent>;
  AtOnce Perform(LoadDataset& action);
  AtOnce Perform(UnloadDataset& action);
  AtOnce Perform(CheckDatasetFiles& action);
  AtOnce Perform(CheckWatchedFolders& action);
  AtOnce Perform(FindDatasets& action);
  AtOnce Perform(AnswerQuestion& action);
  AtOnce Perform(BeginUpload& action);
  AtOnce Perform(StoreUpload& action);
  AtOnce Perform(FinishUpload& action);
  AtOnce Perform(DropUpload& action);
  AtOnce Perform(CountDataset& action);
  AtOnce Perform(PlanRequest& action);
  AtOnce Perform(DropPlan& action);
  AtOnce Perform(FrameMeasured& action);

  // Hands over what has ended since the last call, one event after the other. Voxels of a loaded dataset are served from just before its
  // event: before the machine can send anybody for them, and after whatever earlier events did to voxels of the same id.
  void HandleEvents(const std::function<void(CoordinatorEvent)>& handle);
  // Notified when there is something to take.
  Wakeup& wakeup() { return inbox_->wakeup(); }

 private:
  // What a task ends with.
  struct News {
    CoordinatorEvent event;
    DatasetId dataset = 0;
    VoxelServer::Samples samples = {};
    std::shared_ptr<UploadBuffer> upload = nullptr;  // the event is UploadBegun: the buffer for its bytes
  };
  static Result<News> Load(const LoadDataset& action, const TellRead& tell);
  static Result<News> Open(const LoadDataset& action, OpenedSource opened, const TellRead& tell);
  static Result<News> Hold(const LoadDataset& action, const LoadedSource& loaded);
  static Result<News> LoadPlane(const LoadDataset& action, const VoxelServer::Samples& samples);
  static Result<News> LoadLevel(const LoadDataset& action, const SourceAtLevel& at, const TellRead& tell);
  // Has `make` make news on a thread of `tasks`; if it fails, `failed(why)` makes the event.
  AtOnce Post(auto&& tasks, const char* what, auto make, auto failed);
  // Where the event holds a result: that of `find`, or the error.
  AtOnce PostResult(auto&& tasks, const char* what, auto find, auto end);

  const std::shared_ptr<Mailbox<News>> inbox_ = std::make_shared<Mailbox<News>>();  // tasks that outlive this share it
  const PlanFunction make_plan_;
  const CountFunction count_occupied_;
  const std::shared_ptr<Planner> planner_;
  VoxelServer& voxels_;
  // what the search under way knows; one search at a time
  const std::shared_ptr<FolderMemory> folders_ = std::make_shared<FolderMemory>();
  std::map<UploadId, std::shared_ptr<UploadBuffer>> uploads_;  // begun and neither finished nor dropped; null: memory is being taken
  std::map<PlanId, std::stop_source> plans_;                   // under way and not dropped
  FairTasks loads_{kMostThreads, kLoadsAtOnce}, checks_{kMostThreads, kChecksAtOnce}, answers_{kMostThreads, kAnswersAtOnce};  // by server
  FairTasks counts_{kCountsAtOnce}, planning_{kPlansAtOnce};
};

}  // namespace slabstream
