#include "simulator/frame_simulation.h"

#include <algorithm>
#include <limits>
#include <set>

#include "common/base/check.h"
#include "common/base/overloaded.h"

namespace slabstream {
namespace {

constexpr Duration kNever = std::chrono::hours(24 * 40);  // as milliseconds it fits 32 bits
constexpr double kAlarm = 20 * 24 * 3600.0;               // seconds: an event due later than this is an alarm of a machine
constexpr Epoch kEpoch = 1;
constexpr PeerToken kClient = ~std::uint32_t{0};
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
  config.heartbeat = config.worker_timeout = config.client_timeout = config.worker_wait = kNever;
  config.vacancy_grace = config.stall_timeout = kNever;
  return config;
}

WorkerConfig MakeWorkerConfig(std::uint32_t index) {
  WorkerConfig config;
  config.incarnation = index + 1;
  config.cache_bytes = 0;  // costs alone say whether voxels are fetched; earlier frames do not matter
  config.credit_bytes = ~std::uint64_t{0} >> 1U;
  config.register_interval = config.chunk_timeout = kNever;
  config.early_image_bytes = ~std::uint64_t{0} >> 1U;
  return config;
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
  out.setup.cells = false;  // the one voxel stands for them, too
  out.setup.fields = {};    // and for their voxels
  out.setup.front = {};     // box costs know what is hidden
  out.tiles = {};
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

Stage StageOf(const Job& job) {
  return std::visit(Overloaded{[](const StartRender&) { return Stage::kRender; }, [](const SendPartial&) { return Stage::kEncode; },
                               [](const SendFrame&) { return Stage::kResolve; }, [](const auto&) { return Stage::kCombine; }},
                    job.action);
}

GroupKey KeyOf(const Job& job) {
  return std::visit(Overloaded{[](const StoreChunk&) { return GroupKey{}; }, [](const SendPartial& send) { return send.message.key; },
                               [](const SendFrame& send) {
                                 return GroupKey{send.message.frame, send.message.attempt, send.message.group_count - 1};
                               },
                               [](const auto& action) { return action.key; }},
                    job.action);
}

Rank RankOf(const Job& job) {
  return std::visit(Overloaded{[](const StartRender& render) { return render.rank; }, [](const SendPartial& send) { return send.rank; },
                               [](const auto&) { return Rank{0}; }},
                    job.action);
}

// The seconds of [begin, end] in `intervals`, which lie apart.
double CoveredSeconds(const std::vector<std::pair<double, double>>& intervals, double begin, double end) {
  double covered = 0;
  for (const auto& [from, to] : intervals) covered += std::max(std::min(to, end) - std::max(from, begin), 0.0);
  return covered;
}

}  // namespace

void FrameAccount::Add(std::uint32_t worker, Lane lane, double begin, double end) {
  if (lane == Lane::kRender) render_seconds_[worker] += end - begin;
  std::vector<std::pair<double, double>>& busy = busy_[worker];
  for (; !busy.empty() && busy.back().second >= begin; busy.pop_back()) begin = std::min(begin, busy.back().first);
  busy.emplace_back(begin, end);
}

void FrameAccount::Close(std::size_t slots, SimulatedFrame& result) const {
  double most = 0, total = 0, busy = 0;
  for (const double seconds : render_seconds_) {
    most = std::max(most, seconds);
    total += seconds;
  }
  for (const std::vector<std::pair<double, double>>& intervals : busy_) busy += CoveredSeconds(intervals, result.planned, result.done);
  const auto shares = double(std::max(slots, busy_.size()));
  if (total > 0) result.imbalance = most * shares / total;
  const double available = shares * (result.done - result.planned);
  if (available > 0) result.idle_share = std::clamp(1 - busy / available, 0.0, 1.0);
}

FrameSimulation::FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options)
    : inputs_(frames),
      machine_(machine),
      options_(options),
      ids_(WorkersOf(frames)),
      network_(machine.link, std::uint32_t(ids_.size()) + 1),  // the last end is the coordinator's
      service_(machine, *this) {
  timeline_.workers = std::uint32_t(ids_.size());
  timeline_.frames.resize(frames.size());
}

