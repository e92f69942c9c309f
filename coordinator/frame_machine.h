// FrameMachine: everything the coordinator decides, as a pure state machine. (event, now) -> actions. No sockets, threads, clocks or
// voxels.
//
//   clients    a request is queued; queues of clients are served in turn, one frame each (fair); progress is told; silence or Cancel frees
//   the work.
//              The last answers of a client are kept for it, so that a request that is submitted again costs nothing
//   datasets   loaded at first use; requests wait for it; a failed load fails them
//   occupancy  where a policy asks for it, occupied voxels are counted once for each dataset and transfer function;
//              requests wait for that, and a failed count fails them
//   policies   what a policy leaves open is chosen when its first frame is planned, and kept (PolicyTable)
//   layouts    stay while views change, and learn from the render times of frames (LayoutTable)
//   frames     planned when the window has room (PlanFrame); group after group is handed out, as many as the window allows over all frames,
//              so that groups render while others combine, across frames too; the display worker changes from frame to frame; a frame ends
//              with its FrameImage or with FrameFailed
//   workers    Register gives an id and a slot (a vacant one first); silence, an unreachable peer or Leave takes the worker out, and every
//   frame that
//              it had a part in is re-planned over the rest (attempt + 1) from its first unfinished group, or from the first if the display
//              worker is lost. Slots that stay vacant for vacancy_grace are given up, and the next frame is partitioned anew.
//   stalls     a running frame without any progress for stall_timeout is handed out again (attempt + 1); after max_stalls in a row it
//   fails. No worker for
//              worker_wait fails what waits, saying so. Every request has a deadline.
//   end        ShutDown ends the service: workers Stop. CoordinatorStopRequested ends the coordinator alone: workers Retire and wait for
//   another one.
//              Both fail open requests, then StopService; a stopped machine does nothing more.
//
// What the executor must do: call Step(CoordinatorTick) no later than NextWake(), which is Time::max() if nothing can happen by itself;
// carry the actions out in order; tell WorkerGone or ClientGone when a send finds nobody. Calls that come late are taken for the executor's
// own sleep: nobody's silence is counted against them for that long.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/time.h"
#include "common/classification/classification_table.h"
#include "common/tuning/service_machine.h"
#include "common/wire/any_message.h"
#include "coordinator/occupancy_table.h"
#include "coordinator/peer_token.h"

namespace slabstream {

struct CoordinatorConfig {
  Epoch epoch = 0;  // random, not 0
  std::uint32_t pid = 0;
  std::string slabs_endpoint;
  std::vector<std::string> datasets;  // names of the catalogue
  CostModel cost;
  ServiceSurroundings surroundings;                     // what policies are chosen for; scope and cores are filled in by the service
  Duration heartbeat = std::chrono::milliseconds(500);  // also the interval of Ping
  Duration worker_timeout = std::chrono::seconds(6);
  Duration client_timeout = std::chrono::seconds(10);
  Duration worker_wait = std::chrono::seconds(10);  // for the first worker
  Duration vacancy_grace = std::chrono::seconds(30);
  Duration stall_timeout = std::chrono::seconds(60);
  int max_stalls = 5;
  std::size_t max_queued = 1024;  // frames of all clients
};

// ---- events
struct FromWorker {
  PeerToken from = 0;
  AnyMessage message;
  Bytes payload;
};
struct FromClient {
  PeerToken from = 0;
  AnyMessage message;
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
  DatasetId dataset = 0;
  std::shared_ptr<const VolumeSummary> summary;
};
struct DatasetFailed {
  std::string name;
  Status status;
};
// The end of a count.
struct OccupiedCounted {
  CountId count = 0;
  Result<std::shared_ptr<const OccupancyGrid>> grid;  // of the dataset's size
};
struct CoordinatorStopRequested {};  // SIGTERM
struct CoordinatorTick {};
using CoordinatorEvent = std::variant<FromWorker, FromClient, WorkerGone, ClientGone, DatasetLoaded, DatasetFailed, OccupiedCounted,
                                      CoordinatorStopRequested, CoordinatorTick>;

// ---- actions
struct ToWorker {
  PeerToken to = 0;
  AnyMessage message;
};
struct ToClient {
  PeerToken to = 0;
  AnyMessage message;
  Bytes payload;
};
// -> DatasetLoaded or DatasetFailed
struct LoadDataset {
  std::string name;
  DatasetId dataset = 0;
};
// -> OccupiedCounted: CountOccupied over the voxels of a dataset that was loaded
struct CountDataset {
  CountId count = 0;
  DatasetId dataset = 0;
  std::shared_ptr<const ClassificationTable> table;
};
struct StopService {};  // everything was told; end
using CoordinatorAction = std::variant<ToWorker, ToClient, LoadDataset, CountDataset, StopService>;

class FrameMachine {
 public:
  explicit FrameMachine(CoordinatorConfig config);
  ~FrameMachine();
  FrameMachine(FrameMachine&&) noexcept;

  std::vector<CoordinatorAction> Step(const CoordinatorEvent& event, Time now);
  Time NextWake() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
