// What breaks a simulated world.
#include <algorithm>
#include <functional>

#include "tests/simulator/simulation.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

constexpr int kHostileWords = 40;                       // of each hostile peer
constexpr double kNoMessages = 0.35;                    // so many of its words are dropped when they are decoded
constexpr double kLongestPause = 6, kLongestJump = 30;  // seconds

}  // namespace

// Everything that happens beside messages, somewhere in `span` from now on.
void Simulation::PlanTroubles(Duration span) {
  const auto somewhere = [&](std::function<void()> what) {
    service_.queue().After(Duration(random_.Integer<std::int64_t>(0, span.count())), std::move(what));
  };
  for (int i = 0; i < faults_.worker_kills; ++i) somewhere([this] { KillSomeWorker(); });
  for (int i = 0; i < faults_.preemptions; ++i) somewhere([this] { Preempt(); });
  for (int i = 0; i < faults_.workers_leaving; ++i) somewhere([this] { TellWorkerToLeave(); });
  for (int i = 0; i < faults_.workers_joining; ++i) somewhere([this] { AddWorker({}); });
  for (int i = 0; i < faults_.coordinator_restarts; ++i) somewhere([this] { RestartCoordinator(); });
  for (int i = 0; i < faults_.cuts; ++i) somewhere([this] { Cut(); });
  const auto pause = [&] { return random_.Chance(0.5) ? random_.Real(0.01, 2) : random_.Real(2, kLongestPause); };
  for (int i = 0; i < faults_.worker_pauses; ++i) somewhere([this, seconds = pause()] { PauseWorker(seconds); });
  for (int i = 0; i < faults_.coordinator_pauses; ++i) {
    somewhere([this, seconds = pause()] {
      tally_.Add(Count::kCoordinatorPauses);
      service_.HoldCoordinator(service_.now() + seconds);
    });
  }
  for (int i = 0; i < faults_.suspensions; ++i) somewhere([this, seconds = pause()] { Suspend(seconds); });
  for (int i = 0; i < faults_.clock_jumps; ++i) {
    somewhere([this, by = milliseconds(int(random_.Real(10, kLongestJump * 1000)))] {
      tally_.Add(Count::kClockJumps);
      service_.JumpCoordinator(by);
    });
  }
  for (const auto& client : clients_) {
    if (!random_.Chance(faults_.vanish)) continue;
    tally_.Add(Count::kVanishedClients);
    somewhere([c = client.get()] { c->Vanish(); });
  }
  for (int i = 0; i < faults_.file_changes; ++i) somewhere([this] { ChangeFile(); });
  for (int i = 0; i < faults_.data_orders; ++i) somewhere([this] { OrderData(); });
  for (int i = 0; i < faults_.hostile_clients; ++i) {
    tally_.Add(Count::kHostileClients);
    for (int w = 0; w < kHostileWords; ++w) somewhere([this, i] { SpeakAsClient(std::size_t(i)); });
  }
  for (int i = 0; i < faults_.strangers + faults_.hostile_workers; ++i) {
    const bool worker = i >= faults_.strangers;
    somewhere([this, worker, span] { AddHostilePeer(worker, span); });
  }
}

void Simulation::Heal() {
  current_ = {};
  network_.CalmDown();
  if (owners_) owners_->Heal();
  for (ModelWorker& worker : workers_) worker.Heal();
}

// ---------------------------------------------------------------- processes

std::vector<Node> Simulation::Running() const {
  std::vector<Node> running;
  for (Node node = 0; node < workers_.size(); ++node) {
    if (service_.alive(node) && !service_.Held(node)) running.push_back(node);
  }
  return running;
}

std::vector<Node> Simulation::Staying() const {
  std::vector<Node> staying = Running();
  std::erase_if(staying, [this](Node node) { return leaving_.contains(node); });
  return staying;
}

void Simulation::TellWorkerToLeave() {
  const std::vector<Node> staying = Staying();
  if (staying.empty()) return;
  const Node leaver = staying[random_.Integer<std::size_t>(0, staying.size() - 1)];
  // Until it knows its id it cannot say that it leaves: it is lost.
  if (faults_.gentle() && !service_.worker(leaver).registered()) return;
  leaving_.emplace(leaver, service_.now());
  tally_.Add(Count::kWorkersLeft);
  workerless_ = workerless_ || staying.size() == 1;
  service_.StepWorker(leaver, LeaveRequested{});
  if (random_.Chance(faults_.restart)) AddWorker(milliseconds(random_.Integer(1, 4000)));
}

