#include "simulator/simulated_service.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr Time kStart{std::chrono::seconds(1000)};

Bytes TakePayload(Job& job) {
  const Rare<Bytes> payload = std::move(job.payload);
  return payload ? *payload : Bytes();
}

}  // namespace

SimulatedService::SimulatedService(const MachineModel& machine, Conditions& conditions)
    : machine_(machine),
      conditions_(conditions),
      queue_([this](std::uint32_t number) { OnNumber(number); }),
      threads_(machine.wake_ups),
      lanes_(machine, threads_) {}

Time SimulatedService::TimeAt(double seconds) { return kStart + Duration(std::llround(seconds * 1e9)); }
double SimulatedService::SecondsAt(Time time) { return std::chrono::duration<double>(time - kStart).count(); }

double SimulatedService::next() { return std::min(queue_.empty() ? kNever : queue_.next(), lanes_.NextTime()); }

void SimulatedService::RunNext() {
  const double task_time = lanes_.NextTime();
  if (!queue_.empty() && queue_.next() < task_time) return queue_.RunNext();
  queue_.AdvanceTo(task_time);
  if (const std::optional<LaneTask> done = lanes_.Step()) OnWorked(*done);
}

// One event at most is planned that is not too late.
void SimulatedService::SetAlarm(double& alarm, Time wake, auto&& ring) {
  if (wake == Time::max() || SecondsAt(wake) >= alarm) return;
  alarm = std::max(SecondsAt(wake), now());
  queue_.At(alarm, std::forward<decltype(ring)>(ring));
}

// ---------------------------------------------------------------- the coordinator

void SimulatedService::StartCoordinator(CoordinatorConfig config) {
  coordinator_ = std::make_unique<FrameMachine>(std::move(config));
  coordinator_runs_ = true;
  ++generation_;
  coordinator_alarm_ = kNever;
  coordinator_held_ = 0;
  StepCoordinator(CoordinatorTick{});
}

void SimulatedService::JumpCoordinator(Duration by) {
  coordinator_ahead_ += by;
  if (coordinator_runs_) SetCoordinatorAlarm();
}

Time SimulatedService::CoordinatorWake() const {
  const Time wake = coordinator_->NextWake();
  return wake == Time::max() ? wake : wake - coordinator_ahead_;
}

void SimulatedService::SetCoordinatorAlarm() {
  SetAlarm(coordinator_alarm_, CoordinatorWake(), [this, generation = generation_] { WakeCoordinator(generation); });
}

std::optional<Node> SimulatedService::NodeOf(PeerToken token) const {
  return token >> 32U == generation_ ? std::optional(Node(token)) : std::nullopt;
}

void SimulatedService::TellCoordinator(double when, FrameEvent event) {
  queue_.At(when, [this, generation = generation_, event = std::move(event)] {
    if (generation == generation_) StepCoordinator(event);
  });
}

void SimulatedService::StepCoordinator(const FrameEvent& event) {
  if (!coordinator_runs_) return;
  if (now() < coordinator_held_) return TellCoordinator(coordinator_held_, event);
  const bool message = std::holds_alternative<FromWorker>(event) || std::holds_alternative<FromClient>(event);
  coordinator_free_ = std::max(coordinator_free_, now()) + (message ? machine_.message_seconds : 0);
  conditions_.BeforeStep(event);
  for (FrameAction& action : coordinator_->Step(event, coordinator_time())) {
    std::visit([this](auto& a) { Perform(a); }, action);
  }
  threads_.Active(Threads::kCoordinator, coordinator_free_);
  if (coordinator_runs_) SetCoordinatorAlarm();
}

void SimulatedService::WakeCoordinator(std::uint64_t generation) {
  if (generation != generation_ || !coordinator_runs_ || now() != coordinator_alarm_) return;
  coordinator_alarm_ = kNever;
  if (CoordinatorWake() > time()) return SetCoordinatorAlarm();
  const bool held = now() < coordinator_held_;
  StepCoordinator(CoordinatorTick{});
  if (!held) CountSpin(CoordinatorWake() <= time());
}

