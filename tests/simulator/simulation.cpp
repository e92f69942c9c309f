#include "tests/simulator/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/frame_window.h"
#include "common/planning/policy_names.h"
#include "tests/simulator/model_occlusion.h"
#include "tests/support/random_combining.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Index3 kVolumeSize{256, 256, 128};  // 8 MiB: a slab has 1 to 8 chunks
constexpr std::uint32_t kDeadlineMs = 60000;
constexpr Duration kBound = milliseconds(kDeadlineMs) + seconds(30);  // until every request has ended, from the last one on
constexpr Duration kTroubled = seconds(5);                            // requests are made and things break in this time
constexpr Duration kSettle = seconds(14);                             // long enough for every time-out of the machines below

// Ends of links, and names of connections: workers 0, 1, ...; clients from kClientNodes on.
constexpr int kClientNodes = 1 << 20;
constexpr int kCoordinatorEnd = -1, kSlabServerEnd = -2;

// Values up to 50 show nothing.
TransferFunction StepTransfer() {
  TransferFunction transfer;
  transfer.colors = {{0, {0, 0, 0}}, {255, {1, 1, 1}}};
  transfer.opacities = {{0, 0}, {50, 0}, {51, 0.5}, {255, 1}};
  return transfer;
}

// Whether a plane between two boxes has `near` on the eye's side, or no ray through it.
bool MayComeFirst(const Camera& camera, const Box& near, const Box& far) {
  return std::any_of(kAxes.begin(), kAxes.end(), [&](Axis axis) {
    const bool lower_first =
        camera.projection == Projection::kOrthographic ? camera.view_direction[axis] >= 0 : camera.eye[axis] <= far.begin[axis] - 0.5;
    const bool upper_first =
        camera.projection == Projection::kOrthographic ? camera.view_direction[axis] <= 0 : camera.eye[axis] >= far.end[axis] - 0.5;
    return (near.end[axis] <= far.begin[axis] && lower_first) || (near.begin[axis] >= far.end[axis] && upper_first);
  });
}

// Whether `seen`, a pixel of the tile, is `expected` without some boxes that lie behind an opaque one or may be left out everywhere.
bool LacksHiddenBoxesOnly(const SymbolicPixel& seen, const SymbolicPixel& expected, const std::set<BoxId>& left_out, std::int32_t tile_x,
                          std::int32_t tile_y) {
  auto at = seen.begin();
  bool hidden = false;
  for (const BoxId box : expected) {
    const bool here = at != seen.end() && *at == box;
    if (here) ++at;
    if (!here && !hidden && left_out.count(box) == 0) return false;
    hidden = hidden || (here && IsOpaque(box, tile_x, tile_y));
  }
  return at == seen.end();
}

// What the other end would decode.
AnyMessage OverTheWire(const AnyMessage& message) {
  Result<AnyMessage> decoded = Decode(Encode(message));
  EXPECT_TRUE(decoded.ok()) << NameOf(message) << ": " << decoded.status().message();
  return decoded.ok() ? *decoded : message;
}

}  // namespace

