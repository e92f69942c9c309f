// FrameSimulation: the event loop behind SimulateFrames. It runs one FrameMachine and as many WorkerMachines in virtual time, as the
// service does with threads and sockets, and carries out their actions with costs in place of pixels. One object runs once.
//
// Everything that happens is an event at a time: a message arrives, or a task of a worker's thread ends. The machine concerned takes one
// step, and its actions become messages and tasks. Plans are given: each PlanRequest is answered with one of them. Nothing fails here, so
// the machines do nothing by themselves: heartbeats and time-outs are set beyond the end of the run.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "common/simulation/network.h"
#include "common/simulation/union_coverage.h"
#include "coordinator/frame_machine.h"
#include "simulator/event_queue.h"
#include "simulator/frame_account.h"
#include "simulator/simulate_frames.h"
#include "simulator/threads.h"
#include "simulator/worker_lanes.h"
#include "worker/worker_machine.h"

namespace slabstream {

class FrameSimulation {
 public:
  // All valid (SimulateFrames checks).
  FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options);

  Timeline Run();

 private:
  using Index = std::uint32_t;  // of a worker
  struct Group {
    UnionCoverage coverage;
    std::uint32_t steps = 0;  // of its schedule
  };
  struct Parcel {  // an image on its way from worker to worker
    SimulatedMessage message;
    UnionCoverage::Amount amount;
    ColorCoding color = ColorCoding::kFloat32;
    PartialImage image;
  };
  struct Frame {
    std::map<std::uint32_t, Group> groups;  // handed out, and not done as far as the coordinator knows
    FrameAccount account;                   // from its plan until its picture is received
  };

  const FramePlan& plan(std::uint32_t frame) const { return *inputs_[frame].plan; }
  Group& GroupOf(const GroupKey& key) { return frames_.at(frame_of_.at(key.frame)).groups.at(key.group); }
  Time MachineTime() const;
  double now() const { return queue_.now(); }

  // ---- the client
  void Submit();
  void OnPicture(std::uint32_t frame);

  // ---- the coordinator
  void Register();
  void Tell(const CoordinatorEvent& event);             // a message arrives now
  void StepCoordinator(const CoordinatorEvent& event);  // takes no time by itself
  double CoordinatorSends();                            // when a message that it sends now arrives
  void Perform(ToWorker& action);
  void Perform(const ToClient& action);
  void Perform(const LoadDataset& action);
  void Perform(const PlanRequest& action);
  void Perform(const CountDataset&) {}
  void Perform(const DropPlan&) {}
  void Perform(const FrameMeasured&) {}
  void Perform(const StopService&) {}
  void BeginGroup(const GroupAssignment& assignment);

  // ---- workers
  void StepWorker(Index worker, const WorkerEvent& event);
  void Perform(Index worker, SendControl& action);
  void Perform(Index worker, SendChunkRequest& action);
  void Perform(Index worker, StoreChunk& action);
  void Perform(Index worker, StartRender& action);
  void Perform(Index worker, StartCombine& action);
  void Perform(Index worker, FindHidden& action);
  void Perform(Index worker, SendPartial& action);
  void Perform(Index worker, SendFrame& action);
  // These take no time and have no answer.
  void Perform(Index, const ConnectSlabs&) {}
  void Perform(Index, const OpenSlab&) {}
  void Perform(Index, const DropSlab&) {}
  void Perform(Index, const CancelRender&) {}
  void Perform(Index, const ReleaseImage&) {}
  void Perform(Index, const StopProcess&) {}
  LaneTask MakeTask(Work work, Index worker, const GroupKey& key) const;
  void AddTask(LaneTask task) { lanes_.Add(std::move(task), now()); }
  void OnDone(LaneTask& task);
  void Transfer(Parcel* parcel);
  // When the receiver's thread that owns the sockets takes a message that leaves at `sent`. Fills in the times of `message`.
  double Travel(SimulatedMessage& message, double sent);

  const std::span<const FrameInput> inputs_;
  const MachineModel& machine_;
  const SimulationOptions options_;
  const std::vector<WorkerId> ids_;  // of the plans, ascending. The machines know worker i as i + 1
  EventQueue<double> queue_{0};
  Network network_;
  Threads threads_;
  WorkerLanes lanes_;
  FrameMachine coordinator_;
  std::vector<WorkerMachine> workers_;
  bool registering_ = true;
  std::deque<CoordinatorEvent> coordinator_events_;          // that happen at this instant
  std::deque<std::pair<Index, WorkerEvent>> worker_events_;  // likewise
  double coordinator_free_ = 0, planner_free_ = 0;

  std::uint32_t submitted_ = 0, planned_ = 0;  // frames
  std::map<FrameId, std::uint32_t> frame_of_;
  std::map<std::uint32_t, Frame> frames_;  // that are under way
  std::deque<Parcel> parcels_;             // a direct send of p ranks has p^2 of them under way: they are used again
  std::vector<Parcel*> unused_parcels_;
  double render_seconds_ = 0;
  Timeline timeline_;
};

}  // namespace slabstream
