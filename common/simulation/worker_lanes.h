// WorkerLanes: what the threads of all workers do, in virtual time. Each worker has three lanes (Timeline's Lane): one renders, one
// combines and encodes, one makes pictures. A lane does one task at a time; those that wait are taken in the order in which they came up.
// Renderings wait with the thread that orders them, in order of frame, group and rank: the next one is handed over when that thread was
// told that the last one is done. All lanes of a host share its cores (Processors).
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "common/combining/schedule.h"
#include "common/simulation/machine_model.h"
#include "common/simulation/processors.h"
#include "common/simulation/threads.h"
#include "common/simulation/timeline.h"

namespace slabstream {

enum class Work : std::uint8_t { kRender, kEncode, kCombine, kEncodeGroup, kAccumulate, kFinish };
Lane LaneOf(Work work);
Stage StageOf(Work work);  // kRender, kEncode, kCombine or kResolve

struct LaneTask {
  Work work = Work::kRender;
  std::uint32_t frame = 0, group = 0;
  std::uint32_t worker = 0;  // that does it
  Rank rank = 0;             // for whom it is done
  std::uint32_t step = 0;    // kEncode, kCombine
  double seconds = 0;        // of one thread of a worker of speed 1
  double threads = 1;        // that do it together
  bool direct = false;       // by the thread that orders it: nothing is handed over
  double begin = 0;          // once it has begun
};

class WorkerLanes {
 public:
  // `machine` and `threads` outlive the object. `steal`: a rendering is begun by any worker that has nothing to render, of the oldest group
  // the costliest one first.
  WorkerLanes(const MachineModel& machine, std::uint32_t workers, bool steal, Threads& threads);

  // Queues the task, or hands it over to its lane. `now` may not go back from call to call.
  void Add(const LaneTask& task, double now);
  // Who orders renderings was told that the worker's last one is done.
  void OnRenderKnown(std::uint32_t worker, double now);
  bool Idle(std::uint32_t worker, Lane lane) const;  // and nothing waits

  // When a task begins or ends next if none is added before: infinity if none is under way.
  double NextTime();
  // Carries that out; the task that ends, if one does. NextTime() must be finite.
  std::optional<LaneTask> Step();

 private:
  using RenderOrder = std::tuple<std::uint32_t, std::uint32_t, Rank>;  // frame, group and rank
  struct Worker {
    std::array<bool, 3> taken{};              // by lane: by a task that was handed over and has not ended
    std::map<RenderOrder, LaneTask> renders;  // that wait
    std::deque<LaneTask> combines, finishes;
  };

  struct Start {
    double time = 0;
    std::uint64_t order = 0;
    LaneTask task;
    friend bool operator>(const Start& a, const Start& b) { return a.time != b.time ? a.time > b.time : a.order > b.order; }
  };

  std::optional<LaneTask> TakeNext(std::uint32_t worker, Lane lane);
  std::optional<LaneTask> TakeRender(std::uint32_t worker);
  void HandOver(std::uint32_t worker, Lane lane, double now);
  void Begin(LaneTask task, double now);
  double SpeedOf(std::uint32_t worker) const;
  double Slowness(std::uint32_t frame, std::uint32_t worker) const;

  const MachineModel& machine_;
  const bool steal_;
  Threads& threads_;
  Processors processors_;
  std::priority_queue<Start, std::vector<Start>, std::greater<>> starts_;  // of tasks that were handed over
  std::uint64_t hand_overs_ = 0;
  std::vector<Worker> workers_;
  std::map<std::uint64_t, LaneTask> running_;
  std::uint64_t tasks_started_ = 0;
};

}  // namespace slabstream
