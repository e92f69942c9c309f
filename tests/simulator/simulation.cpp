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

// Ends of links, and names of connections: workers 0, 1, ...; clients from kClientEnds on.
constexpr int kClientEnds = 1 << 20;
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
      network_(random_, faults_, std::chrono::microseconds(random_.Integer(50, 5000))),
      encode_messages_(random_.Chance(0.02)),
      world_(RandomWorld(random_, faults_)),
      witness_(faults_, tally),
      service_(machine_, *this) {}

// ---------------------------------------------------------------- the world

void Simulation::AddWorker(Duration after) {
  service_.queue().After(after, [this] {
    WorkerConfig config = world_.worker_config;
    config.incarnation = random_.Integer<Incarnation>(1, std::uint64_t{1} << 62);
    workers_.emplace_back(Node(workers_.size()), config, world_.speed, faults_, random_, service_);
    service_.AddWorker(std::move(config));
  });
}

void Simulation::KillWorker() {
  std::vector<Node> alive;
  for (Node node = 0; node < workers_.size(); ++node) {
    if (service_.alive(node)) alive.push_back(node);
  }
  if (alive.empty()) return;
  const Node victim = alive[random_.Integer<std::size_t>(0, alive.size() - 1)];
  service_.KillWorker(victim);
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
  epoch_ = config.epoch;
  planner_.emplace();
  witness_.OnRestart();
  service_.StartCoordinator(std::move(config));
}

void Simulation::RestartCoordinator() {
  if (!service_.coordinator_runs()) return;
  service_.StopCoordinator();
  ++tally_.coordinator_restarts;
  service_.queue().After(milliseconds(random_.Integer(1, 6000)), [this] { StartCoordinator(); });
}