Simulation::Simulation(std::uint64_t seed, Tally& tally)
    : random_(seed),
      tally_(tally),
      faults_(RandomFaults(random_)),
      network_(queue_, random_, faults_, std::chrono::microseconds(random_.Integer(50, 5000))),
      encode_messages_(random_.Chance(0.02)) {
  MakeVolume();
  speed_.render = milliseconds(random_.Chance(0.1) ? 300 : random_.Integer(1, 40));
  speed_.combine = std::chrono::microseconds(random_.Integer(10, 5000));
  speed_.store = std::chrono::microseconds(random_.Integer(10, 1000));
  speed_.finish = std::chrono::microseconds(random_.Integer(10, 20000));
  worker_config_.register_interval = milliseconds(500);
  worker_config_.chunk_timeout = seconds(1);
  worker_config_.chunk_attempts = 6;
  worker_config_.credit_bytes = std::uint64_t{kChunkBytes} * random_.Integer<std::uint64_t>(1, 4);
  if (!faults_.none() && random_.Chance(0.3)) worker_config_.cache_bytes = std::uint64_t{4} << 20;
  policy_.groups = random_.Integer(1, 6);
  policy_.axis = AxisChoice(random_.Integer(0, 3));
  const auto one_of = [this](const auto& entries) {
    return std::string(entries[random_.Integer<std::size_t>(0, entries.size() - 1)].name);
  };
  if (random_.Chance(0.7)) {
    policy_.decomposition = one_of(Decompositions());
    policy_.split = one_of(WorkSplits());
    policy_.assignment = one_of(Assignments());
    policy_.balance = one_of(BalanceModes());
  }
  policy_.combine = RandomCombining(random_);
  if (random_.Chance(0.1)) policy_.decomposition = policy_.assignment = policy_.combine = kAutomatic;
  if (random_.Chance(0.3)) policy_.teams = random_.Integer(2, 4);
}

Simulation::~Simulation() = default;

// ---------------------------------------------------------------- the world

// Whole layers of bricks across x are empty, so that some slabs show nothing.
void Simulation::MakeVolume() {
  auto summary = std::make_shared<VolumeSummary>();
  summary->description.geometry.size = kVolumeSize;
  summary->range = {0, 255};
  summary->brick_counts = {kVolumeSize.x / kSummaryBrick, kVolumeSize.y / kSummaryBrick, kVolumeSize.z / kSummaryBrick};
  const double empty = random_.Chance(0.05) ? 1 : random_.Real(0, 0.8);
  std::vector<ValueRange> layers;
  for (int x = 0; x < summary->brick_counts.x; ++x) layers.push_back(random_.Chance(empty) ? ValueRange{0, 10} : ValueRange{0, 200});
  for (int i = 0; i < summary->brick_counts.y * summary->brick_counts.z; ++i) {
    summary->bricks.insert(summary->bricks.end(), layers.begin(), layers.end());
  }
  occupied_ = std::make_shared<const OccupancyGrid>(BrickVisibility(*summary, StepTransfer()).VisibleCells());
  summary_ = std::move(summary);
}

SubmitFrame Simulation::RandomRequest(RequestId id) {
  SubmitFrame submit;
  submit.request = id;
  submit.deadline_ms = kDeadlineMs;
  submit.frame.dataset = "volume";
  submit.frame.size = {random_.Integer(1, 3), random_.Integer(1, 2)};
  submit.frame.view.zoom = random_.Chance(0.2) ? 400 : 4000;  // few pixels, but not minified: no supersampling
  submit.frame.view.azimuth_degrees = random_.Integer(0, 7) * 45 + 10;
  submit.frame.view.elevation_degrees = random_.Integer(-80, 80);
  submit.frame.view.projection = random_.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
  submit.frame.transfer.choice = StepTransfer();
  if (random_.Chance(0.1)) submit.frame.renderer = RendererKind::kZBuffer;
  if (random_.Chance(0.1)) submit.frame.termination = 0;
  submit.frame.policy = policy_;
  submit.frame.previews = random_.Chance(0.3);
  return submit;
}

void Simulation::AddWorker(Duration after) {
  queue_.After(after, [this] {
    const int node = int(workers_.size());
    WorkerNetwork& network = *this;
    WorkerConfig config = worker_config_;
    config.incarnation = random_.Integer<Incarnation>(1, std::uint64_t{1} << 62);
    config.images_endpoint = "worker:" + std::to_string(node);
    workers_.push_back(std::make_unique<ModelWorker>(node, config, speed_, faults_, random_, queue_, network));
    workers_.back()->Start();
  });
}