Timeline FrameSimulation::Run() {
  service_.StartCoordinator(MakeCoordinatorConfig());
  for (Node node = 0; node < ids_.size(); ++node) service_.AddWorker(MakeWorkerConfig(node));
  while (service_.next() < service_.now() + kAlarm) service_.RunNext();
  origin_ = service_.now();
  service_.threads().AllActive(origin_);
  for (int i = 0; i < options_.in_flight; ++i) Submit();
  while (received_ < inputs_.size()) {
    service_.RunNext();
    CHECK_LT(service_.now(), origin_ + kAlarm) << "a frame does not end: its schedule cannot be carried out";
  }
  timeline_.end = now();
  return std::move(timeline_);
}

// ---------------------------------------------------------------- the client

void FrameSimulation::Submit() {
  if (submitted_ == inputs_.size()) return;
  timeline_.frames[submitted_].submitted = now();
  SubmitFrame submit;
  submit.request = ++submitted_;
  submit.deadline_ms = ~std::uint32_t{0};
  submit.frame.dataset = kDataset;
  submit.frame.transfer.choice = TransferFunction{};
  const double arrival = service_.threads().Begin(Threads::kCoordinator, service_.now() + machine_.link.latency_seconds);
  service_.TellCoordinator(arrival, FromClient{kClient, std::move(submit)});
}

void FrameSimulation::Perform(ToClient& action) {
  if (const auto* failed = std::get_if<FrameFailed>(&action.message)) CHECK(false) << failed->status.message();
  const auto* reply = std::get_if<FrameReply>(&action.message);
  if (reply == nullptr) return;  // news of progress travels for free
  const auto frame = std::uint32_t(reply->request - 1);
  timeline_.frames[frame].done = now();
  // The coordinator decrypts and encrypts, unless the picture does not pass it; the client decrypts.
  const PictureWay& way = machine_.picture;
  const double bytes = inputs_[frame].picture_bytes, cipher = bytes * way.cipher_byte;
  coordinator_passed_ = std::max(coordinator_passed_, service_.coordinator_free()) + (way.direct ? 0 : 2 * cipher);
  const double there =
      way.direct ? std::max(coordinator_passed_, frames_.at(frame).picture_there) : coordinator_passed_ + bytes * way.link_byte;
  client_passed_ = std::max(client_passed_, there) + cipher;
  const double arrival = service_.threads().Begin(Threads::kClient, client_passed_ + machine_.client_seconds);
  service_.queue().At(arrival + inputs_[frame].receive_seconds, [this, frame] { OnPicture(frame); });
}

void FrameSimulation::OnPicture(std::uint32_t frame) {
  SimulatedFrame& result = timeline_.frames[frame];
  result.received = now();
  ++received_;
  service_.threads().Active(Threads::kClient, service_.now());
  frames_.at(frame).account.Close(plan(frame).slots, result);
  frames_.erase(frame);
  Submit();
}

// ---------------------------------------------------------------- the coordinator

// Every dataset is there.
void FrameSimulation::Perform(const ToDatasets& action) {
  static const auto summary = std::make_shared<const VolumeSummary>();
  if (const auto* seek = std::get_if<SeekDataset>(&action)) {
    service_.StepCoordinator(DatasetNews{.uses = {{seek->use, DatasetReady{1, summary}}}});
  }
}

void FrameSimulation::Perform(const PlanRequest& action) {
  const std::uint32_t frame = planned_++;  // one client's requests are served in order
  CHECK_LT(frame, inputs_.size()) << "a frame is planned twice";
  timeline_.frames[frame].planned = service_.coordinator_free() - origin_;
  frames_.emplace(frame, Frame{{}, FrameAccount(ids_.size())});
  auto planned = std::make_shared<PlannedFrame>(PlannedFrame{.asked = action, .plan = PlanForMachines(plan(frame), frame, ids_)});
  Threads& threads = service_.threads();
  planner_free_ = std::max(planner_free_, threads.Begin(Threads::kPlanner, service_.coordinator_free())) + machine_.plan_seconds;
  threads.Active(Threads::kPlanner, planner_free_);
  service_.TellCoordinator(threads.Begin(Threads::kCoordinator, planner_free_),
                           Planned{action.plan, std::shared_ptr<const PlannedFrame>(std::move(planned))});
}