// Everything that happens beside messages, somewhere in `span` from now on.
void Simulation::PlanTroubles(Duration span) {
  const auto somewhere = [&](std::function<void()> what) {
    service_.queue().After(Duration(random_.Integer<std::int64_t>(0, span.count())), std::move(what));
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

void Simulation::RunUntil(Duration from_now, bool until_idle) {
  const double end = service_.now() + std::chrono::duration<double>(from_now).count();
  while (service_.next() <= end && !testing::Test::HasFatalFailure()) {
    service_.RunNext();
    ASSERT_LT(service_.spins(), 10) << "a machine wants to be woken at once, again and again";
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
    clients_.push_back(
        std::make_unique<ModelClient>(service_, [this, i](const AnyMessage& message) { FromClientNode(std::size_t(i), message); }));
  }
  // Without faults nobody asks before all workers are there: slots, and so slabs, then stay as they are.
  const Duration first = faults_.none() ? Duration(milliseconds(500)) : Duration{};
  for (const auto& client : clients_) {
    const int requests = random_.Integer(1, 4);
    for (int r = 1; r <= requests; ++r) {
      ++requests_planned_;
      const Duration when = first + Duration(random_.Integer<std::int64_t>(0, Duration(kTroubled).count() / 2));
      service_.queue().After(when, [this, c = client.get(), r] {
        ++requests_made_;
        c->Submit(RandomRequest(random_, world_.policy, RequestId(r), kDeadlineMs));
        if (random_.Chance(faults_.cancel)) {
          service_.queue().After(milliseconds(random_.Integer(0, 1000)), [c, r] { c->Cancel(RequestId(r)); });
        }
      });
    }
  }
  PlanTroubles(kTroubled);
  tally_.requests += requests_planned_;

  RunUntil(kTroubled + kBound, true);
  CheckOutcome();
  network_.CalmDown();
  RunUntil(kTroubled + kSettle, false);
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
  ASSERT_TRUE(service_.coordinator_runs());
  for (Node node = 0; node < workers_.size(); ++node) {
    if (!service_.alive(node) || workers_[node].stopped()) continue;
    EXPECT_EQ(workers_[node].images(), 0U) << node;
    EXPECT_TRUE(service_.worker(node).registered()) << node;
  }
  const PeerToken monitor = TokenOfClient(clients_.size());
  service_.StepCoordinator(FromClient{monitor, StatusQuery{1}});
  ASSERT_TRUE(status_.has_value());
  EXPECT_EQ(status_->queued, 0U);
  EXPECT_EQ(status_->running, 0U);
  service_.StepCoordinator(FromClient{monitor, ShutDown{2}});
  EXPECT_FALSE(service_.coordinator_runs());
  RunUntil(seconds(1), false);
  for (Node node = 0; node < workers_.size(); ++node) EXPECT_TRUE(!service_.alive(node) || workers_[node].stopped()) << node;
}

// ---------------------------------------------------------------- the coordinator

void Simulation::Perform(ToClient& action) {
  if (const auto* reply = std::get_if<FrameReply>(&action.message)) {
    const auto* from_worker = std::get_if<FromWorker>(cause_);
    const auto* image = from_worker == nullptr ? nullptr : std::get_if<FrameImage>(&from_worker->message);
    if (image != nullptr) witness_.OnPicture(*image, action.payload, *reply);
  }
  if (const auto* status = std::get_if<StatusReply>(&action.message)) status_ = *status;
  for (std::size_t client = 0; client < clients_.size(); ++client) {
    if (action.to != TokenOfClient(client)) continue;
    const Arrivals arrivals = network_.Send({kCoordinatorEnd, kClientEnds + int(client)}, service_.now());
    for (int i = 0; i < arrivals.count; ++i) {
      service_.queue().At(arrivals.times[i], [c = clients_[client].get(), message = OnTheWay(action.message)] { c->Deliver(message); });
    }
  }
}

void Simulation::Perform(const LoadDataset& action) {
  CoordinatorEvent loaded = DatasetLoaded{action.name, action.dataset, world_.summary};
  if (random_.Chance(faults_.fail_load)) loaded = DatasetFailed{action.name, Status::NotFound("the file of the volume is gone")};
  service_.TellCoordinator(service_.now() + random_.Real(0.001, 0.3), loaded);
}

void Simulation::Perform(const CountDataset& action) {
  ++tally_.counts;
  OccupiedCounted counted{action.count, world_.occupied};
  if (random_.Chance(faults_.fail_load)) counted.grid = Status::ResourceExhausted("not enough memory to count");
  // Once, or twice, and with news of a count that nobody asked for.
  const int times = faults_.none() ? 1 : random_.Integer(1, 2);
  for (int i = 0; i < times; ++i) {
    const double when = service_.now() + random_.Real(0.001, 0.3);
    if (i == 1) service_.TellCoordinator(when, OccupiedCounted{counted.count + 1000000, world_.occupied});
    service_.TellCoordinator(when, counted);
  }
}

// Plans come late, and not always in the order in which they were asked for.
void Simulation::Perform(const PlanRequest& action) {
  Planned planned{action.plan, planner_->Plan(action)};
  if (random_.Chance(faults_.fail_load / 5)) planned.frame = Status::ResourceExhausted("not enough memory to plan");
  service_.TellCoordinator(service_.now() + random_.Real(0, faults_.none() ? 200e-6 : 0.1), std::move(planned));
}

// ---------------------------------------------------------------- messages

AnyMessage Simulation::OnTheWay(const AnyMessage& message) const { return encode_messages_ ? OverTheWire(message) : message; }

Arrivals Simulation::ToWorker(Node to, AnyMessage& message, double sent) {
  if (const auto* assignment = std::get_if<GroupAssignment>(&message)) {
    witness_.OnAssignment(*assignment, workers_.size(), world_.policy.teams);
  }
  if (const auto* ping = std::get_if<Ping>(&message)) witness_.OnPing(*ping);
  if (told_dead_.contains(to)) return {.nobody = true};
  message = OnTheWay(message);
  return network_.Send({kCoordinatorEnd, int(to)}, sent);
}

Arrivals Simulation::ToCoordinator(Node from, AnyMessage& message) {
  if (const auto* done = std::get_if<GroupDone>(&message); done != nullptr && done->epoch == epoch_) witness_.OnGroupDone(*done);
  message = OnTheWay(message);
  return network_.Send({int(from), kCoordinatorEnd}, service_.now());
}

Arrivals Simulation::ToPeer(Node to, Job& sends) {
  if (told_dead_.contains(to) && random_.Chance(0.3)) return {.nobody = true};
  PartialImage& image = std::get<SendPartial>(sends.action).message;
  image = std::get<PartialImage>(OnTheWay(image));
  return network_.Send({int(sends.node), int(to)}, service_.now());
}

void Simulation::Perform(Node node, SendChunkRequest& action) {
  workers_[node].OnRequest(action.request);
  const ChunkRequest request = std::get<ChunkRequest>(OnTheWay(action.request));
  const Arrivals asked = network_.Send({int(node), kSlabServerEnd}, service_.now());
  for (int i = 0; i < asked.count; ++i) {
    service_.queue().At(asked.times[i], [this, node, request] {
      if (!service_.coordinator_runs()) return;
      const AnyMessage answer = OnTheWay(AnswerOf(request));
      const Arrivals answered = network_.Send({kSlabServerEnd, int(node)}, service_.now());
      for (int j = 0; j < answered.count; ++j) {
        service_.queue().At(answered.times[j], [this, node, answer] { service_.StepWorker(node, MessageReceived{answer, {}}); });
      }
    });
  }
}

AnyMessage Simulation::AnswerOf(const ChunkRequest& request) const {
  if (request.epoch != epoch_) {
    return ChunkRefused{epoch_, request.dataset, request.box, request.chunk, Status::NotFound("another coordinator's epoch")};
  }
  Chunk chunk;
  chunk.epoch = request.epoch;
  chunk.dataset = request.dataset;
  chunk.box = request.box;
  chunk.chunk = request.chunk;
  chunk.raw_bytes = BytesOfChunk(request.box, kVoxelType, request.chunk);
  chunk.encoded_bytes = chunk.raw_bytes;
  return chunk;
}

PeerToken Simulation::TokenOfClient(std::size_t client) const { return service_.TokenOf(Node(kClientEnds + int(client))); }

void Simulation::FromClientNode(std::size_t client, const AnyMessage& message) {
  const Arrivals arrivals = network_.Send({kClientEnds + int(client), kCoordinatorEnd}, service_.now());
  for (int i = 0; i < arrivals.count; ++i) {
    service_.queue().At(arrivals.times[i], [this, client, message = OnTheWay(message)] {
      service_.StepCoordinator(FromClient{TokenOfClient(client), message});
    });
  }
}

}  // namespace slabstream
