#include "common/simulation/frame_simulation.h"

#include <algorithm>
#include <limits>
#include <random>

#include "common/base/check.h"
#include "common/planning/frame_occlusion.h"
#include "common/planning/frame_window.h"

namespace slabstream {
namespace {

std::vector<WorkerId> WorkersOf(std::span<const FrameInput> frames) {
  std::set<WorkerId> workers;
  for (const FrameInput& frame : frames) {
    workers.insert(frame.plan->display);
    for (const GroupPlan& group : frame.plan->groups) {
      for (const Placement& placement : group.placements) workers.insert(placement.worker);
    }
  }
  return {workers.begin(), workers.end()};
}

std::uint32_t Hosts(std::size_t workers, const MachineModel& machine) {
  const auto each = std::size_t(std::max(machine.workers_a_host, 1));
  return std::uint32_t((workers + each - 1) / each);
}

// Of the parts of [begin, end) that the intervals cover.
double CoveredSeconds(std::vector<std::pair<double, double>> intervals, double begin, double end) {
  std::sort(intervals.begin(), intervals.end());
  double covered = 0, reached = begin;
  for (const auto& [from, to] : intervals) {
    const double first = std::max(from, reached), last = std::min(to, end);
    if (last <= first) continue;
    covered += last - first;
    reached = last;
  }
  return covered;
}

}  // namespace

FrameSimulation::FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options)
    : inputs_(frames),
      machine_(machine),
      options_(options),
      ids_(WorkersOf(frames)),
      network_(machine.link, std::uint32_t(ids_.size()) + 1),  // the last end is the coordinator's
      processors_(Hosts(ids_.size(), machine), machine.workers_a_host > 0 ? machine.cores_a_host : std::numeric_limits<double>::infinity(),
                  machine.workers_a_host > 0 ? machine.memory_slowdown : 0),
      workers_(ids_.size()),
      frames_(frames.size()) {
  timeline_.workers = std::uint32_t(ids_.size());
  timeline_.frames.resize(frames.size());
}

Timeline FrameSimulation::Run() {
  for (int i = 0; i < options_.in_flight; ++i) Submit(0);
  while (true) {
    const double task_time = processors_.NextTime();
    const double event_time = events_.empty() ? std::numeric_limits<double>::infinity() : events_.top().time;
    if (task_time <= event_time) {
      if (task_time == std::numeric_limits<double>::infinity()) break;
      const Processors::Completion done = processors_.Finish();
      now_ = done.time;
      const auto running = running_.find(done.task);
      const Task task = running->second;
      running_.erase(running);
      OnDone(task);
    } else {
      const Event event = events_.top();
      events_.pop();
      now_ = event.time;
      Handle(event);
    }
  }
  for (const SimulatedFrame& frame : timeline_.frames) {
    CHECK_GT(frame.received, 0) << "a frame did not end: its schedule cannot be carried out";
    timeline_.end = std::max(timeline_.end, frame.received);
  }
  if (timeline_.end > 0) timeline_.render_share = render_seconds_ / (timeline_.end * double(timeline_.workers));
  return std::move(timeline_);
}

std::uint32_t FrameSimulation::IndexOf(WorkerId worker) const {
  return std::uint32_t(std::lower_bound(ids_.begin(), ids_.end(), worker) - ids_.begin());
}

void FrameSimulation::Post(double time, Arrival what, std::uint32_t frame, std::uint32_t group, std::uint32_t number) {
  events_.push({time, events_posted_++, what, frame, group, number});
}