void FrameSimulation::BeforeStep(const FrameEvent& event) {
  const auto* heard = std::get_if<FromWorker>(&event);
  const auto* done = heard == nullptr ? nullptr : std::get_if<GroupDone>(&heard->message);
  if (done == nullptr) return;
  if (--GroupOf(done->key).shares_left > 0) return;
  timeline_.frames[FrameOf(done->key)].groups_done.push_back(now() + machine_.message_seconds);
  frames_.at(FrameOf(done->key)).groups.erase(done->key.group);
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
  groups.emplace(assignment.key.group, Group{UnionCoverage(coverage, bounds.width(), bounds.height()),
                                             std::uint32_t(schedule->steps().size()), assignment.group.schedule.roots.size()});
}

// ---------------------------------------------------------------- work

auto FrameSimulation::CostOf(const Job&, const StartRender& action) const -> Cost {
  return {{inputs_[FrameOf(action.key)].boxes[action.placement.id].seconds}};
}

auto FrameSimulation::CostOf(const Job&, const StartCombine& action) -> Cost {
  const bool all = action.pixels.begin >= action.pixels.end;
  const PixelRange pixels = all ? PixelRange{0, std::uint64_t(action.frame.pixel_count())} : action.pixels;
  const CombiningCosts& costs = machine_.combining;
  const UnionCoverage::Amount amount = GroupOf(action.key).coverage.Of(action.ranks, pixels);
  if (action.other != 0) return {{costs.local_pixel * amount.filled}};
  return {{costs.combine_pixel * amount.filled + costs.cipher_byte * MessageBytes(action.key, amount)}};
}

auto FrameSimulation::CostOf(const Job&, const FindHidden& action) const -> Cost {
  return {{machine_.combining.hidden_pixel * double(FrameBounds(*action.setup).pixel_count())}};
}

double FrameSimulation::MessageBytes(const GroupKey& key, const UnionCoverage::Amount& amount) const {
  const CombiningCosts& costs = machine_.combining;
  const FramePlan& of = plan(FrameOf(key));
  const ColorCoding color = MayCode(of.setup.format, of.groups[key.group].color) ? of.groups[key.group].color : ColorCoding::kFloat32;
  const double color_share = double(BytesPerChannel(color)) / double(BytesPerChannel(ColorCoding::kFloat32));
  const double pixel_bytes = costs.rgba_bytes * color_share + (HasDepth(of.setup.format) ? costs.depth_bytes - costs.rgba_bytes : 0);
  return amount.filled * pixel_bytes + amount.runs * costs.run_bytes;
}

auto FrameSimulation::CostOf(Job& job, const SendPartial& action) -> Cost {
  const CombiningCosts& costs = machine_.combining;
  const UnionCoverage::Amount amount = GroupOf(action.message.key).coverage.Of(action.message.interval, action.message.pixels);
  job.pixels = amount.filled;
  job.bytes = MessageBytes(action.message.key, amount);
  // The thread that owns the sockets announces a lent image itself if that is quicker, as in workers.
  return {{costs.scan_pixel * amount.scanned + costs.encode_pixel * amount.filled + costs.cipher_byte * job.bytes,
           costs.lent && service_.Idle(job.node, Lane::kCombine)}};
}

auto FrameSimulation::CostOf(const Job&, const SendFrame& action) const -> Cost {
  const FrameInput& input = inputs_[frame_of_.at(action.message.frame)];
  const double cipher = input.picture_bytes * machine_.picture.cipher_byte;
  return {{(input.finish_seconds + cipher) / action.message.share_count}};
}

void FrameSimulation::OnWorked(const Job& job, const LaneTask& task) {
  const GroupKey key = KeyOf(job);
  const std::uint32_t frame = FrameOf(key);
  const Stage stage = StageOf(job);
  const double begin = task.begin - origin_;
  timeline_.frames[frame].stage_seconds[std::size_t(stage)] += now() - begin;
  frames_.at(frame).account.Add(task.worker, task.lane, begin, now());
  if (options_.keep_spans) timeline_.spans.push_back({frame, key.group, task.worker, task.lane, RankOf(job), stage, begin, now()});
}

