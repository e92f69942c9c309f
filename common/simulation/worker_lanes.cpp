#include "common/simulation/worker_lanes.h"

#include <algorithm>
#include <limits>
#include <random>

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
    case Work::kCombine:
    case Work::kEncodeGroup:
    case Work::kAccumulate: break;
  }
  return Lane::kCombine;
}

Stage StageOf(Work work) {
  switch (work) {
    case Work::kRender: return Stage::kRender;
    case Work::kFinish: return Stage::kResolve;
    case Work::kEncode:
    case Work::kEncodeGroup: return Stage::kEncode;
    case Work::kCombine:
    case Work::kAccumulate: break;
  }
  return Stage::kCombine;
}

WorkerLanes::WorkerLanes(const MachineModel& machine, std::uint32_t workers, bool steal, Threads& threads)
    : machine_(machine),
      steal_(steal),
      threads_(threads),
      processors_(Hosts(workers, machine), machine.workers_a_host > 0 ? machine.cores_a_host : std::numeric_limits<double>::infinity(),
                  machine.workers_a_host > 0 ? machine.memory_slowdown : 0),
      workers_(workers) {}

void WorkerLanes::Add(const LaneTask& task, double now) {
  Worker& worker = workers_[task.worker];
  switch (LaneOf(task.work)) {
    case Lane::kCombine: worker.combines.push_back(task); break;
    case Lane::kFinish: worker.finishes.push_back(task); break;
    case Lane::kRender: worker.renders.emplace(RenderOrder(task.frame, task.group, task.rank), task); break;
  }
  HandOver(task.worker, LaneOf(task.work), now);
  if (!steal_ || task.work != Work::kRender) return;
  for (std::uint32_t thief = 0; thief < workers_.size() && !worker.renders.empty(); ++thief) HandOver(thief, Lane::kRender, now);
}

void WorkerLanes::OnRenderKnown(std::uint32_t worker, double now) {
  workers_[worker].taken[std::size_t(Lane::kRender)] = false;
  HandOver(worker, Lane::kRender, now);
}

bool WorkerLanes::Idle(std::uint32_t index, Lane lane) const {
  const Worker& worker = workers_[index];
  if (worker.taken[std::size_t(lane)]) return false;
  switch (lane) {
    case Lane::kRender: return worker.renders.empty();
    case Lane::kCombine: return worker.combines.empty();
    case Lane::kFinish: break;
  }
  return worker.finishes.empty();
}

double WorkerLanes::NextTime() {
  const double start = starts_.empty() ? std::numeric_limits<double>::infinity() : starts_.top().time;
  return std::min(start, processors_.NextTime());
}

std::optional<LaneTask> WorkerLanes::Step() {
  if (!starts_.empty() && starts_.top().time < processors_.NextTime()) {
    const Start start = starts_.top();
    starts_.pop();
    Begin(start.task, start.time);
    return std::nullopt;
  }
  const Processors::Completion done = processors_.Finish();
  const LaneTask task = running_.extract(done.task).mapped();
  const Lane lane = LaneOf(task.work);
  threads_.Active(task.direct ? Threads::Machine(task.worker) : Threads::Of(task.worker, lane), done.time);
  if (lane == Lane::kRender) return task;
  workers_[task.worker].taken[std::size_t(lane)] = false;
  // What waits in a lane's own queue need not be handed over any more.
  if (const std::optional<LaneTask> next = TakeNext(task.worker, lane)) Begin(*next, done.time);
  return task;
}

std::optional<LaneTask> WorkerLanes::TakeNext(std::uint32_t index, Lane lane) {
  Worker& worker = workers_[index];
  if (worker.taken[std::size_t(lane)]) return std::nullopt;
  std::optional<LaneTask> next;
  if (lane == Lane::kRender) {
    next = TakeRender(index);
  } else if (std::deque<LaneTask>& tasks = lane == Lane::kCombine ? worker.combines : worker.finishes; !tasks.empty()) {
    next = tasks.front();
    tasks.pop_front();
  }
  if (next) worker.taken[std::size_t(lane)] = true;
  return next;
}

void WorkerLanes::HandOver(std::uint32_t worker, Lane lane, double now) {
  const std::optional<LaneTask> next = TakeNext(worker, lane);
  if (!next) return;
  const double begin = next->direct ? now : threads_.Begin(Threads::Of(worker, lane), now);
  if (begin == now) return Begin(*next, now);
  starts_.push({begin, hand_overs_++, *next});
}

// What a worker renders next, out of the queue that it waits in.
std::optional<LaneTask> WorkerLanes::TakeRender(std::uint32_t index) {
  const auto group_of = [](const LaneTask& task) { return std::pair(task.frame, task.group); };
  std::uint32_t owner = index;
  std::optional<RenderOrder> next;
  const auto consider = [&](std::uint32_t worker, const RenderOrder& order) {
    if (next) {
      const LaneTask &best = workers_[owner].renders.at(*next), &task = workers_[worker].renders.at(order);
      if (group_of(best) < group_of(task)) return;
      if (group_of(best) == group_of(task) && best.seconds >= task.seconds) return;
    }
    owner = worker;
    next = order;
  };
  if (steal_) {
    for (std::uint32_t worker = 0; worker < workers_.size(); ++worker) {
      for (const auto& [order, task] : workers_[worker].renders) consider(worker, order);
    }
  } else if (!workers_[index].renders.empty()) {
    next = workers_[index].renders.begin()->first;
  }
  if (!next) return std::nullopt;
  LaneTask task = workers_[owner].renders.extract(*next).mapped();
  task.worker = index;
  task.seconds *= Slowness(task.frame, index);
  return task;
}

// All threads but the first are of no help for a part of the work.
void WorkerLanes::Begin(LaneTask task, double now) {
  task.begin = now;
  const double seconds = task.seconds * (1 + (task.threads - 1) * machine_.serial_share) / task.threads / SpeedOf(task.worker);
  const std::uint32_t host = task.worker / std::uint32_t(std::max(machine_.workers_a_host, 1));
  processors_.Start(host, tasks_started_, seconds, task.threads, now);
  running_.emplace(tasks_started_++, task);
}

double WorkerLanes::SpeedOf(std::uint32_t worker) const {
  return machine_.speeds.empty() ? 1 : machine_.speeds[worker % machine_.speeds.size()];
}

// A function of seed, frame and worker, whatever else happens.
double WorkerLanes::Slowness(std::uint32_t frame, std::uint32_t worker) const {
  const Stragglers& stragglers = machine_.stragglers;
  if (stragglers.probability <= 0) return 1;
  std::seed_seq seed{std::uint32_t(stragglers.seed), std::uint32_t(stragglers.seed >> 32), frame, worker};
  std::mt19937 engine(seed);
  return double(engine()) < stragglers.probability * 0x1p32 ? stragglers.factor : 1;
}

}  // namespace slabstream
