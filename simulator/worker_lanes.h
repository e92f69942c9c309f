// WorkerLanes: what the threads of all workers do, in virtual time. Each worker has three lanes (Timeline's Lane): one renders, one
// combines and encodes, one makes pictures. A lane does one task at a time, in the order in which the tasks came up, but for those that
// pause. All lanes of a host share its cores (Processors).
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <vector>

#include "simulator/model/machine_model.h"
#include "simulator/model/processors.h"
#include "simulator/model/timeline.h"
#include "simulator/threads.h"

namespace slabstream {

using Node = std::uint32_t;  // a worker process of a simulation: 0, 1, ... in the order in which they began

struct WorkCost {
  double seconds = 0;   // if nothing slows it down
  bool direct = false;  // the thread that owns the sockets does it itself: nothing is handed over
};

struct LaneTask {
  Lane lane = Lane::kRender;
  Node worker = 0;
  std::uint32_t job = 0;  // any number
  WorkCost cost;
  double begin = 0;  // once it has begun
};

class WorkerLanes {
 public:
  // `machine` and `threads` outlive the object.
  WorkerLanes(const MachineModel& machine, Threads& threads);
  void AddWorker() { lanes_.resize(lanes_.size() + kLanes); }

  // Queues the task, or hands it over to its lane. `now` may not go back from call to call.
  void Add(const LaneTask& task, double now);
  bool Idle(Node worker, Lane lane) const;  // and nothing waits
  // The task, if it runs in the lane, ends now.
  void EndNow(Node worker, Lane lane, std::uint32_t job, double now);
  // The task, if it runs in the lane, pauses; until Resume queues what is left of it, if it has paused.
  void Pause(Node worker, Lane lane, std::uint32_t job, double now);
  void Resume(std::uint32_t job, double now);

  // When a task begins or ends next if none is added before: infinity if none is under way.
  double NextTime();
  // Carries that out; returns the task that ends, if one does. NextTime() must be finite.
  std::optional<LaneTask> Step();

 private:
  struct Waiting {
    std::uint32_t job = 0;
    WorkCost cost;
  };
  struct LaneState {
    bool taken = false;    // by a task that was handed over and has not ended
    bool running = false;  // whether that task has begun
    LaneTask task;         // the one that has taken it
    std::deque<Waiting> waiting;
  };
  static constexpr std::size_t kLanes = 3;  // lanes of a worker, by Lane

  struct Start {
    double time = 0;
    std::uint64_t order = 0;
    std::size_t lane = 0;  // its number
    friend bool operator>(const Start& a, const Start& b) { return a.time != b.time ? a.time > b.time : a.order > b.order; }
  };

  static std::size_t NumberOf(Node worker, Lane lane) { return kLanes * worker + std::size_t(lane); }
  LaneState& StateOf(Node worker, Lane lane) { return lanes_[NumberOf(worker, lane)]; }
  std::uint32_t HostOf(Node worker) const;
  void Begin(std::size_t lane, double now);
  void BeginNext(std::size_t lane, double now);  // if anything waits

  const MachineModel& machine_;
  Threads& threads_;
  Processors processors_;
  std::priority_queue<Start, std::vector<Start>, std::greater<>> starts_;  // when tasks that were handed over start
  std::uint64_t wake_ups_ = 0;
  std::vector<LaneTask> paused_;
  std::vector<LaneState> lanes_;  // worker by worker. Their numbers are the names of what they run on processors
};

}  // namespace slabstream