void FrameSimulation::Handle(const Event& event) {
  Frame& frame = frames_[event.frame];
  SimulatedFrame& result = timeline_.frames[event.frame];
  switch (event.what) {
    case Arrival::kRequest:
      CoordinatorTakes(now_);
      waiting_.push_back(event.frame);
      return HandOutGroups();
    case Arrival::kAssignment: return OnAssignment(event.frame, event.group, event.number);
    case Arrival::kVoxels: return AddRender(event.frame, event.group, event.number);
    case Arrival::kPartial: {
      Group& group = frame.groups.at(event.group);
      const Rank to = plan(event.frame).groups[event.group].schedule.steps[event.number].to;
      group.run->OnArrived(event.number, group.messages.at(event.number).parts);
      return Advance(event.frame, event.group, to);
    }
    case Arrival::kGroupImage: return AddToFrame(event.frame, event.group);
    case Arrival::kGroupDone:
      CoordinatorTakes(now_);
      ++frame.groups_done;
      result.groups_done.push_back(coordinator_free_);
      return HandOutGroups();
    case Arrival::kPicture:
      CoordinatorTakes(now_);
      result.done = now_;
      in_flight_.erase(std::find(in_flight_.begin(), in_flight_.end(), event.frame));
      Post(coordinator_free_ + machine_.client_seconds + inputs_[event.frame].receive_seconds, Arrival::kReceived, event.frame);
      return HandOutGroups();
    case Arrival::kReceived:
      result.received = now_;
      CloseFrame(event.frame);
      return Submit(now_);
  }
}

// ---------------------------------------------------------------- the client and the coordinator

void FrameSimulation::Submit(double now) {
  if (submitted_ == inputs_.size()) return;
  timeline_.frames[submitted_].submitted = now;
  Post(now + machine_.link.latency_seconds, Arrival::kRequest, submitted_);
  ++submitted_;
}

void FrameSimulation::CoordinatorTakes(double now) { coordinator_free_ = std::max(coordinator_free_, now) + machine_.message_seconds; }

void FrameSimulation::HandOutGroups() {
  while (true) {
    std::uint32_t unfinished = 0, teams = 1;
    std::int64_t frame_bytes = 0;
    const auto open_groups = [&](std::uint32_t frame) { return frames_[frame].next_group - frames_[frame].groups_done; };
    for (const std::uint32_t frame : in_flight_) {
      unfinished += open_groups(frame);
      frame_bytes = std::max(frame_bytes, FrameBytes(plan(frame).setup));
      teams = std::max(teams, plan(frame).turn.teams);
    }
    const FrameWindow window = WindowFor(workers_.size(), teams, frame_bytes);
    if (unfinished >= std::uint32_t(window.groups)) return;
    const auto open = std::find_if(in_flight_.begin(), in_flight_.end(), [&](std::uint32_t frame) {
      const bool masked = UsesOcclusion(plan(frame).setup);
      return frames_[frame].next_group < plan(frame).groups.size() && (!masked || open_groups(frame) < std::uint32_t(kMaskedGroups));
    });
    if (open != in_flight_.end()) {
      HandOut(*open);
      continue;
    }
    if (waiting_.empty() || in_flight_.size() >= std::size_t(window.frames)) return;
    const std::uint32_t frame = waiting_.front();
    waiting_.pop_front();
    in_flight_.push_back(frame);
    timeline_.frames[frame].planned = coordinator_free_;
    coordinator_free_ += machine_.plan_seconds;
    frames_[frame].render_seconds.resize(workers_.size());
    frames_[frame].busy.resize(workers_.size());
  }
}

void FrameSimulation::HandOut(std::uint32_t number) {
  Frame& frame = frames_[number];
  const std::uint32_t index = frame.next_group++;
  const GroupPlan& group_plan = plan(number).groups[index];
  const PixelBounds bounds = FrameBounds(plan(number).setup);
  Group& group = frame.groups[index];

  std::vector<const CoverageMap*> coverage;
  std::vector<std::uint32_t> workers = {display(number)};
  for (const Placement& placement : group_plan.placements) {
    coverage.push_back(inputs_[number].boxes[placement.id].coverage);
    workers.push_back(IndexOf(placement.worker));
  }
  group.coverage = std::make_unique<UnionCoverage>(coverage, bounds.width(), bounds.height());
  group.run = std::make_unique<ScheduleRun>(group_plan, WholeFrame(plan(number).setup));
  std::sort(workers.begin(), workers.end());
  workers.erase(std::unique(workers.begin(), workers.end()), workers.end());
  for (const std::uint32_t worker : workers) {
    coordinator_free_ += machine_.message_seconds;
    Post(coordinator_free_ + machine_.link.latency_seconds, Arrival::kAssignment, number, index, worker);
  }
}

