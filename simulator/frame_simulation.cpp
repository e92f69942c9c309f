#include "simulator/frame_simulation.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr Duration kNever = std::chrono::hours(24 * 40);  // as milliseconds it fits 32 bits
constexpr Epoch kEpoch = 1;
constexpr PeerToken kClient = ~PeerToken{0};
constexpr char kDataset[] = "simulated";

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

CoordinatorConfig MakeCoordinatorConfig() {
  CoordinatorConfig config;
  config.epoch = kEpoch;
  config.datasets = {kDataset};
  config.heartbeat = config.worker_timeout = config.client_timeout = config.worker_wait = kNever;
  config.vacancy_grace = config.stall_timeout = kNever;
  return config;
}

WorkerMachine MakeWorker(std::uint32_t index) {
  WorkerConfig config;
  config.incarnation = index + 1;
  config.images_endpoint = std::to_string(index);
  config.cache_bytes = 0;  // costs alone say whether voxels are fetched, whatever earlier frames had
  config.credit_bytes = ~std::uint64_t{0} >> 1U;
  config.register_interval = config.chunk_timeout = kNever;
  config.early_image_bytes = ~std::uint64_t{0} >> 1U;
  return WorkerMachine(std::move(config));
}

// The plan as the machines get it: workers by index, and for each box one voxel of its own in a volume without a halo. The dataset says
// which frame it is.
FramePlan PlanForMachines(const FramePlan& plan, std::uint32_t frame, const std::vector<WorkerId>& ids) {
  FramePlan out = plan;
  const auto rename = [&](WorkerId& worker) { worker = WorkerId(std::ranges::lower_bound(ids, worker) - ids.begin()) + 1; };
  rename(out.display);
  out.setup.dataset = frame + 1;
  out.setup.halo = 0;
  out.setup.description = {};
  out.setup.description.geometry.size = {1, 1, std::numeric_limits<std::int32_t>::max()};
  for (GroupPlan& group : out.groups) {
    for (Placement& placement : group.placements) {
      rename(placement.worker);
      const auto z = std::int32_t(placement.id);
      placement.box = {{0, 0, z}, {1, 1, z + 1}};
    }
  }
  return out;
}

// The number of filled pixels, in place of a message's pixels.
Bytes Note(double filled) {
  std::vector<std::byte> note(sizeof(filled));
  std::memcpy(note.data(), &filled, sizeof(filled));
  return Bytes(std::move(note));
}

double FilledOf(const Bytes& note) {
  double filled = 0;
  if (!note.empty()) std::memcpy(&filled, note.span().data(), sizeof(filled));
  return filled;
}

}  // namespace

FrameSimulation::FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options)
    : inputs_(frames),
      machine_(machine),
      options_(options),
      ids_(WorkersOf(frames)),
      network_(machine.link, std::uint32_t(ids_.size()) + 1),  // the last end is the coordinator's
      threads_(machine.wake_ups, std::uint32_t(ids_.size())),
      lanes_(machine, std::uint32_t(ids_.size()), threads_),
      coordinator_(MakeCoordinatorConfig()) {
  for (Index worker = 0; worker < ids_.size(); ++worker) workers_.push_back(MakeWorker(worker));
  timeline_.workers = std::uint32_t(ids_.size());
  timeline_.frames.resize(frames.size());
}

Timeline FrameSimulation::Run() {
  Register();
  for (int i = 0; i < options_.in_flight; ++i) Submit();
  while (true) {
    const double task_time = lanes_.NextTime();
    const double event_time = queue_.empty() ? std::numeric_limits<double>::infinity() : queue_.next();
    if (task_time > event_time) {
      queue_.RunNext();
    } else if (task_time == std::numeric_limits<double>::infinity()) {
      break;
    } else {
      queue_.AdvanceTo(task_time);
      if (std::optional<LaneTask> done = lanes_.Step()) OnDone(*done);
    }
  }
  for (const SimulatedFrame& frame : timeline_.frames) {
    CHECK_GT(frame.received, 0) << "a frame did not end: its schedule cannot be carried out";
    timeline_.end = std::max(timeline_.end, frame.received);
  }
  if (timeline_.end > 0) timeline_.render_share = render_seconds_ / (timeline_.end * double(timeline_.workers));
  return std::move(timeline_);
}

Time FrameSimulation::MachineTime() const { return Time(std::chrono::seconds(1000)) + Duration(std::llround(now() * 1e9)); }

// ---------------------------------------------------------------- the client

void FrameSimulation::Submit() {
  if (submitted_ == inputs_.size()) return;
  timeline_.frames[submitted_].submitted = now();
  SubmitFrame submit;
  submit.request = ++submitted_;
  submit.deadline_ms = ~std::uint32_t{0};
  submit.frame.dataset = kDataset;
  submit.frame.transfer.choice = TransferFunction{};
  queue_.At(threads_.Begin(Threads::kCoordinator, now() + machine_.link.latency_seconds), [this, submit] {
    Tell(FromClient{kClient, submit});
  });
}

