// Simulation: one coordinator, some workers and clients, and a network with faults, in virtual time, all of it decided by a seed. What must
// hold in every world is checked as it goes; failures are failures of the running test.
//
//   every request ends, with the right picture or with an error that says why, within a bound of virtual time
//   a picture (or preview) holds exactly the boxes of its plan (of its first groups), each once, in visibility order; behind an opaque one
//   some may be left out, but only where the frame's termination allows it
//   a mask of hidden tiles tells only of tiles that the groups in front hide, as the display worker at hand has accumulated them
//   all groups of a frame are of the same voxels, in every attempt, and those stay until its end, whatever becomes of the file
//   where only stores misbehave, errors say which store, and why
//   no image is left, read after its release or released twice; no padded box is rendered from before it is complete; credits are kept
//   no more groups are unfinished at a time than the window allows, but for two of each other client, nor of one frame with masks
//   where only workers come and go, processes and clocks stop, strangers talk, and few messages are lost: every frame is
//     finished, as long as a worker is there all the time
//   where everybody stops at once, or the coordinator's clock jumps, and nothing else: no frame needs a second attempt
//   where workers only leave with notice, and have the time for it: no box of a frame is rendered twice
//   where processes own the voxels: what model_owners.h says; a picture that lacks something says so; once all have left, nothing is left
//   without faults: no frame fails, none needs a second attempt, and voxels that a worker has had do not travel again
//   after the world has healed: every client gets a picture, at the first attempt; then the tables of all machines are as at rest
//
// simulation.cpp runs the world and checks it, troubles.cpp breaks it.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/planner/planner.h"
#include "simulator/conditions.h"
#include "simulator/simulated_service.h"
#include "tests/simulator/faults.h"
#include "tests/simulator/frame_witness.h"
#include "tests/simulator/hostile_words.h"
#include "tests/simulator/model_cells.h"
#include "tests/simulator/model_client.h"
#include "tests/simulator/model_owners.h"
#include "tests/simulator/model_worker.h"
#include "tests/simulator/network.h"
#include "tests/simulator/random_world.h"
#include "tests/simulator/tally.h"
#include "tests/support/machine_models.h"

namespace slabstream {

// Ends of links, and names of connections: workers 0, 1, ...; clients from kClientEnds on.
inline constexpr int kClientEnds = 1 << 20, kHostileClientEnds = kClientEnds + (1 << 10);
inline constexpr int kCoordinatorEnd = -1, kVoxelServerEnd = -2;

class Simulation : private Conditions {
 public:
  // `owned`: processes own the voxels of the dataset.
  Simulation(std::uint64_t seed, bool owned, Tally& tally);
  void Run();

 private:
  struct HostilePeer {
    HostileWords::Speaker self;
    bool worker = false;  // it registers; else it is a stranger
  };

  // ---- the world
  void AddWorker(Duration after);
  Node AddNode();
  void AddClient();
  void StartCoordinator();
  void Submit(ModelClient& client, RequestId request);
  bool Idle() const;     // every request has ended
  bool Working() const;  // some worker does something, for whatever attempt it was

  // ---- what breaks
  void PlanTroubles(Duration span);
  std::vector<Node> Running() const;  // workers that are alive and do not stand still
  std::vector<Node> Staying() const;  // those that were not told to leave
  void TellWorkerToLeave();
  void KillWorker(Node victim);
  void KillSomeWorker();
  void Preempt();
  void RestartCoordinator();
  void PauseWorker(double seconds);
  void Suspend(double seconds);
  void Cut();
  void AddHostilePeer(bool worker, Duration span);
  Arrivals HearAsHostile(HostilePeer& peer, const CoordinatorToWorker& message);
  void Speak(HostilePeer& peer);
  void SpeakAsClient(std::size_t hostile);
  void BeatOf(HostilePeer& peer);
  bool IsHostile(Node node) const { return hostile_peers_.contains(node); }
  void ChangeFile();
  void OrderData();
  void SendVolume();
  void SendParts(const VolumeCredit& credit);
  PeerToken Admin() const { return TokenOfClient(clients_.size() + 1); }
  void Heal();

  // ---- what must hold
  void RunUntil(Duration from_now, bool until_idle);
  void CheckOutcome();
  void CheckRecovery();
  void CheckRest();
  void CheckTables();
  void CheckOwnersLeft();
  void CheckOwned(const FrameReply& reply, FrameId frame, PeerToken to);
  PeerToken TokenOfClient(std::size_t client) const;
  // In any variant of messages: what the other end would decode.
  template <class Messages>
  Messages OnTheWay(const Messages& message) const;
  void FromClientNode(std::size_t client, const ClientToFrames& message);
  void AskDatasets(PeerToken client, const ClientToDatasets& message, const Bytes& payload = {});
  VoxelsToWorker AnswerOf(const ChunkRequest& request);
  void SendVoxels(Node node, const VoxelsToWorker& voxels);
  bool ReadsItself(Node node, const StoredAt& stored);
  std::optional<double> SecondsToRead();  // none: the read never ends
  VoxelsToWorker ReadOf(const ChunkRequest& request);
  Chunk ChunkOf(const ChunkRequest& request);

