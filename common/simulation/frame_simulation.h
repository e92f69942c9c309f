// FrameSimulation: the event loop behind SimulateFrames. One object runs once.
//
// Whatever happens is an event at a time: a message arrives somewhere, or a task ends. Each event is handled completely before the next; of
// events at the same time the one that was caused first goes first.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <queue>
#include <set>
#include <span>
#include <vector>

#include "common/combining/schedule_runner.h"
#include "common/simulation/frame_account.h"
#include "common/simulation/hand_outs.h"
#include "common/simulation/network.h"
#include "common/simulation/simulate_frames.h"
#include "common/simulation/threads.h"
#include "common/simulation/union_coverage.h"
#include "common/simulation/worker_lanes.h"

namespace slabstream {

class FrameSimulation {
 public:
  // All valid (SimulateFrames checks).
  FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options);

  Timeline Run();

 private:
  enum class Arrival : std::uint8_t { kRequest, kAssignment, kVoxels, kPartial, kGroupImage, kGroupDone, kPicture, kReceived, kTaskKnown };
  struct Event {
    double time = 0;
    std::uint64_t order = 0;
    Arrival what = Arrival::kRequest;
    std::uint32_t frame = 0, group = 0;
    std::uint32_t number = 0;  // worker, rank or step
    LaneTask task;             // kTaskKnown
    friend bool operator>(const Event& a, const Event& b) { return a.time != b.time ? a.time > b.time : a.order > b.order; }
  };
  using Runner = ScheduleRunner<RankInterval>;
  using Parts = Runner::Parts;
  struct Message {  // encoded, on its way
    Parts parts;
    UnionCoverage::Amount amount;
  };
  struct Group {  // between its hand-out and its being accumulated
    std::unique_ptr<UnionCoverage> coverage;
    SharedSchedule schedule;
    std::map<std::uint32_t, Runner> runs;       // by worker that holds ranks
    std::map<std::uint32_t, Message> messages;  // by step
    bool root_done = false;
    UnionCoverage::Amount image;  // of the group
    bool local = false;           // the display worker made it
  };
  struct Frame {
    std::map<std::uint32_t, Group> groups;
    std::set<std::uint32_t> complete;  // group images at the display worker, not yet accumulated
    std::uint32_t accumulated = 0;     // groups
    bool accumulating = false;
    std::unique_ptr<FrameAccount> account;  // from its plan until its picture is received
  };

  const FramePlan& plan(std::uint32_t frame) const { return *inputs_[frame].plan; }
  std::uint32_t IndexOf(WorkerId worker) const;
  std::uint32_t display(std::uint32_t frame) const { return IndexOf(plan(frame).display); }
  void Post(double time, Arrival what, std::uint32_t frame, std::uint32_t group = 0, std::uint32_t number = 0);
  void Handle(const Event& event);

  // ---- the client and the coordinator
  void Submit(double now);
  void CoordinatorTakes(double now);
  void HandOutGroups();
  void HandOut(std::uint32_t frame, std::uint32_t group);

  // ---- workers
  void OnAssignment(std::uint32_t frame, std::uint32_t group, std::uint32_t worker);
  void AddRender(std::uint32_t frame, std::uint32_t group, Rank rank);
  void OnDone(const LaneTask& task);   // it ends
  void OnKnown(const LaneTask& task);  // its worker was told
  void Advance(std::uint32_t frame, std::uint32_t group, std::uint32_t worker);
  void FinishRoot(std::uint32_t frame, std::uint32_t group);
  void AddToFrame(std::uint32_t frame, std::uint32_t group);
  void Accumulate(std::uint32_t frame);
  void OnAccumulated(std::uint32_t frame);

  UnionCoverage::Amount AmountOf(const Group& group, const Parts& parts) const;
  double MessageBytes(const SimulatedMessage& message, const UnionCoverage::Amount& amount) const;
  void AddEncode(LaneTask task, const UnionCoverage::Amount& amount);
  void SendPixels(SimulatedMessage message, const UnionCoverage::Amount& amount, Arrival what, std::uint32_t number);

  const std::span<const FrameInput> inputs_;
  const MachineModel& machine_;
  const SimulationOptions options_;
  std::vector<WorkerId> ids_;  // ascending
  double now_ = 0;
  std::uint64_t events_posted_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  Network network_;
  Threads threads_;
  WorkerLanes lanes_;
  HandOuts hand_outs_;

  std::vector<Frame> frames_;
  std::uint32_t submitted_ = 0;  // frames that the client has asked for
  double coordinator_free_ = 0;
  double render_seconds_ = 0;
  Timeline timeline_;
};

}  // namespace slabstream
