#include "simulator/worker_lanes.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace slabstream {

WorkerLanes::WorkerLanes(const MachineModel& machine, Threads& threads)
    : machine_(machine),
      threads_(threads),
      processors_(machine.workers_a_host > 0 ? machine.cores_a_host : std::numeric_limits<double>::infinity(),
                  machine.workers_a_host > 0 ? machine.memory_slowdown : 0) {}

void WorkerLanes::Add(const LaneTask& task, double now) {
  LaneState& lane = StateOf(task.worker, task.lane);
  if (lane.taken) return lane.waiting.push_back(task);
  lane.taken = true;
  WakeUp(task, now);
}

bool WorkerLanes::Idle(Node worker, Lane lane) const { return !lanes_[NumberOf(worker, lane)].taken; }

void WorkerLanes::EndNow(Node worker, Lane lane, double now) {
  if (StateOf(worker, lane).running) processors_.EndNow(HostOf(worker), NumberOf(worker, lane), now);
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
  LaneState& state = lanes_[done.task];
  const LaneTask task = *std::exchange(state.running, std::nullopt);
  threads_.Active(task.cost.direct ? Threads::Machine(task.worker) : Threads::Of(task.worker, task.lane), done.time);
  state.taken = !state.waiting.empty();
  if (state.taken) {  // a task in a lane's own queue needs no wake-up
    const LaneTask next = state.waiting.front();
    state.waiting.pop_front();
    Begin(next, done.time);
  }
  return task;
}

void WorkerLanes::WakeUp(const LaneTask& task, double now) {
  const double begin = task.cost.direct ? now : threads_.Begin(Threads::Of(task.worker, task.lane), now);
  if (begin == now) return Begin(task, now);
  starts_.push({begin, wake_ups_++, task});
}

// Only the first thread does the serial share of the work.
void WorkerLanes::Begin(LaneTask task, double now) {
  task.begin = now;
  const auto& [seconds, threads, direct] = task.cost;
  const double each = seconds * (1 + (threads - 1) * machine_.serial_share) / threads / SpeedOf(task.worker);
  processors_.Start(HostOf(task.worker), NumberOf(task.worker, task.lane), each, threads, now);
  StateOf(task.worker, task.lane).running = task;
}

std::uint32_t WorkerLanes::HostOf(Node worker) const { return worker / std::uint32_t(std::max(machine_.workers_a_host, 1)); }

double WorkerLanes::SpeedOf(Node worker) const { return machine_.speeds.empty() ? 1 : machine_.speeds[worker % machine_.speeds.size()]; }

}  // namespace slabstream