void Simulation::KillWorker() {
  std::vector<int> alive;
  for (int node = 0; node < int(workers_.size()); ++node) {
    if (workers_[node]->alive()) alive.push_back(node);
  }
  if (alive.empty()) return;
  const int victim = alive[random_.Integer<std::size_t>(0, alive.size() - 1)];
  workers_[victim]->Kill();
  ++tally_.workers_killed;
  if (!random_.Chance(faults_.silent_kill)) told_dead_.insert(victim);
  if (alive.size() == 1) workerless_ = true;
  if (random_.Chance(faults_.restart)) AddWorker(milliseconds(random_.Integer(1, 4000)));
}

void Simulation::StartCoordinator() {
  CoordinatorConfig config;
  config.epoch = random_.Integer<Epoch>(1, std::uint64_t{1} << 62);
  config.datasets = {"volume"};
  config.slabs_endpoint = "slabs";
  config.worker_timeout = seconds(3);
  config.worker_wait = seconds(5);
  config.vacancy_grace = milliseconds(random_.Integer(500, 8000));
  config.stall_timeout = seconds(4);
  const std::uint64_t generation = coordinator_ == nullptr ? 1 : coordinator_->generation + 1;
  if (coordinator_ != nullptr) dead_coordinators_.push_back(std::move(coordinator_));
  const Epoch epoch = config.epoch;
  coordinator_ = std::unique_ptr<Coordinator>(new Coordinator{FrameMachine(std::move(config)), epoch, {}, generation, true, 0});
  frames_.clear();
  fetched_.clear();
  StepCoordinator(CoordinatorTick{});
}

void Simulation::RestartCoordinator() {
  if (!coordinator_->alive) return;
  coordinator_->alive = false;
  ++tally_.coordinator_restarts;
  queue_.After(milliseconds(random_.Integer(1, 6000)), [this] { StartCoordinator(); });
}

// Everything that happens beside messages, somewhere in `span` from now on.
void Simulation::PlanTroubles(Duration span) {
  const auto somewhere = [&](std::function<void()> what) {
    queue_.After(Duration(random_.Integer<std::int64_t>(0, span.count())), std::move(what));
  };
  for (int i = 0; i < faults_.worker_kills; ++i) somewhere([this] { KillWorker(); });
  for (int i = 0; i < faults_.workers_joining; ++i) somewhere([this] { AddWorker({}); });
  for (int i = 0; i < faults_.coordinator_restarts; ++i) somewhere([this] { RestartCoordinator(); });
  for (const auto& client : clients_) {
    if (random_.Chance(faults_.vanish)) somewhere([c = client.get()] { c->Vanish(); });
  }
}

bool Simulation::Idle() const {
  return requests_made_ == requests_planned_ &&
         std::all_of(clients_.begin(), clients_.end(), [](const auto& client) { return client->idle(); });
}

void Simulation::RunUntil(Time bound, bool until_idle) {
  while (!queue_.empty() && queue_.next() <= bound && !testing::Test::HasFatalFailure()) {
    queue_.RunNext();
    if (until_idle && Idle()) return;
  }
}

void Simulation::Run() {
  ++tally_.worlds;
  StartCoordinator();
  const int workers = random_.Integer(1, 8);
  for (int i = 0; i < workers; ++i) AddWorker(faults_.none() ? Duration{} : Duration(milliseconds(random_.Integer(0, 500))));
  const int clients = random_.Integer(1, 3);
  for (int i = 0; i < clients; ++i) {
    clients_.push_back(std::make_unique<ModelClient>(queue_, [this, i](AnyMessage message) { FromClientNode(i, std::move(message)); }));
  }
  // Without faults nobody asks before all workers are there: slots, and so slabs, then stay as they are.
  const Duration first = faults_.none() ? Duration(milliseconds(500)) : Duration{};
  for (const auto& client : clients_) {
    const int requests = random_.Integer(1, 4);
    for (int r = 1; r <= requests; ++r) {
      ++requests_planned_;
      const Duration when = first + Duration(random_.Integer<std::int64_t>(0, Duration(kTroubled).count() / 2));
      queue_.After(when, [this, c = client.get(), r] {
        ++requests_made_;
        c->Submit(RandomRequest(RequestId(r)));
        if (random_.Chance(faults_.cancel)) {
          queue_.After(milliseconds(random_.Integer(0, 1000)), [c, r] { c->Cancel(RequestId(r)); });
        }
      });
    }
  }
  PlanTroubles(kTroubled);
  tally_.requests += requests_planned_;

  RunUntil(queue_.now() + kTroubled + kBound, true);
  CheckOutcome();
  network_.CalmDown();
  RunUntil(queue_.now() + kTroubled + kSettle, false);
  CheckRest();
}