void FrameSimulation::OnPicture(std::uint32_t frame) {
  SimulatedFrame& result = timeline_.frames[frame];
  result.received = now();
  threads_.Active(Threads::kClient, now());
  frames_.at(frame).account.Close(plan(frame).slots, result);
  frames_.erase(frame);
  Submit();
}

// ---------------------------------------------------------------- the coordinator

// Before time begins, at no cost.
void FrameSimulation::Register() {
  for (Index worker = 0; worker < ids_.size(); ++worker) StepWorker(worker, Tick{});
  registering_ = false;
}

void FrameSimulation::Tell(const CoordinatorEvent& event) {
  coordinator_free_ = std::max(coordinator_free_, now()) + machine_.message_seconds;
  StepCoordinator(event);
  threads_.Active(Threads::kCoordinator, coordinator_free_);
}

void FrameSimulation::StepCoordinator(const CoordinatorEvent& event) {
  const auto step = [this](const CoordinatorEvent& e) {
    for (CoordinatorAction& action : coordinator_.Step(e, MachineTime())) {
      std::visit([this](auto& a) { Perform(a); }, action);
    }
  };
  step(event);
  while (!coordinator_events_.empty()) {
    const CoordinatorEvent next = std::move(coordinator_events_.front());
    coordinator_events_.pop_front();
    step(next);
  }
}

double FrameSimulation::CoordinatorSends() {
  coordinator_free_ += machine_.message_seconds;
  return coordinator_free_ + machine_.link.latency_seconds;
}

void FrameSimulation::Perform(ToWorker& action) {
  const auto worker = Index(action.to);
  if (registering_) {
    worker_events_.emplace_back(worker, MessageReceived{std::move(action.message), {}});
    return;
  }
  const double arrival = CoordinatorSends();
  const auto* assignment = std::get_if<GroupAssignment>(&action.message);
  if (assignment != nullptr) BeginGroup(*assignment);
  // Pings do not change any time.
  queue_.At(assignment != nullptr ? threads_.Begin(Threads::Machine(worker), arrival) : arrival,
            [this, worker, message = std::move(action.message)]() mutable {
              StepWorker(worker, MessageReceived{std::move(message), {}});
            });
}

void FrameSimulation::Perform(const ToClient& action) {
  if (const auto* failed = std::get_if<FrameFailed>(&action.message)) CHECK(false) << failed->status.message();
  const auto* reply = std::get_if<FrameReply>(&action.message);
  if (reply == nullptr) return;  // news of progress travels for free
  const auto frame = std::uint32_t(reply->request - 1);
  timeline_.frames[frame].done = now();
  queue_.At(threads_.Begin(Threads::kClient, coordinator_free_ + machine_.client_seconds) + inputs_[frame].receive_seconds,
            [this, frame] { OnPicture(frame); });
}

void FrameSimulation::Perform(const LoadDataset& action) {
  coordinator_events_.push_back(DatasetLoaded{action.name, action.dataset, std::make_shared<const VolumeSummary>()});
}

void FrameSimulation::Perform(const PlanRequest& action) {
  const std::uint32_t frame = planned_++;  // one client's requests are served in order
  CHECK_LT(frame, inputs_.size()) << "a frame is planned twice";
  timeline_.frames[frame].planned = coordinator_free_;
  frames_.emplace(frame, Frame{{}, FrameAccount(ids_.size())});
  auto planned = std::make_shared<PlannedFrame>(PlannedFrame{.asked = action,
                                                             .policy = ResolvePolicy(action.frame, {}).value(),
                                                             .prediction = {},
                                                             .plan = PlanForMachines(plan(frame), frame, ids_)});
  planner_free_ = std::max(planner_free_, threads_.Begin(Threads::kPlanner, coordinator_free_)) + machine_.plan_seconds;
  threads_.Active(Threads::kPlanner, planner_free_);
  queue_.At(threads_.Begin(Threads::kCoordinator, planner_free_), [this, id = action.plan, planned] {
    coordinator_free_ = std::max(coordinator_free_, now());
    StepCoordinator(Planned{id, std::shared_ptr<const PlannedFrame>(planned)});
    threads_.Active(Threads::kCoordinator, coordinator_free_);
  });
}

