#include "simulator/worker_lanes.h"

#include <algorithm>
#include <limits>

namespace slabstream {

WorkerLanes::WorkerLanes(const MachineModel& machine, Threads& threads)
    : machine_(machine),
      threads_(threads),
      processors_(machine.workers_a_host > 0 ? machine.cores_a_host : std::numeric_limits<double>::infinity(),
                  machine.workers_a_host > 0 ? machine.memory_slowdown : 0) {}

void WorkerLanes::Add(const LaneTask& task, double now) {
  LaneState& lane = StateOf(task.worker, task.lane);
  if (lane.taken) return lane.waiting.push_back({task.job, task.cost});
  lane.taken = true;
  lane.task = task;
  const double begin = task.cost.direct ? now : threads_.Begin(Threads::Of(task.worker, task.lane), now);
  if (begin == now) return Begin(NumberOf(task.worker, task.lane), now);
  starts_.push({begin, wake_ups_++, NumberOf(task.worker, task.lane)});
}

bool WorkerLanes::Idle(Node worker, Lane lane) const { return !lanes_[NumberOf(worker, lane)].taken; }

void WorkerLanes::EndNow(Node worker, Lane lane, std::uint32_t job, double now) {
  const LaneState& state = StateOf(worker, lane);
  if (state.running && state.task.job == job) processors_.EndNow(HostOf(worker), NumberOf(worker, lane), now);
}

void WorkerLanes::Pause(Node worker, Lane lane, std::uint32_t job, double now) {
  LaneState& state = StateOf(worker, lane);
  if (!state.running || state.task.job != job) return;
  paused_.push_back(state.task);
  paused_.back().cost.seconds = processors_.Stop(HostOf(worker), NumberOf(worker, lane), now);
  BeginNext(NumberOf(worker, lane), now);
}

void WorkerLanes::Resume(std::uint32_t job, double now) {
  const auto paused = std::ranges::find(paused_, job, &LaneTask::job);
  if (paused == paused_.end()) return;
  const LaneTask task = *paused;
  paused_.erase(paused);
  Add(task, now);
}

double WorkerLanes::NextTime() {
  const double start = starts_.empty() ? std::numeric_limits<double>::infinity() : starts_.top().time;
  return std::min(start, processors_.NextTime());
}

std::optional<LaneTask> WorkerLanes::Step() {
  if (!starts_.empty() && starts_.top().time < processors_.NextTime()) {
    const Start start = starts_.top();
    starts_.pop();
    Begin(start.lane, start.time);
    return std::nullopt;
  }
  const Processors::Completion done = processors_.Finish();
  LaneState& state = lanes_[done.task];
  const LaneTask task = state.task;
  threads_.Active(task.cost.direct ? Threads::Machine(task.worker) : Threads::Of(task.worker, task.lane), done.time);
  BeginNext(done.task, done.time);
  return task;
}

void WorkerLanes::BeginNext(std::size_t lane, double now) {
  LaneState& state = lanes_[lane];
  state.running = false;
  state.taken = !state.waiting.empty();
  if (!state.taken) return;
  state.task.job = state.waiting.front().job;  // a task in a lane's own queue needs no wake-up
  state.task.cost = state.waiting.front().cost;
  state.waiting.pop_front();
  Begin(lane, now);
}

void WorkerLanes::Begin(std::size_t lane, double now) {
  LaneTask& task = lanes_[lane].task;
  task.begin = now;
  lanes_[lane].running = true;
  processors_.Start(HostOf(task.worker), lane, task.cost.seconds, now);
}

std::uint32_t WorkerLanes::HostOf(Node worker) const { return worker / std::uint32_t(std::max(machine_.workers_a_host, 1)); }

}  // namespace slabstream