void Simulation::KillWorker(Node victim) {
  service_.KillWorker(victim);
  tally_.Add(Count::kWorkersKilled);
  if (!random_.Chance(faults_.silent_kill)) told_dead_.insert(victim);
  workerless_ = workerless_ || Staying().empty();
  if (random_.Chance(faults_.restart)) AddWorker(milliseconds(random_.Integer(1, 4000)));
}

void Simulation::KillSomeWorker() {
  const std::vector<Node> running = Running();
  if (!running.empty()) KillWorker(running[random_.Integer<std::size_t>(0, running.size() - 1)]);
}

void Simulation::Preempt() {
  std::vector<Node> running = Running();
  if (running.size() < 2) return;
  tally_.Add(Count::kPreemptions);
  for (std::size_t half = (running.size() + 1) / 2; half > 0; --half) {
    const auto victim = running.begin() + random_.Integer<std::ptrdiff_t>(0, std::ptrdiff_t(running.size()) - 1);
    KillWorker(*victim);
    running.erase(victim);
  }
}

void Simulation::RestartCoordinator() {
  if (!service_.coordinator_runs()) return;
  service_.StopCoordinator();
  if (owners_) owners_->StopCoordinator();
  tally_.Add(Count::kCoordinatorRestarts);
  service_.queue().After(milliseconds(random_.Integer(1, 6000)), [this] { StartCoordinator(); });
}

void Simulation::PauseWorker(double seconds) {
  const std::vector<Node> running = Running();
  if (running.empty()) return;
  tally_.Add(Count::kWorkerPauses);
  service_.HoldWorker(running[random_.Integer<std::size_t>(0, running.size() - 1)], service_.now() + seconds);
  workerless_ = workerless_ || Staying().empty();
}

void Simulation::Suspend(double seconds) {
  tally_.Add(Count::kSuspensions);
  service_.HoldCoordinator(service_.now() + seconds);
  for (const Node node : Running()) service_.HoldWorker(node, service_.now() + seconds);
}

// ---------------------------------------------------------------- files

void Simulation::ChangeFile() {
  ++voxels_;
  tally_.Add(Count::kFileChanges);
}

// Nothing that would leave a client without its dataset: "volume" is read anew, but stays.
void Simulation::OrderData() {
  if (random_.Chance(0.4)) return SendVolume();
  DataOrder order{.nonce = 1, .action = DataAction(random_.Integer(1, 4))};
  if (order.action == DataAction::kAdd) order.items = {"more"};
  if (order.action == DataAction::kRemove)
    order.items = {random_.Chance(0.5) ? "more" : random_.Chance(0.5) ? "other" : random_.Chance(0.5) ? "sent" : "nothing"};
  if (order.action == DataAction::kReload) order.items = {"volume"};
  tally_.Add(Count::kDataOrders);
  AskDatasets(Admin(), order);
}

// Another one may be on its way: it ends that.
void Simulation::SendVolume() {
  AddVolume order{.nonce = sending_.nonce + 1, .name = owners_ || random_.Chance(0.9) ? "sent" : "volume"};
  order.description.geometry.size = {512, 512, random_.Integer(1, 60)};
  sending_ = {.nonce = order.nonce, .sent = 0, .bytes = BytesToSend(order)};
  AskDatasets(Admin(), order);
}

// As far as the credit goes; sometimes too far, sometimes it stops for good.
void Simulation::SendParts(const VolumeCredit& credit) {
  if (credit.nonce != sending_.nonce || random_.Chance(0.05)) return;
  while (sending_.sent < credit.allowed) {
    const auto bytes = std::uint32_t(std::min<std::uint64_t>(kMaxVolumePartBytes, credit.allowed - sending_.sent));
    const VolumePart part{.nonce = sending_.nonce, .begin = random_.Chance(0.01) ? 7 : sending_.sent, .bytes = bytes};
    sending_.sent += bytes;
    AskDatasets(Admin(), part, Bytes(std::vector<std::byte>(bytes)));
  }
}

// ---------------------------------------------------------------- the network

