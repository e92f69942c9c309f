// FrameMachine: everything that the coordinator decides about requests, frames, workers and clients, as a pure state machine (machines.h).
// It has no sockets, threads, clocks or voxels, and it does nothing that takes long: counting and planning are actions that the executor
// answers with events.
//
//   clients    Requests are queued, and wait for their datasets (DatasetNews); the clients are served in turn, one frame each. The machine
//              reports progress. A request ends when its client cancels it or falls silent. The last answers of a client are kept, so that
//              it costs nothing to submit a request again.
//   previews   A request with previews has a quick picture from a coarse level first, while its own voxels are read or if they are read
//              in parts. Its frame begins after that.
//   memory     A frame that does not fit the memory of its workers fails before they are given any of it (FramesThatFit). Frames that
//              fit one by one run one by one.
//   occupancy  Where a policy needs it, occupied voxels are counted once for each dataset, transfer function and renderer. Requests wait
//              for the count, and a failed count fails them, unless their policy is open: their frames begin without it.
//   plans      The next requests in turn are planned ahead (PlanRequest), as many as the window has room for and kPlansAhead more, so
//              that a frame can start the moment there is room. A request stays in the queue until its frame starts. A plan that was
//              made for other workers than there are now is made again. A failed plan fails its request alone.
//   frames     Group after group is handed out, as many as the window allows over all frames, so that groups render while others
//              combine, across frames too. The display worker changes from frame to frame. A frame ends with its FrameImage or with
//              FrameFailed.
//   workers    Register gives an id and a slot (a vacant one first). Silence, an unreachable peer or Leave takes the worker out. Every
//              frame that it had a part in is re-planned over the others (attempt + 1) from its first unfinished group, or from the
//              first group if the display worker is lost. Slots that stay vacant for vacancy_grace are given up; the next frame is then
//              partitioned anew. A worker that cannot do its part of a frame (WorkerTrouble) is left out of that frame. If a frame
//              loses the worker of the same box twice, the box is tried alone, and others wait; the third time, the frame fails
//              (Suspects).
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
// carry out the actions in order; answer SeekDataset with DatasetNews, and CountDataset and PlanRequest with one event each, in any order;
// report WorkerGone or ClientGone when a send finds nobody. If the executor calls late, the machine assumes that the executor itself was
// held up, and extends everybody's time by as much.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/time.h"
#include "common/base/web_traffic.h"
#include "common/memory/bytes.h"
#include "common/planning/placement.h"
#include "common/wire/control_messages.h"
#include "coordinator/frames/occupancy_table.h"
#include "coordinator/machines.h"
#include "coordinator/peer_token.h"
#include "coordinator/plan_request.h"

namespace slabstream {

struct CoordinatorConfig {
  Epoch epoch = 0;  // random, not 0
  std::uint32_t pid = 0;
  std::string voxels_endpoint;
  std::uint64_t memory_bytes = 0;                       // limit of the coordinator's memory; 0: none
  Duration heartbeat = std::chrono::milliseconds(500);  // also the interval of Ping
  Duration worker_timeout = std::chrono::seconds(6);
  Duration client_timeout = std::chrono::seconds(10);
  Duration worker_wait = std::chrono::seconds(10);  // for the first worker
  Duration vacancy_grace = std::chrono::seconds(30);
  Duration return_wait = std::chrono::seconds(5);  // for the workers of an earlier coordinator, once one of them is there
  Duration stall_timeout = std::chrono::seconds(60);
  int max_stalls = 5;
  std::size_t max_queued = 1024;              // frames of all clients
  std::uint64_t share_pixels = kSharePixels;  // pixels of a share, in a picture that its client puts together (ClientTakes)
  LogLevel log_level = LogLevel::kOff;        // Notes of lower levels are not made
  // what this process reads from web servers; null: it reads from none
  std::function<std::vector<WebTraffic>()> web_traffic = nullptr;
};

// ---- events
struct FromWorker {
  PeerToken from = 0;
  WorkerToCoordinator message;
  Bytes payload;
};
struct FromClient {
  PeerToken from = 0;
  ClientToFrames message;
  std::string host = {};           // the host that it has connected from, as endpoints spell it; empty: not known
  std::uint64_t unsent_bytes = 0;  // bytes of the payloads for this client that wait in this process
};
// The client has said something to the DatasetMachine, too.
struct ClientHeard {
  PeerToken from = 0;
  bool sends_volume = false;  // from now on its silence is noticed
};
// The socket says that nobody is there.
struct WorkerGone {
  PeerToken who = 0;
};
struct ClientGone {
  PeerToken who = 0;
};
// The end of a count.
struct OccupiedCounted {
  CountId count = 0;
  Result<std::shared_ptr<const OccupancyGrid>> grid;  // the grid has the dataset's size
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
using FrameEvent = std::variant<FromWorker, FromClient, ClientHeard, WorkerGone, ClientGone, DatasetNews, OccupiedCounted, Planned,
                                CoordinatorStopRequested, CoordinatorTick>;

// ---- actions
// The same message to each of them.
struct TellWorkers {
  std::vector<PeerToken> to;
  CoordinatorToWorker message;
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
using FrameAction =
    std::variant<TellWorkers, ToClient, DropClient, ToDatasets, CountDataset, PlanRequest, DropPlan, FrameMeasured, Note, StopService>;

// Entries in the machine's tables. At rest, with nothing asked for and every client gone, they are 0 but for the workers, their slots and
// the grids of earlier counts (at most OccupancyTable::kMaxKept).
struct FrameSizes {
  std::size_t clients = 0, queued = 0, running = 0;
  std::size_t over = 0;  // frames that workers must still be told of
  std::size_t planning = 0, counting = 0, grids = 0;
  std::size_t workers = 0, slots = 0;
};

// What there is, and what has been counted since the start.
struct FrameCounts {
  std::size_t clients = 0, queued = 0, running = 0;
  std::size_t workers_staying = 0, workers_leaving = 0, slots_vacant = 0;
  std::uint64_t frames_done = 0, frames_failed = 0;
  std::uint64_t frames_cancelled = 0;  // by their clients, or because these have gone
  std::uint64_t workers_lost = 0;
  RefusedRequests refused;
};

class FrameMachine {
 public:
  explicit FrameMachine(CoordinatorConfig config);
  ~FrameMachine();
  FrameMachine(FrameMachine&&) noexcept;

  std::vector<FrameAction> Step(const FrameEvent& event, Time now);
  Time NextWake() const;
  FrameSizes sizes() const;
  FrameCounts counts() const;
  std::uint64_t frames_done() const;  // counts().frames_done

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