  // ---- Conditions
  using Conditions::Perform;
  std::optional<WorkCost> Begin(Job& job) override { return workers_[job.node].Begin(job); }
  WorkerEvent Answer(Job& job) override;
  bool CancelsInTime() override { return random_.Chance(0.7); }
  void Perform(Node node, SendChunkRequest& action) override;
  void Perform(Node node, const DrawTiles& action) override;
  void Perform(Node node, const OpenBox& action) override { workers_[node].Perform(action); }
  void Perform(Node node, const DropBox& action) override { workers_[node].Perform(action); }
  void Perform(Node node, const ReleaseImage& action) override { workers_[node].Perform(action); }
  void Perform(Node node, const StopProcess& action) override { workers_[node].Perform(action); }
  void AfterStep(Node node) override { workers_[node].CheckCredit(); }
  Arrivals ToWorker(Node to, CoordinatorToWorker& message, double sent) override;
  Arrivals ToCoordinator(Node from, WorkerToCoordinator& message) override;
  Arrivals ToPeer(Node to, Job& sends) override;
  void BeforeStep(const FrameEvent& event) override { cause_ = &event; }
  void Perform(ToClient& action) override;
  void Perform(const ToDatasets& action) override { StepDatasets(action); }
  void Perform(const CountDataset& action) override;
  void Perform(const PlanRequest& action) override;
  void Perform(const FrameMeasured& action) override { planner_->Learn(action); }

  // ---- datasets
  void StepDatasets(const DatasetEvent& event);
  void TellDatasets(double when, DatasetEvent event);  // at `when`, if it is still the same coordinator
  void Perform(const DatasetNews& action) { service_.StepCoordinator(action); }
  void Perform(const Note&) {}
  void Perform(const LoadDataset& action);
  void Perform(const UnloadDataset& action);
  void Perform(const CheckDatasetFiles& action);
  void Perform(const CheckWatchedFolders& action);
  void Perform(const FindDatasets& action);
  void Perform(const AnswerQuestion& action);
  void Perform(const BeginUpload& action);
  void Perform(const StoreUpload& action);
  void Perform(const DropUpload& action) { stored_.erase(action.upload); }
  void Perform(const FinishUpload& action);

  Random random_;
  Tally& tally_;
  const Faults faults_;
  Faults current_;  // none once the world has healed
  FaultyNetwork network_;
  const bool encode_messages_;  // in a few worlds messages are encoded and decoded on their way
  bool workerless_ = false;     // for a moment no worker was running
  const ModelCells cells_;
  const SimulatedWorld world_;
  int most_teams_ = world_.policy.teams;  // teams that a client, which may be hostile, has asked for: each has a window of its own
  FrameWitness witness_;
  const MachineModel machine_ = WithoutDelays();  // what takes how long is up to the world
  SimulatedService service_;
  std::optional<Planner> planner_;          // the coordinator's planner
  std::optional<DatasetMachine> datasets_;  // the coordinator's second machine
  Time datasets_wake_;                      // the wake-up that was planned last
  Epoch epoch_ = 0;                         // the coordinator's epoch
  std::deque<ModelWorker> workers_;         // by node
  std::vector<std::unique_ptr<ModelClient>> clients_;
  std::set<Node> told_dead_;                      // workers whose death the sockets notice
  std::map<Node, double> leaving_;                // workers that were told to leave, and when
  bool hurried_ = false;                          // one left before its work was done: its time was over
  std::set<std::pair<FrameId, BoxId>> rendered_;  // in gentle worlds
  std::map<Node, HostilePeer> hostile_peers_;
  HostileWords words_;
  std::size_t requests_planned_ = 0, requests_made_ = 0;
  const FrameEvent* cause_ = nullptr;  // what the coordinator deals with
  std::optional<StatusReply> status_;
  DatasetId voxels_ = 1;  // the voxels that the volume's file holds now
  // The volume that the admin sends, and what the executor has stored of volumes.
  struct Sending {
    std::uint64_t nonce = 0, sent = 0, bytes = 0;
  } sending_;
  struct Stored {
    std::uint64_t bytes = 0, expected = 0;
  };
  std::map<UploadId, Stored> stored_;
  std::set<DatasetId> published_;  // by the voxel server
  std::optional<ModelOwners> owners_;
  std::map<FrameId, DatasetId> datasets_of_frames_;  // of this epoch, with owners
  // Where a volume that is read in parts is open: who sees which version of its file there, and since when.
  std::map<std::pair<Node, std::uint64_t>, std::optional<double>> places_;
};

}  // namespace slabstream