void Simulation::Cut() {
  const auto worker = [&] { return random_.Integer(0, std::max(0, int(workers_.size()) - 1)); };
  const int client = kClientEnds + random_.Integer(0, int(clients_.size()) - 1);
  FaultyNetwork::Link link;
  switch (random_.Integer(0, 3)) {
    case 0: link = {kCoordinatorEnd, worker()}; break;
    case 1: link = {worker(), worker()}; break;
    case 2: link = {kCoordinatorEnd, client}; break;
    default: link = {kVoxelServerEnd, worker()}; break;
  }
  if (random_.Chance(0.5)) std::swap(link.first, link.second);
  tally_.Add(Count::kCuts);
  network_.Cut(link, service_.now() + random_.Real(0.1, 15), random_.Chance(0.5));
}

// ---------------------------------------------------------------- hostile peers

// A node whose own machine never runs: others make up its words.
void Simulation::AddHostilePeer(bool worker, Duration span) {
  const auto node = Node(workers_.size());
  HostilePeer& peer =
      hostile_peers_.try_emplace(node, HostilePeer{.self = {.epoch = epoch_, .node = node}, .worker = worker}).first->second;
  AddNode();
  service_.KillWorker(node);
  tally_.Add(worker ? Count::kHostileWorkers : Count::kStrangers);
  for (int w = 0; w < kHostileWords; ++w) {
    service_.queue().After(Duration(random_.Integer<std::int64_t>(0, span.count())), [this, &peer] { Speak(peer); });
  }
  if (worker) BeatOf(peer);
}

// It keeps itself alive.
void Simulation::BeatOf(HostilePeer& peer) {
  if (current_.none()) return;
  if (peer.self.worker != 0) {
    const Heartbeat beat{.epoch = peer.self.epoch, .incarnation = peer.self.incarnation, .worker = peer.self.worker};
    service_.StepCoordinator(FromWorker{service_.TokenOf(peer.self.node), beat, {}});
  }
  service_.queue().After(milliseconds(500), [this, &peer] { BeatOf(peer); });
}

Arrivals Simulation::HearAsHostile(HostilePeer& peer, const CoordinatorToWorker& message) {
  if (const auto* welcome = std::get_if<Welcome>(&message)) {
    if (peer.self.worker != welcome->worker) tally_.Add(Count::kHostileWorkersAdmitted);
    peer.self.epoch = welcome->epoch;
    peer.self.incarnation = welcome->incarnation;
    peer.self.worker = welcome->worker;
  }
  if (std::holds_alternative<GroupAssignment>(message)) tally_.Add(Count::kGroupsOfHostileWorkers);
  return {};
}

void Simulation::Speak(HostilePeer& peer) {
  const auto nodes = std::uint32_t(workers_.size());
  if (random_.Chance(0.3)) {
    HostileWords::Words<WorkerToWorker> words = words_.ToWorker(peer.self);
    const auto to = random_.Integer<Node>(0, nodes - 1);
    tally_.Add(Count::kHostileImages);
    return service_.StepWorker(to, MessageReceived{Widen<MessageToWorker>(std::move(words.message)), std::move(words.payload)});
  }
  tally_.Add(Count::kHostileWorkerMessages);
  if (random_.Chance(kNoMessages)) return;
  HostileWords::Words<WorkerToCoordinator> words = words_.OfWorker(peer.self, nodes);
  const auto* done = std::get_if<GroupDone>(&words.message);
  if (done != nullptr && done->epoch == epoch_ && done->worker == peer.self.worker) witness_.OnGroupDone(*done);
  service_.StepCoordinator(FromWorker{service_.TokenOf(peer.self.node), std::move(words.message), std::move(words.payload)});
}

void Simulation::SpeakAsClient(std::size_t hostile) {
  tally_.Add(Count::kHostileClientMessages);
  if (random_.Chance(kNoMessages)) return;
  ClientToCoordinator words = words_.OfClient(world_.policy);
  const auto* const submit = std::get_if<SubmitFrame>(&words);
  if (submit != nullptr && submit->frame.policy.teams <= kMaxTeams) most_teams_ = std::max(most_teams_, submit->frame.policy.teams);
  const PeerToken client = service_.TokenOf(Node(kHostileClientEnds + int(hostile)));
  std::visit(
      [&]<class Message>(Message& message) {
        if constexpr (std::constructible_from<ClientToFrames, Message>) {
          service_.StepCoordinator(FromClient{client, message});
        } else if constexpr (std::constructible_from<ClientToDatasets, Message>) {
          AskDatasets(client, message);
        }
      },
      words);
}

}  // namespace slabstream