// The first assignment of a group begins it.
void FrameSimulation::BeginGroup(const GroupAssignment& assignment) {
  const std::uint32_t number = assignment.setup.dataset - 1;
  frame_of_[assignment.key.frame] = number;
  std::map<std::uint32_t, Group>& groups = frames_.at(number).groups;
  if (groups.contains(assignment.key.group)) return;
  std::vector<const CoverageMap*> coverage;
  for (const Placement& placement : assignment.group.placements) coverage.push_back(inputs_[number].boxes[placement.id].coverage);
  const PixelBounds bounds = FrameBounds(assignment.setup);
  const SharedSchedule schedule = DeriveSchedule(assignment.group.schedule, WholeFrame(assignment.setup)).value();
  groups.emplace(assignment.key.group,
                 Group{UnionCoverage(coverage, bounds.width(), bounds.height()), std::uint32_t(schedule->steps().size())});
}

// ---------------------------------------------------------------- workers

void FrameSimulation::StepWorker(Index first, const WorkerEvent& event) {
  const auto step = [this](Index worker, const WorkerEvent& e) {
    for (WorkerAction& action : workers_[worker].Step(e, MachineTime())) {
      std::visit([&](auto& a) { Perform(worker, a); }, action);
    }
  };
  step(first, event);
  while (!worker_events_.empty()) {
    const auto [worker, next] = std::move(worker_events_.front());
    worker_events_.pop_front();
    step(worker, next);
  }
}

void FrameSimulation::Perform(Index worker, SendControl& action) {
  if (const auto* trouble = std::get_if<WorkerTrouble>(&action.message)) CHECK(false) << trouble->status.message();
  if (registering_) return StepCoordinator(FromWorker{worker, std::move(action.message), {}});
  queue_.At(threads_.Begin(Threads::kCoordinator, now() + machine_.link.latency_seconds),
            [this, worker, message = std::move(action.message)] {
              const auto* done = std::get_if<GroupDone>(&message);
              const GroupKey key = done != nullptr ? done->key : GroupKey{};
              Tell(FromWorker{worker, message, {}});
              if (done == nullptr) return;
              const std::uint32_t frame = frame_of_.at(key.frame);
              timeline_.frames[frame].groups_done.push_back(now() + machine_.message_seconds);
              frames_.at(frame).groups.erase(key.group);
            });
}

void FrameSimulation::Perform(Index worker, SendChunkRequest& action) {
  const ChunkRequest& request = action.request;
  const std::uint32_t frame = request.dataset - 1;
  const double bytes = inputs_[frame].boxes[std::size_t(request.box.begin.z)].voxel_bytes;
  Chunk chunk{.epoch = request.epoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk, .raw_bytes = 1};
  if (bytes == 0) {  // it holds them: no time passes
    worker_events_.emplace_back(worker, MessageReceived{chunk, {}});
    return;
  }
  timeline_.frames[frame].voxel_bytes += bytes;
  SimulatedMessage message{
      .kind = SimulatedMessage::Kind::kVoxels, .frame = frame, .from = Index(ids_.size()), .to = worker, .bytes = bytes};
  queue_.At(Travel(message, now() + machine_.link.latency_seconds), [this, worker, chunk] {
    StepWorker(worker, MessageReceived{chunk, {}});
  });
}

void FrameSimulation::Perform(Index worker, StoreChunk& action) {
  worker_events_.emplace_back(worker, ChunkStored{action.slab, action.chunk.box, action.chunk.chunk, {}});
}

LaneTask FrameSimulation::MakeTask(Work work, Index worker, const GroupKey& key) const {
  LaneTask task;
  task.work = work;
  task.frame = frame_of_.at(key.frame);
  task.group = key.group;
  task.worker = worker;
  return task;
}

void FrameSimulation::Perform(Index worker, StartRender& action) {
  LaneTask task = MakeTask(Work::kRender, worker, action.key);
  task.rank = action.rank;
  task.seconds = inputs_[task.frame].boxes[action.placement.id].seconds;
  task.threads = double(machine_.threads);
  task.then = [this, worker, key = action.key, rank = action.rank, image = action.image] {
    StepWorker(worker, RenderDone{.key = key, .rank = rank, .image = image, .status = {}, .report = {}, .slab_bytes = 1});
  };
  AddTask(std::move(task));
}

void FrameSimulation::Perform(Index worker, StartCombine& action) {
  LaneTask task = MakeTask(Work::kCombine, worker, action.key);
  if (action.other == 0) {
    task.seconds = machine_.combining.combine_pixel * FilledOf(action.incoming.payload);
  } else {
    const PixelRange pixels =
        action.pixels.begin < action.pixels.end ? action.pixels : PixelRange{0, std::uint64_t(action.frame.pixel_count())};
    task.seconds = machine_.combining.local_pixel * GroupOf(action.key).coverage.Of(action.ranks, pixels).filled;
  }
  task.then = [this, worker, key = action.key, image = action.image] { StepWorker(worker, CombineDone{key, image, {}, {}}); };
  AddTask(std::move(task));
}

