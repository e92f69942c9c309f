#include "simulator/worker_lanes.h"

#include <algorithm>
#include <limits>
#include <random>
#include <utility>

namespace slabstream {
namespace {

std::uint32_t Hosts(std::uint32_t workers, const MachineModel& machine) {
  const auto each = std::uint32_t(std::max(machine.workers_a_host, 1));
  return (workers + each - 1) / each;
}

}  // namespace

Lane LaneOf(Work work) {
  switch (work) {
    case Work::kRender: return Lane::kRender;
    case Work::kFinish: return Lane::kFinish;
    case Work::kEncode:
    case Work::kCombine: break;
  }
  return Lane::kCombine;
}

Stage StageOf(Work work) {
  switch (work) {
    case Work::kRender: return Stage::kRender;
    case Work::kFinish: return Stage::kResolve;
    case Work::kEncode: return Stage::kEncode;
    case Work::kCombine: break;
  }
  return Stage::kCombine;
}

WorkerLanes::WorkerLanes(const MachineModel& machine, std::uint32_t workers, Threads& threads)
    : machine_(machine),
      threads_(threads),
      processors_(Hosts(workers, machine), machine.workers_a_host > 0 ? machine.cores_a_host : std::numeric_limits<double>::infinity(),
                  machine.workers_a_host > 0 ? machine.memory_slowdown : 0),
      workers_(workers) {}

void WorkerLanes::Add(LaneTask task, double now) {
  if (task.work == Work::kRender) task.seconds *= Slowness(task.frame, task.worker);
  LaneState& lane = workers_[task.worker][std::size_t(LaneOf(task.work))];
  if (lane.taken) return lane.waiting.push_back(std::move(task));
  lane.taken = true;
  WakeUp(std::move(task), now);
}

bool WorkerLanes::Idle(std::uint32_t worker, Lane lane) const { return !workers_[worker][std::size_t(lane)].taken; }

double WorkerLanes::NextTime() {
  const double start = starts_.empty() ? std::numeric_limits<double>::infinity() : starts_.top().time;
  return std::min(start, processors_.NextTime());
}

std::optional<LaneTask> WorkerLanes::Step() {
  if (!starts_.empty() && starts_.top().time < processors_.NextTime()) {
    Start start = std::move(const_cast<Start&>(starts_.top()));  // it is popped at once
    starts_.pop();
    Begin(std::move(start.task), start.time);
    return std::nullopt;
  }
  const Processors::Completion done = processors_.Finish();
  LaneTask task = std::move(running_.extract(done.task).mapped());
  const Lane lane = LaneOf(task.work);
  threads_.Active(task.direct ? Threads::Machine(task.worker) : Threads::Of(task.worker, lane), done.time);
  LaneState& state = workers_[task.worker][std::size_t(lane)];
  state.taken = !state.waiting.empty();
  if (state.taken) {  // a task in a lane's own queue needs no wake-up
    LaneTask next = std::move(state.waiting.front());
    state.waiting.pop_front();
    Begin(std::move(next), done.time);
  }
  return task;
}

void WorkerLanes::WakeUp(LaneTask task, double now) {
  const double begin = task.direct ? now : threads_.Begin(Threads::Of(task.worker, LaneOf(task.work)), now);
  if (begin == now) return Begin(std::move(task), now);
  starts_.push({begin, wake_ups_++, std::move(task)});
}

// Only the first thread does the serial share of the work.
void WorkerLanes::Begin(LaneTask task, double now) {
  task.begin = now;
  const double seconds = task.seconds * (1 + (task.threads - 1) * machine_.serial_share) / task.threads / SpeedOf(task.worker);
  const std::uint32_t host = task.worker / std::uint32_t(std::max(machine_.workers_a_host, 1));
  processors_.Start(host, tasks_started_, seconds, task.threads, now);
  running_.emplace(tasks_started_++, std::move(task));
}

double WorkerLanes::SpeedOf(std::uint32_t worker) const {
  return machine_.speeds.empty() ? 1 : machine_.speeds[worker % machine_.speeds.size()];
}

// Depends on seed, frame and worker alone.
double WorkerLanes::Slowness(std::uint32_t frame, std::uint32_t worker) const {
  const Stragglers& stragglers = machine_.stragglers;
  if (stragglers.probability <= 0) return 1;
  std::seed_seq seed{std::uint32_t(stragglers.seed), std::uint32_t(stragglers.seed >> 32), frame, worker};
  std::mt19937 engine(seed);
  return double(engine()) < stragglers.probability * 0x1p32 ? stragglers.factor : 1;
}

}  // namespace slabstream