// ---------------------------------------------------------------- what must hold

void Simulation::CheckOutcome() {
  EXPECT_TRUE(Idle()) << "a request has not ended in time";
  for (const auto& client : clients_) {
    for (const auto& [request, ended] : client->ended()) {
      if (ended.status.ok()) {
        ++tally_.pictures;
        if (ended.statistics.attempts > 1) ++tally_.retried;
        if (faults_.none()) {
          EXPECT_EQ(ended.statistics.attempts, 1U);
        }
        continue;
      }
      ++tally_.errors;
      const bool excused = !faults_.harmless() || workerless_ || client->cancelled().count(request) > 0;
      EXPECT_TRUE(excused) << "a frame failed although there was a worker all the time: " << ended.status.message();
      EXPECT_FALSE(ended.status.message().empty());
      const StatusCode code = ended.status.code();
      EXPECT_TRUE(code != StatusCode::kInternal && code != StatusCode::kInvalidArgument && code != StatusCode::kOk)
          << ended.status.message();
      if (code == StatusCode::kCancelled) {
        ++tally_.cancelled;
        EXPECT_EQ(client->cancelled().count(request), 1U) << "cancelled, but not by the client";
      }
    }
  }
}

// After a while without work and faults, nothing is left of any frame; then the service goes down.
void Simulation::CheckRest() {
  ASSERT_TRUE(coordinator_->alive);
  for (const auto& worker : workers_) {
    if (!worker->alive() || worker->stopped()) continue;
    EXPECT_EQ(worker->images(), 0U) << worker->config().images_endpoint;
    EXPECT_TRUE(worker->machine().registered()) << worker->config().images_endpoint;
  }
  const PeerToken monitor = TokenOf(kClientNodes + int(clients_.size()));
  StepCoordinator(FromClient{monitor, StatusQuery{1}});
  ASSERT_TRUE(status_.has_value());
  EXPECT_EQ(status_->queued, 0U);
  EXPECT_EQ(status_->running, 0U);
  StepCoordinator(FromClient{monitor, ShutDown{2}});
  EXPECT_FALSE(coordinator_->alive);
  RunUntil(queue_.now() + seconds(1), false);
  for (const auto& worker : workers_) EXPECT_TRUE(!worker->alive() || worker->stopped()) << worker->config().images_endpoint;
}

void Simulation::Observe(const GroupAssignment& assignment) {
  SeenFrame& frame = frames_[assignment.key.frame];
  if (assignment.key.attempt > frame.attempt) {
    frame.attempt = assignment.key.attempt;
    frame.handed_out.clear();
  }
  ASSERT_EQ(assignment.setup.camera.supersample, 1);
  frame.group_count = assignment.group_count;
  frame.setup = assignment.setup;
  frame.handed_out.insert(assignment.key.group);
  frame.display = assignment.display;
  std::vector<BoxId> boxes;
  for (const Placement& placement : assignment.group.placements) {
    boxes.push_back(placement.id);
    frame.boxes[placement.id] = placement.box;
    Box& last = last_boxes_.try_emplace(placement.id, placement.box).first->second;
    if (faults_.none() && last != placement.box) ++tally_.moved_boxes;
    last = placement.box;
    if (HidesBox(assignment.hidden, placement.box, assignment.setup)) {
      frame.left_out.insert(placement.id);
      ++tally_.hidden_boxes;
      continue;
    }
    const std::pair<WorkerId, Box> slab{placement.worker, SlabBox(placement.box, assignment.setup)};
    frame.slabs.insert(slab);
    if (fetched_.count(slab) == 0) frame.all_cached = false;
  }
  const auto [known, added] = frame.groups.emplace(assignment.key.group, boxes);
  EXPECT_EQ(known->second, boxes) << "another attempt has other boxes";
  if (!assignment.hidden.empty()) CheckHidden(assignment, frame);

  std::size_t unfinished = 0;
  for (const auto& [id, other] : frames_) unfinished += other.over ? 0 : other.unfinished();
  // While frames wait for their next attempt, the groups of the last one, which may have had the window to itself, are still out but no
  // longer counted.
  const FrameWindow window = WindowFor(workers_.size(), std::uint32_t(policy_.teams), FrameBytes(assignment.setup));
  EXPECT_LE(unfinished, std::size_t(faults_.none() ? window.groups : window.groups * window.frames));
  if (faults_.none() && UsesOcclusion(assignment.setup)) {
    EXPECT_LE(frame.unfinished(), std::size_t(kMaskedGroups));
  }
}