// ---------------------------------------------------------------- rendering

void FrameSimulation::OnAssignment(std::uint32_t frame, std::uint32_t group, std::uint32_t worker) {
  const std::vector<Placement>& placements = plan(frame).groups[group].placements;
  if (placements.empty()) return AddToFrame(frame, group);  // only the display worker is told
  for (Rank rank = 0; rank < placements.size(); ++rank) {
    if (IndexOf(placements[rank].worker) != worker) continue;
    const double bytes = inputs_[frame].boxes[placements[rank].id].voxel_bytes;
    if (bytes == 0) {
      AddRender(frame, group, rank);
      continue;
    }
    const auto coordinator = std::uint32_t(workers_.size());
    const double asked = now_ + machine_.link.latency_seconds;
    const Network::Passage passage = network_.Send(coordinator, worker, bytes, asked);
    timeline_.frames[frame].voxel_bytes += bytes;
    if (options_.keep_spans) {
      timeline_.messages.push_back(
          {SimulatedMessage::Kind::kVoxels, frame, group, 0, coordinator, worker, 0, bytes, asked, passage.begin, passage.end});
    }
    Post(passage.end, Arrival::kVoxels, frame, group, rank);
  }
}

void FrameSimulation::AddRender(std::uint32_t frame, std::uint32_t group, Rank rank) {
  const std::uint32_t worker = IndexOf(plan(frame).groups[group].placements[rank].worker);
  workers_[worker].renders.insert({frame, group, rank});
  StartRender(worker);
  if (!options_.steal) return;
  for (std::uint32_t thief = 0; thief < workers_.size() && !workers_[worker].renders.empty(); ++thief) StartRender(thief);
}

double FrameSimulation::RenderSeconds(const Render& render) const {
  const auto& [frame, group, rank] = render;
  return inputs_[frame].boxes[plan(frame).groups[group].placements[rank].id].seconds;
}

// What a worker renders next, and in whose queue that waits.
std::optional<std::pair<std::uint32_t, FrameSimulation::Render>> FrameSimulation::NextRender(std::uint32_t worker) const {
  std::optional<std::pair<std::uint32_t, Render>> next;
  const auto consider = [&](std::uint32_t owner, const Render& render) {
    const auto group_of = [](const Render& r) { return std::pair(std::get<0>(r), std::get<1>(r)); };
    if (next && group_of(next->second) < group_of(render)) return;
    if (next && group_of(next->second) == group_of(render) && RenderSeconds(next->second) >= RenderSeconds(render)) return;
    next = {owner, render};
  };
  if (!options_.steal) {
    const std::set<Render>& own = workers_[worker].renders;
    if (!own.empty()) next = {worker, *own.begin()};
    return next;
  }
  for (std::uint32_t owner = 0; owner < workers_.size(); ++owner) {
    for (const Render& render : workers_[owner].renders) consider(owner, render);
  }
  return next;
}

void FrameSimulation::StartRender(std::uint32_t index) {
  Worker& worker = workers_[index];
  if (worker.busy[std::size_t(Lane::kRender)]) return;
  const auto next = NextRender(index);
  if (!next) return;
  const auto& [owner, render] = *next;
  const auto [frame, group, rank] = render;
  const double seconds = RenderSeconds(render);
  workers_[owner].renders.erase(render);
  Start({.work = Work::kRender,
         .frame = frame,
         .group = group,
         .worker = index,
         .rank = rank,
         .seconds = seconds * Slowness(frame, index),
         .threads = double(machine_.threads)});
}

// ---------------------------------------------------------------- combining

