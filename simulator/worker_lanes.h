// WorkerLanes: what the threads of all workers do, in virtual time. Each worker has three lanes (Timeline's Lane): one renders, one
// combines and encodes, one makes pictures. A lane does one task at a time, in the order in which the tasks came up. All lanes of a host
// share its cores (Processors).
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <unordered_map>
#include <vector>

#include "common/combining/schedule.h"
#include "common/simulation/machine_model.h"
#include "common/simulation/processors.h"
#include "common/simulation/timeline.h"
#include "simulator/threads.h"

namespace slabstream {

enum class Work : std::uint8_t { kRender, kEncode, kCombine, kFinish };
Lane LaneOf(Work work);
Stage StageOf(Work work);  // kRender, kEncode, kCombine or kResolve

struct LaneTask {
  Work work = Work::kRender;
  std::uint32_t frame = 0, group = 0;
  std::uint32_t worker = 0;    // the worker that does it
  Rank rank = 0;               // the rank that it is done for
  double seconds = 0;          // of one thread of a worker of speed 1
  double threads = 1;          // threads that do it together
  bool direct = false;         // done by the thread that orders it: nothing is handed over
  double begin = 0;            // once it has begun
  std::function<void()> then;  // called when the thread that ordered it knows that it is done
};

class WorkerLanes {
 public:
  // `machine` and `threads` outlive the object.
  WorkerLanes(const MachineModel& machine, std::uint32_t workers, Threads& threads);

  // Queues the task, or hands it over to its lane. `now` may not go back from call to call.
  void Add(LaneTask task, double now);
  bool Idle(std::uint32_t worker, Lane lane) const;  // and nothing waits

  // When a task begins or ends next if none is added before: infinity if none is under way.
  double NextTime();
  // Carries that out; returns the task that ends, if one does. NextTime() must be finite.
  std::optional<LaneTask> Step();

 private:
  struct LaneState {
    bool taken = false;  // by a task that was handed over and has not ended
    std::deque<LaneTask> waiting;
  };
  using Worker = std::array<LaneState, 3>;  // by Lane

  struct Start {
    double time = 0;
    std::uint64_t order = 0;
    LaneTask task;
    friend bool operator>(const Start& a, const Start& b) { return a.time != b.time ? a.time > b.time : a.order > b.order; }
  };

  void WakeUp(LaneTask task, double now);
  void Begin(LaneTask task, double now);
  double SpeedOf(std::uint32_t worker) const;
  double Slowness(std::uint32_t frame, std::uint32_t worker) const;

  const MachineModel& machine_;
  Threads& threads_;
  Processors processors_;
  std::priority_queue<Start, std::vector<Start>, std::greater<>> starts_;  // of tasks that were handed over
  std::uint64_t wake_ups_ = 0;
  std::vector<Worker> workers_;
  std::unordered_map<std::uint64_t, LaneTask> running_;
  std::uint64_t tasks_started_ = 0;
};

}  // namespace slabstream
