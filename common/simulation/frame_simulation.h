// FrameSimulation: the event loop behind SimulateFrames. One object runs once.
//
// Whatever happens is an event at a time: a message arrives somewhere, or a task ends. Each event is handled completely before the next; of
// events at the same time the one that was caused first goes first.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "common/simulation/network.h"
#include "common/simulation/processors.h"
#include "common/simulation/schedule_run.h"
#include "common/simulation/simulate_frames.h"
#include "common/simulation/union_coverage.h"

namespace slabstream {

class FrameSimulation {
 public:
  // All valid (SimulateFrames checks).
  FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options);

  Timeline Run();

 private:
  enum class Arrival : std::uint8_t { kRequest, kAssignment, kVoxels, kPartial, kGroupImage, kGroupDone, kPicture, kReceived };
  struct Event {
    double time = 0;
    std::uint64_t order = 0;
    Arrival what = Arrival::kRequest;
    std::uint32_t frame = 0, group = 0;
    std::uint32_t number = 0;  // worker, rank or step
    friend bool operator>(const Event& a, const Event& b) { return a.time != b.time ? a.time > b.time : a.order > b.order; }
  };
  enum class Work : std::uint8_t { kRender, kEncode, kCombine, kEncodeGroup, kAccumulate, kFinish };
  struct Task {
    Work work = Work::kRender;
    std::uint32_t frame = 0, group = 0;
    std::uint32_t worker = 0;
    Rank rank = 0;           // for whom it is done
    std::uint32_t step = 0;  // kEncode, kCombine
    double seconds = 0, threads = 1;
    double begin = 0;
  };
  using Render = std::tuple<std::uint32_t, std::uint32_t, Rank>;  // frame, group and rank
  struct Worker {
    std::set<Render> renders;    // that have their voxels
    std::array<bool, 3> busy{};  // by lane
    std::deque<Task> combines, finishes;
  };
  using Parts = ScheduleRun::Parts;
  struct Message {  // encoded, on its way
    Parts parts;
    UnionCoverage::Amount amount;
  };
  struct Group {  // between its hand-out and its being accumulated
    std::unique_ptr<UnionCoverage> coverage;
    std::unique_ptr<ScheduleRun> run;
    std::map<std::uint32_t, Message> messages;  // by step
    bool root_done = false;
    UnionCoverage::Amount image;  // of the group
    bool local = false;           // the display worker made it
  };
  struct Frame {
    std::uint32_t next_group = 0, groups_done = 0;  // the coordinator's
    std::map<std::uint32_t, Group> groups;
    std::set<std::uint32_t> complete;  // group images at the display worker, not yet accumulated
    std::uint32_t accumulated = 0;     // groups
    bool accumulating = false;
    std::vector<double> render_seconds;                        // by worker
    std::vector<std::vector<std::pair<double, double>>> busy;  // by worker
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
  void HandOut(std::uint32_t frame);

  // ---- workers
  void OnAssignment(std::uint32_t frame, std::uint32_t group, std::uint32_t worker);
  void AddRender(std::uint32_t frame, std::uint32_t group, Rank rank);
  void StartRender(std::uint32_t worker);
  double RenderSeconds(const Render& render) const;
  std::optional<std::pair<std::uint32_t, Render>> NextRender(std::uint32_t worker) const;
  void AddCombine(const Task& task);
  void StartNext(std::uint32_t worker, Lane lane, std::deque<Task>& tasks);
  static Lane LaneOf(Work work);
  void Start(Task task);
  void OnDone(const Task& task);
  void Advance(std::uint32_t frame, std::uint32_t group, Rank rank);
  void FinishRoot(std::uint32_t frame, std::uint32_t group);
  void AddToFrame(std::uint32_t frame, std::uint32_t group);
  void Accumulate(std::uint32_t frame);
  void OnAccumulated(std::uint32_t frame);

  UnionCoverage::Amount AmountOf(const Group& group, const Parts& parts) const;
  double MessageBytes(const SimulatedMessage& message, const UnionCoverage::Amount& amount) const;
  double EncodeSeconds(const UnionCoverage::Amount& amount) const;
  void SendPixels(SimulatedMessage message, const UnionCoverage::Amount& amount, Arrival what, std::uint32_t number);
  double SpeedOf(std::uint32_t worker) const;
  double Slowness(std::uint32_t frame, std::uint32_t worker) const;
  void CloseFrame(std::uint32_t frame);

  const std::span<const FrameInput> inputs_;
  const MachineModel& machine_;
  const SimulationOptions options_;
  std::vector<WorkerId> ids_;  // ascending
  double now_ = 0;
  std::uint64_t events_posted_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  Network network_;
  Processors processors_;
  std::vector<Worker> workers_;
  std::map<std::uint64_t, Task> running_;
  std::uint64_t tasks_started_ = 0;

  std::vector<Frame> frames_;
  std::uint32_t submitted_ = 0;          // frames that the client has asked for
  std::deque<std::uint32_t> waiting_;    // frames that the coordinator has not planned yet
  std::deque<std::uint32_t> in_flight_;  // oldest first
  double coordinator_free_ = 0;
  double render_seconds_ = 0;
  Timeline timeline_;
};

}  // namespace slabstream