void FrameSimulation::Perform(Index worker, FindHidden& action) {
  LaneTask task = MakeTask(Work::kCombine, worker, action.key);
  task.seconds = machine_.combining.hidden_pixel * double(FrameBounds(*action.setup).pixel_count());
  task.then = [this, worker, key = action.key, image = action.image] { StepWorker(worker, HiddenFound{key, image, {}}); };
  AddTask(std::move(task));
}

void FrameSimulation::Perform(Index worker, SendPartial& action) {
  LaneTask task = MakeTask(Work::kEncode, worker, action.message.key);
  task.rank = action.rank;
  const Group& group = GroupOf(action.message.key);
  const UnionCoverage::Amount amount = group.coverage.Of(action.message.interval, action.message.pixels);
  const CombiningCosts& costs = machine_.combining;
  task.seconds = costs.scan_pixel * amount.scanned + costs.encode_pixel * amount.filled;
  // The thread that owns the sockets announces a lent image itself if that is quicker, as in workers.
  task.direct = costs.lent && lanes_.Idle(worker, Lane::kCombine);
  if (unused_parcels_.empty()) unused_parcels_.push_back(&parcels_.emplace_back());
  Parcel* parcel = unused_parcels_.back();
  unused_parcels_.pop_back();
  SimulatedMessage message{
      .frame = task.frame, .group = task.group, .step = action.message.step, .from = worker, .to = action.to.worker - 1};
  if (message.step == group.steps) {
    message.kind = SimulatedMessage::Kind::kGroupImage;
    message.step = 0;
  }
  *parcel = {message, amount, action.color, std::move(action.message)};
  task.then = [this, parcel] { Transfer(parcel); };
  AddTask(std::move(task));
}

void FrameSimulation::Perform(Index worker, SendFrame& action) {
  const std::uint32_t frame = frame_of_.at(action.message.frame);
  LaneTask task = MakeTask(Work::kFinish, worker, {action.message.frame, 0, action.message.group_count - 1});
  task.seconds = inputs_[frame].finish_seconds;
  task.threads = double(std::max(machine_.threads, machine_.picture_threads));
  task.then = [this, worker, message = std::move(action.message)] {
    queue_.At(threads_.Begin(Threads::kCoordinator, now() + machine_.link.latency_seconds), [this, worker, message] {
      Tell(FromWorker{worker, message, {}});
    });
  };
  AddTask(std::move(task));
}

void FrameSimulation::OnDone(LaneTask& task) {
  SimulatedFrame& result = timeline_.frames[task.frame];
  const Stage stage = StageOf(task.work);
  result.stage_seconds[std::size_t(stage)] += now() - task.begin;
  frames_.at(task.frame).account.Add(task, now());
  if (options_.keep_spans)
    timeline_.spans.push_back({task.frame, task.group, task.worker, LaneOf(task.work), task.rank, stage, task.begin, now()});
  if (task.work == Work::kRender) render_seconds_ += now() - task.begin;
  if (task.direct) return task.then();  // the thread that owns the sockets did it itself
  queue_.At(threads_.Begin(Threads::Machine(task.worker), now()), std::move(task.then));
}

// ---------------------------------------------------------------- messages with pixels or voxels

void FrameSimulation::Transfer(Parcel* parcel) {
  const CombiningCosts& costs = machine_.combining;
  SimulatedMessage& message = parcel->message;
  const UnionCoverage::Amount& amount = parcel->amount;
  const PixelFormat format = plan(message.frame).setup.format;
  const ColorCoding color = format == PixelFormat::kRgba ? parcel->color : ColorCoding::kFloat32;  // others are never coded
  const double color_share = double(BytesPerChannel(color)) / double(BytesPerChannel(ColorCoding::kFloat32));
  message.pixels = amount.filled;
  message.bytes = amount.filled * (HasDepth(format) ? costs.depth_bytes : costs.rgba_bytes * color_share) + amount.runs * costs.run_bytes;
  timeline_.frames[message.frame].image_bytes += message.bytes;
  ++timeline_.frames[message.frame].messages;
  queue_.At(Travel(message, now()), [this, parcel] {
    unused_parcels_.push_back(parcel);
    StepWorker(parcel->message.to, MessageReceived{std::move(parcel->image), Note(parcel->amount.filled)});
  });
}

double FrameSimulation::Travel(SimulatedMessage& message, double sent) {
  const Network::Passage passage = network_.Send(message.from, message.to, message.bytes, sent);
  message.ready = sent;
  message.begin = passage.begin;
  message.end = passage.end;
  if (options_.keep_spans) timeline_.messages.push_back(message);
  return threads_.Begin(Threads::Machine(message.to), passage.end);
}

}  // namespace slabstream