Lane FrameSimulation::LaneOf(Work work) {
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

void FrameSimulation::AddCombine(const Task& task) {
  workers_[task.worker].combines.push_back(task);
  StartNext(task.worker, Lane::kCombine, workers_[task.worker].combines);
}

void FrameSimulation::StartNext(std::uint32_t worker, Lane lane, std::deque<Task>& tasks) {
  if (workers_[worker].busy[std::size_t(lane)] || tasks.empty()) return;
  const Task task = tasks.front();
  tasks.pop_front();
  Start(task);
}

// All threads but the first are of no help for a part of the work.
void FrameSimulation::Start(Task task) {
  task.begin = now_;
  workers_[task.worker].busy[std::size_t(LaneOf(task.work))] = true;
  const double seconds = task.seconds * (1 + (task.threads - 1) * machine_.serial_share) / task.threads / SpeedOf(task.worker);
  const std::uint32_t host = task.worker / std::uint32_t(std::max(machine_.workers_a_host, 1));
  processors_.Start(host, tasks_started_, seconds, task.threads, now_);
  running_.emplace(tasks_started_++, task);
}

void FrameSimulation::OnDone(const Task& task) {
  Frame& frame = frames_[task.frame];
  SimulatedFrame& result = timeline_.frames[task.frame];
  Worker& worker = workers_[task.worker];
  const Lane lane = LaneOf(task.work);
  const Stage stage = task.work == Work::kRender                                      ? Stage::kRender
                      : task.work == Work::kFinish                                    ? Stage::kResolve
                      : task.work == Work::kEncode || task.work == Work::kEncodeGroup ? Stage::kEncode
                                                                                      : Stage::kCombine;
  worker.busy[std::size_t(lane)] = false;
  result.stage_seconds[std::size_t(stage)] += now_ - task.begin;
  frame.busy[task.worker].emplace_back(task.begin, now_);
  if (options_.keep_spans) timeline_.spans.push_back({task.frame, task.group, task.worker, lane, task.rank, stage, task.begin, now_});

  switch (task.work) {
    case Work::kRender:
      frame.render_seconds[task.worker] += now_ - task.begin;
      render_seconds_ += now_ - task.begin;
      frame.groups.at(task.group).run->OnRendered(task.rank);
      Advance(task.frame, task.group, task.rank);
      break;
    case Work::kEncode: {
      const GroupPlan& group = plan(task.frame).groups[task.group];
      const Step& step = group.schedule.steps[task.step];
      SendPixels({.kind = SimulatedMessage::Kind::kPartial,
                  .frame = task.frame,
                  .group = task.group,
                  .step = task.step,
                  .from = task.worker,
                  .to = IndexOf(group.placements[step.to].worker)},
                 frame.groups.at(task.group).messages.at(task.step).amount, Arrival::kPartial, task.step);
      break;
    }
    case Work::kCombine:
      frame.groups.at(task.group).run->OnCombined(task.rank);
      Advance(task.frame, task.group, task.rank);
      break;
    case Work::kEncodeGroup:
      SendPixels({.kind = SimulatedMessage::Kind::kGroupImage,
                  .frame = task.frame,
                  .group = task.group,
                  .from = task.worker,
                  .to = display(task.frame)},
                 frame.groups.at(task.group).image, Arrival::kGroupImage, 0);
      break;
    case Work::kAccumulate: OnAccumulated(task.frame); break;
    case Work::kFinish: Post(now_ + machine_.link.latency_seconds, Arrival::kPicture, task.frame); break;
  }
  StartRender(task.worker);
  StartNext(task.worker, Lane::kCombine, worker.combines);
  StartNext(task.worker, Lane::kFinish, worker.finishes);
}

void FrameSimulation::SendPixels(SimulatedMessage message, const UnionCoverage::Amount& amount, Arrival what, std::uint32_t number) {
  message.pixels = amount.filled;
  message.bytes = MessageBytes(message, amount);
  message.ready = now_;
  const Network::Passage passage = network_.Send(message.from, message.to, message.bytes, now_);
  message.begin = passage.begin;
  message.end = passage.end;
  timeline_.frames[message.frame].image_bytes += message.bytes;
  ++timeline_.frames[message.frame].messages;
  Post(passage.end, what, message.frame, message.group, number);
  if (options_.keep_spans) timeline_.messages.push_back(message);
}

// Takes every step that can be taken at the rank now, and at ranks of the same worker that this concerns.
void FrameSimulation::Advance(std::uint32_t frame, std::uint32_t group_index, Rank first) {
  const GroupPlan& group_plan = plan(frame).groups[group_index];
  Group& group = frames_[frame].groups.at(group_index);
  std::vector<Rank> ranks = {first};
  while (!ranks.empty()) {
    const Rank rank = ranks.back();
    ScheduleRun::Taken taken = group.run->TakeNext(rank);
    if (taken.kind == ScheduleRun::Kind::kNone) {
      ranks.pop_back();
      continue;
    }
    const Step& step = group_plan.schedule.steps[taken.step];
    // What arrives is what was sent.
    const UnionCoverage::Amount amount =
        taken.kind == ScheduleRun::Kind::kReceive ? group.messages.at(taken.step).amount : AmountOf(group, taken.parts);
    Task task{
        .frame = frame, .group = group_index, .worker = IndexOf(group_plan.placements[rank].worker), .rank = rank, .step = taken.step};
    switch (taken.kind) {
      case ScheduleRun::Kind::kNone: break;
      case ScheduleRun::Kind::kSend:
        group.messages[taken.step] = {std::move(taken.parts), amount};
        task.work = Work::kEncode;
        task.seconds = EncodeSeconds(amount);
        AddCombine(task);
        break;
      case ScheduleRun::Kind::kReceive:
        group.messages.erase(taken.step);
        group.run->Combining(rank);
        task.work = Work::kCombine;
        task.seconds = machine_.combining.task + machine_.combining.combine_pixel * amount.filled;
        AddCombine(task);
        break;
      case ScheduleRun::Kind::kMove: {
        const Rank other = rank == step.from ? step.to : step.from;
        if (taken.onto) {
          group.run->Combining(step.to);
          task.work = Work::kCombine;
          task.rank = step.to;
          task.seconds = machine_.combining.task + machine_.combining.local_pixel * amount.filled;
          AddCombine(task);
        }
        ranks.push_back(other);
        break;
      }
    }
  }
  if (group.run->RootDone() && !group.root_done) FinishRoot(frame, group_index);
}

void FrameSimulation::FinishRoot(std::uint32_t frame, std::uint32_t group_index) {
  const GroupPlan& group_plan = plan(frame).groups[group_index];
  Group& group = frames_[frame].groups.at(group_index);
  group.root_done = true;
  group.image = group.coverage->Of({0, group_plan.schedule.ranks}, WholeFrame(plan(frame).setup));
  const Rank root = group_plan.schedule.root;
  const std::uint32_t holder = IndexOf(group_plan.placements[root].worker);
  group.local = holder == display(frame);
  if (group.local) return AddToFrame(frame, group_index);
  AddCombine({.work = Work::kEncodeGroup,
              .frame = frame,
              .group = group_index,
              .worker = holder,
              .rank = root,
              .seconds = EncodeSeconds(group.image)});
}

// ---------------------------------------------------------------- the display worker

void FrameSimulation::AddToFrame(std::uint32_t frame, std::uint32_t group) {
  frames_[frame].complete.insert(group);
  Accumulate(frame);
}

void FrameSimulation::Accumulate(std::uint32_t number) {
  Frame& frame = frames_[number];
  if (frame.accumulating || frame.complete.count(frame.accumulated) == 0) return;
  frame.accumulating = true;
  const Group& group = frame.groups.at(frame.accumulated);
  const CombiningCosts& costs = machine_.combining;
  double seconds = 0;
  if (!group.local) seconds += costs.task + costs.combine_pixel * group.image.filled;
  // The first image of this worker becomes the frame's as it is.
  if (group.local && frame.accumulated > 0) seconds += costs.task + costs.local_pixel * group.image.filled;
  const FrameSetup& setup = plan(number).setup;
  if (UsesOcclusion(setup) && frame.accumulated + 1 < plan(number).groups.size()) {
    seconds += costs.task + costs.hidden_pixel * double(FrameBounds(setup).pixel_count());
  }
  if (seconds == 0) return OnAccumulated(number);
  AddCombine({.work = Work::kAccumulate, .frame = number, .group = frame.accumulated, .worker = display(number), .seconds = seconds});
}

void FrameSimulation::OnAccumulated(std::uint32_t number) {
  Frame& frame = frames_[number];
  frame.accumulating = false;
  const std::uint32_t group = frame.accumulated++;
  frame.complete.erase(group);
  frame.groups.erase(group);
  Post(now_ + machine_.link.latency_seconds, Arrival::kGroupDone, number, group);
  if (frame.accumulated < plan(number).groups.size()) return Accumulate(number);
  Worker& worker = workers_[display(number)];
  worker.finishes.push_back({.work = Work::kFinish,
                             .frame = number,
                             .group = group,
                             .worker = display(number),
                             .seconds = inputs_[number].finish_seconds,
                             .threads = double(std::max(machine_.threads, machine_.picture_threads))});
  StartNext(display(number), Lane::kFinish, worker.finishes);
}

// ---------------------------------------------------------------- quantities

UnionCoverage::Amount FrameSimulation::AmountOf(const Group& group, const Parts& parts) const {
  UnionCoverage::Amount amount;
  for (const auto& [begin, part] : parts) amount += group.coverage->Of(part.value, {begin, part.end});
  return amount;
}

double FrameSimulation::MessageBytes(const SimulatedMessage& message, const UnionCoverage::Amount& amount) const {
  const CombiningCosts& costs = machine_.combining;
  const bool rgba = FormatOf(plan(message.frame).setup.renderer) == PixelFormat::kRgba;
  const ColorCoding color = plan(message.frame).groups[message.group].color;
  const double color_share = double(BytesPerChannel(color)) / double(BytesPerChannel(ColorCoding::kFloat32));
  return amount.filled * (rgba ? costs.rgba_bytes * color_share : costs.depth_bytes) + amount.runs * costs.run_bytes;
}

double FrameSimulation::EncodeSeconds(const UnionCoverage::Amount& amount) const {
  const CombiningCosts& costs = machine_.combining;
  return costs.task + costs.scan_pixel * amount.scanned + costs.encode_pixel * amount.filled;
}

double FrameSimulation::SpeedOf(std::uint32_t worker) const {
  return machine_.speeds.empty() ? 1 : machine_.speeds[worker % machine_.speeds.size()];
}

// A function of seed, frame and worker, whatever else happens.
double FrameSimulation::Slowness(std::uint32_t frame, std::uint32_t worker) const {
  const Stragglers& stragglers = machine_.stragglers;
  if (stragglers.probability <= 0) return 1;
  std::seed_seq seed{std::uint32_t(stragglers.seed), std::uint32_t(stragglers.seed >> 32), frame, worker};
  std::mt19937 engine(seed);
  return double(engine()) < stragglers.probability * 0x1p32 ? stragglers.factor : 1;
}

void FrameSimulation::CloseFrame(std::uint32_t number) {
  Frame& frame = frames_[number];
  SimulatedFrame& result = timeline_.frames[number];
  const double slots = std::max<double>(plan(number).slots, double(workers_.size()));
  double most = 0, total = 0, busy = 0;
  for (const double seconds : frame.render_seconds) {
    most = std::max(most, seconds);
    total += seconds;
  }
  for (std::vector<std::pair<double, double>>& intervals : frame.busy) {
    busy += CoveredSeconds(std::move(intervals), result.planned, result.done);
  }
  if (total > 0) result.imbalance = most * slots / total;
  const double available = slots * (result.done - result.planned);
  if (available > 0) result.idle_share = std::clamp(1 - busy / available, 0.0, 1.0);
  frame = {};
}

}  // namespace slabstream
