// SimulatedService: the machines of a coordinator and its workers in virtual time, as the service runs them with threads and sockets. It
// steps a machine when something happens to it and wakes it when it asks for that; passes messages; and has each worker's threads do what
// the machine starts. Conditions say what comes of all this, and when.
//
// Everything that happens is an event at a time: a message arrives, or a thread is done. The machine concerned takes one step, and its
// actions become messages and jobs. Threads that hand something over wake each other (Threads).
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/any_of.h"
#include "simulator/conditions.h"
#include "simulator/event_queue.h"
#include "simulator/threads.h"
#include "simulator/worker_lanes.h"

namespace slabstream {

class SimulatedService {
 public:
  // Both outlive the object. It uses the machine's cores, the wake-ups and message_seconds.
  SimulatedService(const MachineModel& machine, Conditions& conditions);

  EventQueue& queue() { return queue_; }
  double now() const { return queue_.now(); }
  Time time() const { return TimeAt(now()); }  // as machines see it
  // When the next event is due; infinity: nothing more happens.
  double next();
  void RunNext();

  // ---- the coordinator
  void StartCoordinator(CoordinatorConfig config);  // in place of the last one, whose connections are gone
  void StopCoordinator() { coordinator_runs_ = false; }
  bool coordinator_runs() const { return coordinator_runs_; }
  const FrameMachine& coordinator() const { return *coordinator_; }
  double coordinator_free() const { return coordinator_free_; }  // its thread has done what it has heard of
  double coordinator_held() const { return coordinator_held_; }  // until then it stands still
  Time coordinator_time() const { return time() + coordinator_ahead_; }
  // At `when`, if it is still the same coordinator.
  void TellCoordinator(double when, FrameEvent event);
  void StepCoordinator(const FrameEvent& event);
  // Names of connections of the coordinator at hand.
  PeerToken TokenOf(Node node) const { return generation_ << 32U | node; }
  std::optional<Node> NodeOf(PeerToken token) const;

  // ---- workers
  Node AddWorker(WorkerConfig config);  // its images_endpoint is its node
  void KillWorker(Node node) { workers_[node].alive = false; }
  bool alive(Node node) const { return workers_[node].alive; }
  const WorkerMachine& worker(Node node) const { return workers_[node].machine; }
  void StepWorker(Node node, WorkerEvent&& event);
  bool Idle(Node node, Lane lane) const { return lanes_.Idle(node, lane); }
  // The process stands still until `until`: what happens to it meanwhile happens then, in order.
  void HoldCoordinator(double until) { coordinator_held_ = std::max(coordinator_held_, until); }
  void HoldWorker(Node node, double until) { workers_[node].held = std::max(workers_[node].held, until); }
  bool Held(Node node) const { return now() < workers_[node].held; }
  // The coordinator's clock jumps forward, and stays ahead.
  void JumpCoordinator(Duration by);

  // How often in a row a machine asked to be woken at once, the coordinator's included.
  int spins() const { return spins_; }

  Threads& threads() { return threads_; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  struct Worker {
    WorkerMachine machine;
    bool alive = true;
    double alarm = kNever;                                            // planned
    double held = 0;                                                  // until then it stands still
    std::vector<std::pair<ImageHandle, std::uint32_t>> renders = {};  // jobs, paused ones included
  };

  static Time TimeAt(double seconds);
  static double SecondsAt(Time time);
  void SetAlarm(double& alarm, Time wake, auto&& ring);
  // Events of jobs, by number: 2 * place, or more by one if its message arrives rather than its thread is done.
  void OnNumber(std::uint32_t number) { number % 2 == 0 ? Finish(number / 2) : Deliver(number / 2); }
  Time CoordinatorWake() const;  // as others see time
  void SetCoordinatorAlarm();
  void WakeCoordinator(std::uint64_t generation);
  void WakeWorker(Node node);
  void CountSpin(bool due) { spins_ = due ? spins_ + 1 : 0; }

  void Perform(TellWorkers& action);
  void SendWorker(PeerToken to, CoordinatorToWorker sent);
  void Perform(AnyOf<DropPlan, DropClient, Note> auto&) {}
  void Perform(StopService&) { StopCoordinator(); }
  void Perform(auto& action) { conditions_.Perform(action); }

  void Perform(Node node, SendControl& action) { SendToCoordinator(node, std::move(action.message), {}); }
  void Perform(Node, AnyOf<ConnectVoxels, ResendImage, AnswerPeer, AdmitKeys, ForgetGroups, KeepTiles> auto&) {}
  void Perform(Node node, StartRender& action) {
    const ImageHandle image = action.image;
    const std::uint32_t place = Order(node, action);
    workers_[node].renders.emplace_back(image, place);
  }
  void Perform(Node node, PauseRender& action);
  void Perform(Node node, ResumeRender& action);
  void Perform(Node node, CancelRender& action);
  std::optional<std::uint32_t> RenderOf(Node node, ImageHandle image) const;  // its job's place; nothing: it has ended
  void Perform(Node node, AnyOf<StoreChunk, StartCombine, FindHidden, SendPartial, SendFrame> auto& action) { Order(node, action); }
  void Perform(Node node, auto& action) { conditions_.Perform(node, action); }

  template <class Action>
  std::uint32_t Order(Node node, Action& action);  // the job's place
  static Lane LaneOf(const auto&) { return Lane::kCombine; }
  static Lane LaneOf(const StartRender&) { return Lane::kRender; }
  static Lane LaneOf(const SendFrame& frame);
  Job& JobAt(std::uint32_t place) { return jobs_[place / kChunk][place % kChunk]; }
  void OnWorked(const LaneTask& task);
  void Finish(std::uint32_t place);
  void SendToCoordinator(Node from, WorkerToCoordinator message, const Bytes& payload);
  void SendToPeer(std::uint32_t place);
  void Deliver(std::uint32_t place);

  const MachineModel& machine_;
  Conditions& conditions_;
  EventQueue queue_;
  Threads threads_;
  WorkerLanes lanes_;
  std::unique_ptr<FrameMachine> coordinator_;
  bool coordinator_runs_ = false;
  std::uint64_t generation_ = 0;  // the coordinator's generation
  double coordinator_free_ = 0, coordinator_alarm_ = kNever;
  double coordinator_held_ = 0;
  Duration coordinator_ahead_{};             // its clock's
  std::deque<Worker> workers_;               // by node
  WorkerActions actions_;                    // memory for those of a step
  static constexpr std::size_t kChunk = 64;  // jobs: the table of chunks stays small, and no job ever moves
  std::vector<std::unique_ptr<Job[]>> jobs_;
  std::vector<std::uint32_t> unused_jobs_;  // places: a direct send of p ranks has p^2 of them
  int spins_ = 0;
};

}  // namespace slabstream