void SimulatedService::Perform(TellWorkers& action) {
  for (std::size_t i = 0; i < action.to.size(); ++i) {
    SendWorker(action.to[i], i + 1 < action.to.size() ? action.message : std::move(action.message));
  }
}

void SimulatedService::SendWorker(PeerToken to, CoordinatorToWorker sent) {
  const std::optional<Node> node = NodeOf(to);
  if (!node) return;
  coordinator_free_ += machine_.message_seconds;
  const bool wakes = std::holds_alternative<GroupAssignment>(sent);  // pings do not change any time
  const Arrivals arrivals = conditions_.ToWorker(*node, sent, coordinator_free_);
  if (arrivals.nobody) TellCoordinator(now(), WorkerGone{to});
  for (int i = 0; i < arrivals.count; ++i) {
    const double arrival = wakes ? threads_.Begin(Threads::Machine(*node), arrivals.times[i]) : arrivals.times[i];
    CoordinatorToWorker message = i + 1 < arrivals.count ? sent : std::move(sent);
    queue_.At(arrival, [this, to = *node, received = MessageReceived{Widen<MessageToWorker>(std::move(message)), {}}]() mutable {
      StepWorker(to, std::move(received));
    });
  }
}

// ---------------------------------------------------------------- workers

Node SimulatedService::AddWorker(WorkerConfig config) {
  const auto node = Node(workers_.size());
  config.images_endpoint = std::to_string(node);
  workers_.push_back({WorkerMachine(std::move(config))});
  threads_.AddWorker();
  lanes_.AddWorker();
  StepWorker(node, Tick{});
  return node;
}

void SimulatedService::StepWorker(Node node, WorkerEvent&& event) {
  Worker& worker = workers_[node];
  if (!worker.alive) return;
  if (now() < worker.held) return queue_.At(worker.held, [this, node, event]() mutable { StepWorker(node, std::move(event)); });
  WorkerActions actions = worker.machine.Step(std::move(event), time(), std::move(actions_));
  for (WorkerAction& action : actions) {
    std::visit([&](auto& a) { Perform(node, a); }, action);
  }
  actions_ = std::move(actions);
  conditions_.AfterStep(node);
  SetAlarm(worker.alarm, worker.machine.NextWake(), [this, node] { WakeWorker(node); });
}

void SimulatedService::WakeWorker(Node node) {
  Worker& worker = workers_[node];
  if (!worker.alive || now() != worker.alarm) return;
  worker.alarm = kNever;
  const bool due = worker.machine.NextWake() <= time();
  if (!due) return SetAlarm(worker.alarm, worker.machine.NextWake(), [this, node] { WakeWorker(node); });
  const bool held = now() < worker.held;
  StepWorker(node, Tick{});
  if (!held) CountSpin(worker.machine.NextWake() <= time());
}

std::optional<std::uint32_t> SimulatedService::RenderOf(Node node, ImageHandle image) const {
  const auto& renders = workers_[node].renders;
  const auto found = std::ranges::find(renders, image, &std::pair<ImageHandle, std::uint32_t>::first);
  return found == renders.end() ? std::nullopt : std::optional(found->second);
}

void SimulatedService::Perform(Node node, PauseRender& action) {
  if (const auto place = RenderOf(node, action.image)) lanes_.Pause(node, Lane::kRender, *place, now());
}

void SimulatedService::Perform(Node node, ResumeRender& action) {
  if (const auto place = RenderOf(node, action.image)) lanes_.Resume(*place, now());
}

void SimulatedService::Perform(Node node, CancelRender& action) {
  const auto place = RenderOf(node, action.image);
  if (!place) return;
  lanes_.Resume(*place, now());  // it ends by itself
  if (!conditions_.CancelsInTime()) return;
  JobAt(*place).cancelled = true;
  lanes_.EndNow(node, Lane::kRender, *place, now());
}

// Previews are made where images are combined.
Lane SimulatedService::LaneOf(const SendFrame& frame) {
  return frame.message.groups_done == frame.message.group_count ? Lane::kFinish : Lane::kCombine;
}