WorkerEvent FrameSimulation::Answer(Job& job) {
  return std::visit(Overloaded{[](const StartRender& a) -> WorkerEvent {
                                 return RenderDone{
                                     .key = a.key, .rank = a.rank, .image = a.image, .status = {}, .report = {}, .box_bytes = 1};
                               },
                               [](const StoreChunk& a) -> WorkerEvent {
                                 return ChunkStored{a.padded, a.chunk.box, a.chunk.chunk, {}};
                               },
                               [](const StartCombine& a) -> WorkerEvent {
                                 return CombineDone{a.key, a.image, {}, {}};
                               },
                               [](const FindHidden& a) -> WorkerEvent {
                                 return HiddenFound{a.key, a.image, {}};
                               },
                               [](const auto&) -> WorkerEvent { return Tick{}; }},
                    job.action);
}

// ---------------------------------------------------------------- messages

Arrivals FrameSimulation::ToWorker(Node, CoordinatorToWorker& message, double sent) {
  if (const auto* assignment = std::get_if<GroupAssignment>(&message)) BeginGroup(*assignment);
  return Arrivals::At(sent + machine_.link.latency_seconds);
}

Arrivals FrameSimulation::ToCoordinator(Node, WorkerToCoordinator& message) {
  if (const auto* trouble = std::get_if<WorkerTrouble>(&message)) CHECK(false) << trouble->status.message();
  double arrival = service_.now() + machine_.link.latency_seconds;
  if (const auto* picture = std::get_if<FrameImage>(&message)) {
    const std::uint32_t frame = frame_of_.at(picture->frame);
    // Shares follow one another on the client's link.
    double& there = machine_.picture.direct ? frames_.at(frame).picture_there : arrival;
    there = std::max(there, arrival) + inputs_[frame].picture_bytes / picture->share_count * machine_.picture.link_byte;
  }
  return Arrivals::At(arrival);
}

Arrivals FrameSimulation::ToPeer(Node to, Job& sends) {
  const PartialImage& image = std::get<SendPartial>(sends.action).message;
  SimulatedMessage message{.frame = FrameOf(image.key),
                           .group = image.key.group,
                           .step = image.step,
                           .from = sends.node,
                           .to = to,
                           .pixels = sends.pixels,
                           .bytes = sends.bytes};
  if (message.step == GroupOf(image.key).steps) {
    message.kind = SimulatedMessage::Kind::kGroupImage;
    message.step = 0;
  }
  SimulatedFrame& frame = timeline_.frames[message.frame];
  frame.image_bytes += message.bytes;
  ++frame.messages;
  return Arrivals::At(Travel(message, service_.now()));
}

void FrameSimulation::Perform(Node node, SendChunkRequest& action) {
  const ChunkRequest& request = action.request;
  const std::uint32_t frame = request.dataset - 1;
  const double bytes = inputs_[frame].boxes[std::size_t(request.box.begin.z)].voxel_bytes;
  Chunk chunk{.epoch = request.epoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk, .raw_bytes = 1};
  double arrival = service_.now();  // if it holds them
  if (bytes > 0) {
    timeline_.frames[frame].voxel_bytes += bytes;
    const SimulatedMessage message{
        .kind = SimulatedMessage::Kind::kVoxels, .frame = frame, .from = Node(ids_.size()), .to = node, .bytes = bytes};
    arrival = service_.threads().Begin(Threads::Machine(node), Travel(message, service_.now() + machine_.link.latency_seconds));
  }
  service_.queue().At(arrival, [this, node, chunk] { service_.StepWorker(node, MessageReceived{chunk, {}}); });
}

double FrameSimulation::Travel(SimulatedMessage message, double sent) {
  const Network::Passage passage = network_.Send(message.from, message.to, message.bytes, sent);
  message.ready = sent - origin_;
  message.begin = passage.begin - origin_;
  message.end = passage.end - origin_;
  if (options_.keep_spans) timeline_.messages.push_back(message);
  return passage.end;
}

}  // namespace slabstream