void Simulation::CheckHidden(const GroupAssignment& assignment, const SeenFrame& frame) {
  ++tally_.masks;
  if (assignment.key.attempt > 1) ++tally_.masks_of_retries;
  const Status fits = CheckFits(assignment.hidden, assignment.setup);
  EXPECT_TRUE(fits.ok()) << fits.message();
  const auto done = frame.done.find(assignment.display);
  const std::uint32_t in_front = std::min(assignment.key.group, done == frame.done.end() ? 0 : done->second);
  std::vector<BoxId> boxes;
  for (std::uint32_t group = 0; group < in_front; ++group) {
    const std::vector<BoxId>& more = frame.groups.at(group);
    boxes.insert(boxes.end(), more.begin(), more.end());
  }
  ForEachTile(assignment.hidden, [&](std::int32_t x, std::int32_t y, bool hidden) {
    EXPECT_TRUE(!hidden || AnyOpaque(boxes, x, y))
        << "tile " << x << ", " << y << " is not hidden by the " << in_front << " groups in front";
  });
}

void Simulation::CheckPicture(const FrameImage& image, const Bytes& payload, const FrameReply& reply) {
  const auto frame = frames_.find(image.frame);
  ASSERT_TRUE(frame != frames_.end()) << "a picture of a frame that was never handed out";
  SymbolicPixel expected;
  for (std::uint32_t group = 0; group < reply.groups_done; ++group) {
    const auto seen = frame->second.groups.find(group);
    ASSERT_TRUE(seen != frame->second.groups.end()) << "group " << group << " was never handed out";
    expected.insert(expected.end(), seen->second.begin(), seen->second.end());
  }
  const Camera& camera = frame->second.setup.camera;
  EXPECT_EQ(reply.size, (ImageSize{camera.width, camera.height}));
  const SymbolicImage pixels = UnpackSymbols(payload);
  const PixelBounds bounds = FrameBounds(frame->second.setup);
  for (std::uint64_t i = 0; i < std::uint64_t(bounds.pixel_count()); ++i) {
    const auto pixel = pixels.find(i);
    const SymbolicPixel& seen = pixel == pixels.end() ? SymbolicPixel() : pixel->second;
    if (seen == expected) continue;
    const auto x = std::int32_t(i % std::uint64_t(bounds.width())) / kOcclusionTile;
    const auto y = std::int32_t(i / std::uint64_t(bounds.width())) / kOcclusionTile;
    EXPECT_TRUE(UsesOcclusion(frame->second.setup) && LacksHiddenBoxesOnly(seen, expected, frame->second.left_out, x, y))
        << "frame " << image.frame << ", pixel " << i << " shows " << testing::PrintToString(seen) << ", not "
        << testing::PrintToString(expected);
    ++tally_.hidden_pixels;
  }
  if (reply.groups_done < reply.group_count) {
    ++tally_.previews;
    return;
  }
  for (std::size_t far = 1; far < expected.size(); ++far) {
    for (std::size_t near = 0; near < far; ++near) {
      EXPECT_TRUE(MayComeFirst(camera, frame->second.boxes.at(expected[near]), frame->second.boxes.at(expected[far])))
          << expected[near] << " before " << expected[far] << " in " << testing::PrintToString(expected);
    }
  }
  frame->second.over = true;
  if (!faults_.none()) return;
  if (frame->second.all_cached) {
    std::uint64_t moved = 0;
    for (const RankReport& report : reply.statistics.reports) moved += report.voxel_bytes;
    EXPECT_EQ(moved, 0U) << "voxels that were there moved again";
    ++tally_.cached_frames;
  }
  fetched_.insert(frame->second.slabs.begin(), frame->second.slabs.end());
}