template <class Action>
std::uint32_t SimulatedService::Order(Node node, Action& action) {
  if (unused_jobs_.empty()) {
    jobs_.push_back(std::make_unique<Job[]>(kChunk));
    for (std::size_t i = 1; i <= kChunk; ++i) unused_jobs_.push_back(std::uint32_t(jobs_.size() * kChunk - i));
  }
  const std::uint32_t place = unused_jobs_.back();
  unused_jobs_.pop_back();
  Job& job = JobAt(place);
  job.node = node;
  job.cancelled = false;
  job.payload.reset();
  if constexpr (std::is_same_v<Action, SendPartial>) {
    const std::shared_ptr<const Peer> peer = std::move(action.to);  // not kept: its owners would be counted when they are in no cache
    job.to = ParseNumber<Node>(peer->images_endpoint).value();
    job.receiver = peer->worker;
  }
  const Action& ordered = job.action.template emplace<Action>(std::move(action));
  if (const std::optional<WorkCost> cost = conditions_.Begin(job)) {
    lanes_.Add({.lane = LaneOf(ordered), .worker = node, .job = place, .cost = *cost}, now());
  } else {
    queue_.TellAt(now(), 2 * place);
  }
  return place;
}

void SimulatedService::OnWorked(const LaneTask& task) {
  conditions_.OnWorked(JobAt(task.job), task);
  if (task.cost.direct) return Finish(task.job);
  queue_.TellAt(threads_.Begin(Threads::Machine(task.worker), now()), 2 * task.job);
}

// The thread that owns the sockets learns that the job is done.
void SimulatedService::Finish(std::uint32_t place) {
  Job& job = JobAt(place);
  const Node node = job.node;
  if (workers_[node].alive && now() < workers_[node].held) return queue_.TellAt(workers_[node].held, 2 * place);
  if (workers_[node].alive && std::holds_alternative<SendPartial>(job.action)) return SendToPeer(place);
  unused_jobs_.push_back(place);
  if (!workers_[node].alive) return;
  if (auto* frame = std::get_if<SendFrame>(&job.action)) {
    return SendToCoordinator(node, std::move(frame->message), TakePayload(job));
  }
  if (std::holds_alternative<StartRender>(job.action)) {
    std::erase_if(workers_[node].renders, [place](const auto& render) { return render.second == place; });
  }
  StepWorker(node, conditions_.Answer(job));
}

void SimulatedService::SendToCoordinator(Node from, WorkerToCoordinator message, const Bytes& payload) {
  const Arrivals arrivals = conditions_.ToCoordinator(from, message);
  for (int i = 0; i < arrivals.count; ++i) {
    queue_.At(threads_.Begin(Threads::kCoordinator, arrivals.times[i]), [this, from, message, payload] {
      StepCoordinator(FromWorker{TokenOf(from), message, payload});
    });
  }
}

void SimulatedService::SendToPeer(std::uint32_t place) {
  Job& job = JobAt(place);
  const Arrivals arrivals = conditions_.ToPeer(job.to, job);
  job.copies = std::uint8_t(arrivals.count);
  if (arrivals.nobody) queue_.At(now(), [this, node = job.node, who = job.receiver] { StepWorker(node, PeerUnreachable{who}); });
  if (arrivals.count == 0) return unused_jobs_.push_back(place);
  for (int i = 0; i < arrivals.count; ++i)
    queue_.TellAt(threads_.Begin(Threads::Machine(job.to), arrivals.times[i]), 2 * place + 1, job.to);
}

void SimulatedService::Deliver(std::uint32_t place) {
  Job& job = JobAt(place);
  auto& message = std::get<SendPartial>(job.action).message;
  const Node to = job.to;
  queue_.NextOf(to);
  if (--job.copies > 0) return StepWorker(to, MessageReceived{message, job.payload ? *job.payload : Bytes()});
  MessageReceived received{std::move(message), TakePayload(job)};
  unused_jobs_.push_back(place);
  StepWorker(to, std::move(received));
}

}  // namespace slabstream
