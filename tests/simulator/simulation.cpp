#include "tests/simulator/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint32_t kDeadlineMs = 60000;
constexpr Duration kBound = milliseconds(kDeadlineMs) + seconds(30);  // until every request has ended, from the last one on
constexpr Duration kTroubled = seconds(5);                            // requests are made and things break in this time
constexpr Duration kSettle = seconds(14);                             // long enough for every time-out of the machines below

// Ends of links, and names of connections: workers 0, 1, ...; clients from kClientNodes on.
constexpr int kClientNodes = 1 << 20;
constexpr int kCoordinatorEnd = -1, kSlabServerEnd = -2;

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
      encode_messages_(random_.Chance(0.02)),
      world_(RandomWorld(random_, faults_)),
      witness_(faults_, tally) {}

Simulation::~Simulation() = default;

// ---------------------------------------------------------------- the world

void Simulation::AddWorker(Duration after) {
  queue_.After(after, [this] {
    const int node = int(workers_.size());
    WorkerNetwork& network = *this;
    WorkerConfig config = world_.worker_config;
    config.incarnation = random_.Integer<Incarnation>(1, std::uint64_t{1} << 62);
    config.images_endpoint = "worker:" + std::to_string(node);
    workers_.push_back(std::make_unique<ModelWorker>(node, config, world_.speed, faults_, random_, queue_, network));
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
  coordinator_ = std::unique_ptr<Coordinator>(new Coordinator{FrameMachine(std::move(config)), Planner(), epoch, {}, generation, true, 0});
  witness_.OnRestart();
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
        c->Submit(RandomRequest(random_, world_.policy, RequestId(r), kDeadlineMs));
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
  const auto* assignment = std::get_if<GroupAssignment>(&action.message);
  if (assignment != nullptr) witness_.OnAssignment(*assignment, workers_.size(), world_.policy.teams);
  if (const auto* ping = std::get_if<Ping>(&action.message)) witness_.OnPing(*ping);
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
    if (image != nullptr) witness_.OnPicture(*image, action.payload, *reply);
  }
  if (const auto* status = std::get_if<StatusReply>(&action.message)) status_ = *status;
  if (client < 0 || client >= int(clients_.size()) || action.to != TokenOf(kClientNodes + client)) return;
  network_.Send({kCoordinatorEnd, kClientNodes + client},
                [this, client, message = OnTheWay(action.message)] { clients_[client]->Deliver(message); });
}

void Simulation::Perform(const CoordinatorEvent&, const LoadDataset& action) {
  CoordinatorEvent loaded = DatasetLoaded{action.name, action.dataset, world_.summary};
  if (random_.Chance(faults_.fail_load)) loaded = DatasetFailed{action.name, Status::NotFound("the file of the volume is gone")};
  queue_.After(milliseconds(random_.Integer(1, 300)), [this, loaded, generation = coordinator_->generation] {
    if (coordinator_->generation == generation) StepCoordinator(loaded);
  });
}

void Simulation::Perform(const CoordinatorEvent&, const CountDataset& action) {
  ++tally_.counts;
  OccupiedCounted counted{action.count, world_.occupied};
  if (random_.Chance(faults_.fail_load)) counted.grid = Status::ResourceExhausted("not enough memory to count");
  // Once, or twice, and with news of a count that nobody asked for.
  const int times = faults_.none() ? 1 : random_.Integer(1, 2);
  for (int i = 0; i < times; ++i) {
    queue_.After(milliseconds(random_.Integer(1, 300)), [this, counted, i, generation = coordinator_->generation] {
      if (coordinator_->generation != generation) return;
      if (i == 1) StepCoordinator(OccupiedCounted{counted.count + 1000000, world_.occupied});
      StepCoordinator(counted);
    });
  }
}

// Plans come late, and not always in the order in which they were asked for.
void Simulation::Perform(const CoordinatorEvent&, const PlanRequest& action) {
  Planned planned{action.plan, coordinator_->planner.Plan(action)};
  if (random_.Chance(faults_.fail_load)) planned.frame = Status::ResourceExhausted("not enough memory to plan");
  queue_.After(std::chrono::microseconds(random_.Integer(0, faults_.none() ? 200 : 100000)),
               [this, planned, generation = coordinator_->generation] {
                 if (coordinator_->generation == generation) StepCoordinator(planned);
               });
}

void Simulation::Perform(const CoordinatorEvent&, const StopService&) { coordinator_->alive = false; }

// ---------------------------------------------------------------- messages

AnyMessage Simulation::OnTheWay(const AnyMessage& message) const { return encode_messages_ ? OverTheWire(message) : message; }

void Simulation::ToCoordinator(int node, AnyMessage message, Bytes payload) {
  if (const auto* done = std::get_if<GroupDone>(&message); done != nullptr && done->epoch == coordinator_->epoch)
    witness_.OnGroupDone(*done);
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