// ---------------------------------------------------------------- the coordinator

void Simulation::StepCoordinator(const CoordinatorEvent& event) {
  if (!coordinator_->alive) return;
  for (const CoordinatorAction& action : coordinator_->machine.Step(event, queue_.now())) {
    std::visit([&](const auto& a) { Perform(event, a); }, action);
  }
  WakeCoordinator();
}

void Simulation::WakeCoordinator() {
  Coordinator* coordinator = coordinator_.get();
  if (!coordinator->alive || coordinator->machine.NextWake() == Time::max()) return;
  coordinator->alarm.Set(queue_, coordinator->machine.NextWake(), [this, coordinator] {
    if (!coordinator->alive) return;
    if (coordinator->machine.NextWake() > queue_.now()) return WakeCoordinator();
    StepCoordinator(CoordinatorTick{});
    coordinator->idle_wakes = coordinator->machine.NextWake() <= queue_.now() ? coordinator->idle_wakes + 1 : 0;
    ASSERT_LT(coordinator->idle_wakes, 10) << "the coordinator spins";
  });
}

void Simulation::Perform(const CoordinatorEvent&, const ToWorker& action) {
  if (const auto* assignment = std::get_if<GroupAssignment>(&action.message)) Observe(*assignment);
  if (const auto* ping = std::get_if<Ping>(&action.message)) {
    for (auto& [id, frame] : frames_) {
      const bool cancelled = std::find(ping->cancelled.begin(), ping->cancelled.end(), id) != ping->cancelled.end();
      frame.over = frame.over || cancelled || id < ping->finished_before;
    }
  }
  const int node = NodeOf(action.to);
  if (action.to != TokenOf(node)) return;  // a connection of a coordinator that is gone
  if (told_dead_.count(node) > 0) {
    queue_.After({}, [this, token = action.to] { StepCoordinator(WorkerGone{token}); });
    return;
  }
  network_.Send({kCoordinatorEnd, node}, [this, node, message = OnTheWay(action.message)] { workers_[node]->Deliver(message, {}); });
}

void Simulation::Perform(const CoordinatorEvent& event, const ToClient& action) {
  const int client = NodeOf(action.to) - kClientNodes;
  if (const auto* reply = std::get_if<FrameReply>(&action.message)) {
    const auto* from_worker = std::get_if<FromWorker>(&event);
    const auto* image = from_worker == nullptr ? nullptr : std::get_if<FrameImage>(&from_worker->message);
    if (image != nullptr) CheckPicture(*image, action.payload, *reply);
  }
  if (const auto* status = std::get_if<StatusReply>(&action.message)) status_ = *status;
  if (client < 0 || client >= int(clients_.size()) || action.to != TokenOf(kClientNodes + client)) return;
  network_.Send({kCoordinatorEnd, kClientNodes + client},
                [this, client, message = OnTheWay(action.message)] { clients_[client]->Deliver(message); });
}

