// Simulation: one coordinator, some workers and clients, and a network with faults, in virtual time, all of it decided by a seed. What must
// hold in every world is checked as it goes; failures are failures of the running test.
//
//   every request ends, with the right picture or with an error that says why, within a bound of virtual time
//   a picture (or preview) holds exactly the boxes of its plan (of its first groups), each once, in visibility order; behind an opaque one
//   some may be left out, but only where the frame's termination allows it
//   a mask of hidden tiles tells only of tiles that the groups in front hide, as the display worker at hand has accumulated them
//   no image is left, read after its release or released twice; no slab is rendered from before it is complete; credits are kept
//   no more groups are unfinished at a time than the window allows, nor of one frame with masks
//   where only workers come and go and few messages are lost, but a worker is always there: every frame is finished
//   without faults: no frame fails, none needs a second attempt, and voxels that a worker has had do not travel again
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "coordinator/frame_machine.h"
#include "coordinator/planner.h"
#include "simulator/event_queue.h"
#include "tests/simulator/alarm.h"
#include "tests/simulator/faults.h"
#include "tests/simulator/frame_witness.h"
#include "tests/simulator/model_client.h"
#include "tests/simulator/model_worker.h"
#include "tests/simulator/network.h"
#include "tests/simulator/random_world.h"
#include "tests/simulator/tally.h"

namespace slabstream {

class Simulation : private WorkerNetwork {
 public:
  Simulation(std::uint64_t seed, Tally& tally);
  ~Simulation() override;
  void Run();

 private:
  struct Coordinator {
    FrameMachine machine;
    Planner planner;
    Epoch epoch = 0;
    Alarm alarm;
    std::uint64_t generation = 0;
    bool alive = true;
    int idle_wakes = 0;
  };
  // ---- the world
  void AddWorker(Duration after);
  void KillWorker();
  void StartCoordinator();
  void RestartCoordinator();
  void PlanTroubles(Duration span);
  bool Idle() const;
  void RunUntil(Time bound, bool until_idle);
  void CheckOutcome();
  void CheckRest();

  // ---- the coordinator
  void StepCoordinator(const CoordinatorEvent& event);
  void WakeCoordinator();
  void Perform(const CoordinatorEvent& event, const ToWorker& action);
  void Perform(const CoordinatorEvent& event, const ToClient& action);
  void Perform(const CoordinatorEvent& event, const LoadDataset& action);
  void Perform(const CoordinatorEvent& event, const CountDataset& action);
  void Perform(const CoordinatorEvent& event, const PlanRequest& action);
  void Perform(const CoordinatorEvent&, const DropPlan&) {}
  void Perform(const CoordinatorEvent&, const FrameMeasured& action) { coordinator_->planner.Learn(action); }
  void Perform(const CoordinatorEvent& event, const StopService&);

  // ---- messages
  AnyMessage OnTheWay(const AnyMessage& message) const;
  void ToCoordinator(int node, AnyMessage message, Bytes payload) override;
  void ToSlabServer(int node, ChunkRequest request) override;
  void ToPeer(int node, const Peer& to, PartialImage message, Bytes payload) override;
  void FromClientNode(int client, AnyMessage message);
  // Names of connections: a restarted coordinator sees new ones.
  PeerToken TokenOf(int node) const { return PeerToken(coordinator_->generation) << 32 | std::uint32_t(node); }
  static int NodeOf(PeerToken token) { return int(token & 0xffffffffU); }

  Random random_;
  Tally& tally_;
  EventQueue<Time> queue_{Time(std::chrono::seconds(1000))};
  Faults faults_;
  FaultyNetwork network_;
  const bool encode_messages_;  // in a few worlds messages are encoded and decoded on their way
  bool workerless_ = false;     // for a moment no worker was alive
  const World world_;
  FrameWitness witness_;
  std::unique_ptr<Coordinator> coordinator_;
  std::vector<std::unique_ptr<Coordinator>> dead_coordinators_;  // events that are still planned refer to them
  std::vector<std::unique_ptr<ModelWorker>> workers_;            // by node
  std::vector<std::unique_ptr<ModelClient>> clients_;
  std::set<int> told_dead_;  // worker nodes whose death the sockets notice
  std::size_t requests_planned_ = 0, requests_made_ = 0;
  std::optional<StatusReply> status_;
};

}  // namespace slabstream
