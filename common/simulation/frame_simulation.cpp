#include "common/simulation/frame_simulation.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/planning/frame_occlusion.h"

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

}  // namespace

FrameSimulation::FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options)
    : inputs_(frames),
      machine_(machine),
      options_(options),
      ids_(WorkersOf(frames)),
      network_(machine.link, std::uint32_t(ids_.size()) + 1),  // the last end is the coordinator's
      threads_(machine.hand_overs, std::uint32_t(ids_.size())),
      lanes_(machine, std::uint32_t(ids_.size()), options.steal, threads_),
      hand_outs_(frames, ids_.size()),
      frames_(frames.size()) {
  timeline_.workers = std::uint32_t(ids_.size());
  timeline_.frames.resize(frames.size());
}

Timeline FrameSimulation::Run() {
  for (int i = 0; i < options_.in_flight; ++i) Submit(0);
  while (true) {
    const double task_time = lanes_.NextTime();
    const double event_time = events_.empty() ? std::numeric_limits<double>::infinity() : events_.top().time;
    if (task_time <= event_time) {
      if (task_time == std::numeric_limits<double>::infinity()) break;
      now_ = task_time;
      if (const std::optional<LaneTask> done = lanes_.Step()) OnDone(*done);
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
  events_.push({time, events_posted_++, what, frame, group, number, {}});
}

void FrameSimulation::Handle(const Event& event) {
  Frame& frame = frames_[event.frame];
  SimulatedFrame& result = timeline_.frames[event.frame];
  switch (event.what) {
    case Arrival::kRequest:
      CoordinatorTakes(now_);
      hand_outs_.OnRequest(event.frame);
      return HandOutGroups();
    case Arrival::kAssignment: return OnAssignment(event.frame, event.group, event.number);
    case Arrival::kVoxels: return AddRender(event.frame, event.group, event.number);
    case Arrival::kPartial: {
      Group& group = frame.groups.at(event.group);
      const Step& step = group.schedule->steps()[event.number];
      const std::uint32_t worker = IndexOf(plan(event.frame).groups[event.group].placements[step.to].worker);
      group.runs.at(worker).order().OnArrived(event.number, PixelCount(step.pixels));
      return Advance(event.frame, event.group, worker);
    }
    case Arrival::kGroupImage: return AddToFrame(event.frame, event.group);
    case Arrival::kGroupDone:
      CoordinatorTakes(now_);
      hand_outs_.OnGroupDone(event.frame);
      result.groups_done.push_back(coordinator_free_);
      return HandOutGroups();
    case Arrival::kPicture:
      CoordinatorTakes(now_);
      result.done = now_;
      hand_outs_.OnPicture(event.frame);
      Post(threads_.Begin(Threads::kClient, coordinator_free_ + machine_.client_seconds) + inputs_[event.frame].receive_seconds,
           Arrival::kReceived, event.frame);
      return HandOutGroups();
    case Arrival::kReceived:
      result.received = now_;
      threads_.Active(Threads::kClient, now_);
      frame.account->Close(plan(event.frame).slots, result);
      frame = {};
      return Submit(now_);
    case Arrival::kTaskKnown: return OnKnown(event.task);
  }
}

// ---------------------------------------------------------------- the client and the coordinator

void FrameSimulation::Submit(double now) {
  if (submitted_ == inputs_.size()) return;
  timeline_.frames[submitted_].submitted = now;
  Post(threads_.Begin(Threads::kCoordinator, now + machine_.link.latency_seconds), Arrival::kRequest, submitted_);
  ++submitted_;
}

void FrameSimulation::CoordinatorTakes(double now) {
  coordinator_free_ = std::max(coordinator_free_, now) + machine_.message_seconds;
  threads_.Active(Threads::kCoordinator, coordinator_free_);
}

void FrameSimulation::HandOutGroups() {
  while (true) {
    const HandOuts::Next next = hand_outs_.Take();
    switch (next.kind) {
      case HandOuts::Next::Kind::kNothing: return;
      case HandOuts::Next::Kind::kPlan:
        timeline_.frames[next.frame].planned = coordinator_free_;
        coordinator_free_ += machine_.plan_seconds;
        frames_[next.frame].account = std::make_unique<FrameAccount>(ids_.size());
        break;
      case HandOuts::Next::Kind::kGroup: HandOut(next.frame, next.group); break;
    }
  }
}

void FrameSimulation::HandOut(std::uint32_t number, std::uint32_t index) {
  Frame& frame = frames_[number];
  const GroupPlan& group_plan = plan(number).groups[index];
  const PixelBounds bounds = FrameBounds(plan(number).setup);
  Group& group = frame.groups[index];

  std::vector<const CoverageMap*> coverage;
  std::map<std::uint32_t, std::vector<Rank>> ranks = {{display(number), {}}};  // of each worker
  for (Rank rank = 0; rank < group_plan.placements.size(); ++rank) {
    const Placement& placement = group_plan.placements[rank];
    coverage.push_back(inputs_[number].boxes[placement.id].coverage);
    ranks[IndexOf(placement.worker)].push_back(rank);
  }
  group.coverage = std::make_unique<UnionCoverage>(coverage, bounds.width(), bounds.height());
  const PixelRange whole = WholeFrame(plan(number).setup);
  group.schedule = DeriveSchedule(group_plan.schedule, whole).value();
  for (auto& [worker, of_worker] : ranks) {
    group.runs.try_emplace(worker, group.schedule, whole, std::move(of_worker));
    coordinator_free_ += machine_.message_seconds;
    const double arrival = coordinator_free_ + machine_.link.latency_seconds;
    Post(threads_.Begin(Threads::Machine(worker), arrival), Arrival::kAssignment, number, index, worker);
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
    const auto coordinator = std::uint32_t(ids_.size());
    const double asked = now_ + machine_.link.latency_seconds;
    const Network::Passage passage = network_.Send(coordinator, worker, bytes, asked);
    timeline_.frames[frame].voxel_bytes += bytes;
    if (options_.keep_spans) {
      timeline_.messages.push_back(
          {SimulatedMessage::Kind::kVoxels, frame, group, 0, coordinator, worker, 0, bytes, asked, passage.begin, passage.end});
    }
    Post(threads_.Begin(Threads::Machine(worker), passage.end), Arrival::kVoxels, frame, group, rank);
  }
}

void FrameSimulation::AddRender(std::uint32_t frame, std::uint32_t group, Rank rank) {
  const Placement& placement = plan(frame).groups[group].placements[rank];
  lanes_.Add({.work = Work::kRender,
              .frame = frame,
              .group = group,
              .worker = IndexOf(placement.worker),
              .rank = rank,
              .seconds = inputs_[frame].boxes[placement.id].seconds,
              .threads = double(machine_.threads)},
             now_);
}

void FrameSimulation::OnDone(const LaneTask& task) {
  Frame& frame = frames_[task.frame];
  SimulatedFrame& result = timeline_.frames[task.frame];
  const Stage stage = StageOf(task.work);
  result.stage_seconds[std::size_t(stage)] += now_ - task.begin;
  frame.account->Add(task, now_);
  if (options_.keep_spans)
    timeline_.spans.push_back({task.frame, task.group, task.worker, LaneOf(task.work), task.rank, stage, task.begin, now_});

  if (task.work == Work::kRender) render_seconds_ += now_ - task.begin;
  if (task.direct) return OnKnown(task);  // what the thread that owns the sockets does itself it knows
  events_.push(
      {threads_.Begin(Threads::Machine(task.worker), now_), events_posted_++, Arrival::kTaskKnown, task.frame, task.group, 0, task});
}

void FrameSimulation::OnKnown(const LaneTask& task) {
  Frame& frame = frames_[task.frame];
  switch (task.work) {
    case Work::kRender: {
      lanes_.OnRenderKnown(task.worker, now_);
      const std::uint32_t owner = IndexOf(plan(task.frame).groups[task.group].placements[task.rank].worker);
      frame.groups.at(task.group).runs.at(owner).OnRendered(task.rank, {task.rank, task.rank + 1});
      Advance(task.frame, task.group, owner);
      break;
    }
    case Work::kEncode: {
      const GroupPlan& group = plan(task.frame).groups[task.group];
      const Step& step = frame.groups.at(task.group).schedule->steps()[task.step];
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
      frame.groups.at(task.group).runs.at(task.worker).order().OnCombined(task.rank);
      Advance(task.frame, task.group, task.worker);
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
    case Work::kFinish:
      Post(threads_.Begin(Threads::kCoordinator, now_ + machine_.link.latency_seconds), Arrival::kPicture, task.frame);
      break;
  }
}

// ---------------------------------------------------------------- combining

void FrameSimulation::SendPixels(SimulatedMessage message, const UnionCoverage::Amount& amount, Arrival what, std::uint32_t number) {
  message.pixels = amount.filled;
  message.bytes = MessageBytes(message, amount);
  message.ready = now_;
  const Network::Passage passage = network_.Send(message.from, message.to, message.bytes, now_);
  message.begin = passage.begin;
  message.end = passage.end;
  timeline_.frames[message.frame].image_bytes += message.bytes;
  ++timeline_.frames[message.frame].messages;
  Post(threads_.Begin(Threads::Machine(message.to), passage.end), what, message.frame, message.group, number);
  if (options_.keep_spans) timeline_.messages.push_back(message);
}

// Takes every step that the worker can take now.
void FrameSimulation::Advance(std::uint32_t frame, std::uint32_t group_index, std::uint32_t worker) {
  Group& group = frames_[frame].groups.at(group_index);
  Runner& run = group.runs.at(worker);
  const auto put = [&run](Rank rank, const Parts& parts) {  // true if something was there
    bool onto = false;
    for (const Fragment<RankInterval>& part : parts) {
      onto |= !run.held(rank).Within(part.pixels).empty();
      CHECK(run.held(rank).Combine(part, Joined)) << "the schedule is sound";
    }
    return onto;
  };
  while (std::optional<Runner::Taken> taken = run.TakeNext()) {
    const Rank to = taken->step->to;
    LaneTask task{.work = Work::kCombine, .frame = frame, .group = group_index, .worker = worker, .rank = to, .step = taken->index};
    switch (taken->kind) {
      case StepOrder::Kind::kSend: {
        const UnionCoverage::Amount amount = AmountOf(group, taken->parts);
        group.messages[taken->index] = {std::move(taken->parts), amount};
        task.work = Work::kEncode;
        task.rank = taken->step->from;
        AddEncode(task, amount);
        continue;
      }
      case StepOrder::Kind::kReceive: {
        const auto message = group.messages.extract(taken->index);  // what arrives is what was sent
        put(to, message.mapped().parts);
        task.seconds = machine_.combining.combine_pixel * message.mapped().amount.filled;
        break;
      }
      case StepOrder::Kind::kMove:
        if (!put(to, taken->parts)) continue;
        task.seconds = machine_.combining.local_pixel * AmountOf(group, taken->parts).filled;
        break;
    }
    run.order().OnCombineStarted(to);
    lanes_.Add(task, now_);
  }
  const Rank root = group.schedule->schedule().root;
  if (!group.root_done && run.order().Here(root) && run.order().Done(root)) FinishRoot(frame, group_index);
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
  AddEncode({.work = Work::kEncodeGroup, .frame = frame, .group = group_index, .worker = holder, .rank = root}, group.image);
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
  const FrameSetup& setup = plan(number).setup;
  const bool looks_for_hidden = UsesOcclusion(setup) && frame.accumulated + 1 < plan(number).groups.size();
  // The first image of this worker becomes the frame's as it is.
  const bool adds = !group.local || frame.accumulated > 0;
  if (!adds && !looks_for_hidden) return OnAccumulated(number);
  double seconds = 0;
  if (adds) seconds += (group.local ? costs.local_pixel : costs.combine_pixel) * group.image.filled;
  if (looks_for_hidden) seconds += costs.hidden_pixel * double(FrameBounds(setup).pixel_count());
  lanes_.Add({.work = Work::kAccumulate, .frame = number, .group = frame.accumulated, .worker = display(number), .seconds = seconds}, now_);
}

void FrameSimulation::OnAccumulated(std::uint32_t number) {
  Frame& frame = frames_[number];
  frame.accumulating = false;
  const std::uint32_t group = frame.accumulated++;
  frame.complete.erase(group);
  frame.groups.erase(group);
  Post(threads_.Begin(Threads::kCoordinator, now_ + machine_.link.latency_seconds), Arrival::kGroupDone, number, group);
  if (frame.accumulated < plan(number).groups.size()) return Accumulate(number);
  lanes_.Add({.work = Work::kFinish,
              .frame = number,
              .group = group,
              .worker = display(number),
              .seconds = inputs_[number].finish_seconds,
              .threads = double(std::max(machine_.threads, machine_.picture_threads))},
             now_);
}

// ---------------------------------------------------------------- quantities

UnionCoverage::Amount FrameSimulation::AmountOf(const Group& group, const Parts& parts) const {
  UnionCoverage::Amount amount;
  for (const Fragment<RankInterval>& part : parts) amount += group.coverage->Of(part.value, part.pixels);
  return amount;
}

double FrameSimulation::MessageBytes(const SimulatedMessage& message, const UnionCoverage::Amount& amount) const {
  const CombiningCosts& costs = machine_.combining;
  const bool rgba = !HasDepth(plan(message.frame).setup.format);
  const ColorCoding color = plan(message.frame).groups[message.group].color;
  const double color_share = double(BytesPerChannel(color)) / double(BytesPerChannel(ColorCoding::kFloat32));
  return amount.filled * (rgba ? costs.rgba_bytes * color_share : costs.depth_bytes) + amount.runs * costs.run_bytes;
}

// A lent image is told of by the thread that owns the sockets where that is quicker, as workers do.
void FrameSimulation::AddEncode(LaneTask task, const UnionCoverage::Amount& amount) {
  const CombiningCosts& costs = machine_.combining;
  task.seconds = costs.scan_pixel * amount.scanned + costs.encode_pixel * amount.filled;
  task.direct = costs.lent && lanes_.Idle(task.worker, Lane::kCombine);
  lanes_.Add(task, now_);
}

}  // namespace slabstream