void Simulation::Perform(const CoordinatorEvent&, const LoadDataset& action) {
  CoordinatorEvent loaded = DatasetLoaded{action.name, action.dataset, summary_};
  if (random_.Chance(faults_.fail_load)) loaded = DatasetFailed{action.name, Status::NotFound("the file of the volume is gone")};
  queue_.After(milliseconds(random_.Integer(1, 300)), [this, loaded, generation = coordinator_->generation] {
    if (coordinator_->generation == generation) StepCoordinator(loaded);
  });
}

void Simulation::Perform(const CoordinatorEvent&, const CountDataset& action) {
  ++tally_.counts;
  OccupiedCounted counted{action.count, occupied_};
  if (random_.Chance(faults_.fail_load)) counted.grid = Status::ResourceExhausted("not enough memory to count");
  // Once, or twice, and with news of a count that nobody asked for.
  const int times = faults_.none() ? 1 : random_.Integer(1, 2);
  for (int i = 0; i < times; ++i) {
    queue_.After(milliseconds(random_.Integer(1, 300)), [this, counted, i, generation = coordinator_->generation] {
      if (coordinator_->generation != generation) return;
      if (i == 1) StepCoordinator(OccupiedCounted{counted.count + 1000000, occupied_});
      StepCoordinator(counted);
    });
  }
}

void Simulation::Perform(const CoordinatorEvent&, const StopService&) { coordinator_->alive = false; }

// ---------------------------------------------------------------- messages

AnyMessage Simulation::OnTheWay(const AnyMessage& message) const { return encode_messages_ ? OverTheWire(message) : message; }

void Simulation::ToCoordinator(int node, AnyMessage message, Bytes payload) {
  if (const auto* done = std::get_if<GroupDone>(&message); done != nullptr && done->epoch == coordinator_->epoch) {
    if (const auto frame = frames_.find(done->key.frame); frame != frames_.end()) {
      std::uint32_t& groups = frame->second.done[done->worker];
      groups = std::max(groups, done->key.group + 1);
    }
  }
  network_.Send({node, kCoordinatorEnd}, [this, node, message = OnTheWay(message), payload = std::move(payload)] {
    StepCoordinator(FromWorker{TokenOf(node), message, payload});
  });
}

void Simulation::ToSlabServer(int node, ChunkRequest request) {
  network_.Send({node, kSlabServerEnd}, [this, node, request = std::get<ChunkRequest>(OnTheWay(request))] {
    if (!coordinator_->alive) return;
    AnyMessage answer;
    if (request.epoch != coordinator_->epoch) {
      answer =
          ChunkRefused{coordinator_->epoch, request.dataset, request.box, request.chunk, Status::NotFound("another coordinator's epoch")};
    } else {
      const auto total = std::uint64_t(request.box.voxel_count());
      Chunk chunk;
      chunk.epoch = request.epoch;
      chunk.dataset = request.dataset;
      chunk.box = request.box;
      chunk.chunk = request.chunk;
      chunk.raw_bytes = std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - std::uint64_t(request.chunk) * kChunkBytes));
      chunk.encoded_bytes = chunk.raw_bytes;
      answer = chunk;
    }
    network_.Send({kSlabServerEnd, node}, [this, node, answer = OnTheWay(answer)] { workers_[node]->Deliver(answer, {}); });
  });
}

void Simulation::ToPeer(int node, const Peer& to, PartialImage message, Bytes payload) {
  const int target = std::stoi(to.images_endpoint.substr(to.images_endpoint.find(':') + 1));
  if (told_dead_.count(target) > 0 && random_.Chance(0.3)) {
    queue_.After({}, [this, node, worker = to.worker] { workers_[node]->TellPeerUnreachable(worker); });
    return;
  }
  network_.Send({node, target},
                [this, target, message = OnTheWay(message), payload = std::move(payload)] { workers_[target]->Deliver(message, payload); });
}

void Simulation::FromClientNode(int client, AnyMessage message) {
  network_.Send({kClientNodes + client, kCoordinatorEnd}, [this, client, message = OnTheWay(message)] {
    StepCoordinator(FromClient{TokenOf(kClientNodes + client), message});
  });
}

}  // namespace slabstream
