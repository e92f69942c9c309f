// ModelWorker: a worker process without sockets, threads, voxels and pixels. It runs a WorkerMachine and carries out its actions in virtual
// time: one thread renders, one combines, encodes and unpacks, one makes finished pictures; images are symbolic.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "simulator/event_queue.h"
#include "tests/simulator/alarm.h"
#include "tests/simulator/faults.h"
#include "tests/support/symbolic_images.h"
#include "worker/worker_machine.h"

namespace slabstream {

// Where a worker's messages go.
class WorkerNetwork {
 public:
  virtual ~WorkerNetwork() = default;
  virtual void ToCoordinator(int worker_node, AnyMessage message, Bytes payload) = 0;
  virtual void ToSlabServer(int worker_node, ChunkRequest request) = 0;
  virtual void ToPeer(int worker_node, const Peer& to, PartialImage message, Bytes payload) = 0;
};

struct WorkerSpeed {
  Duration render{}, combine{}, store{}, finish{};
};

class ModelWorker {
 public:
  ModelWorker(int node, WorkerConfig config, const WorkerSpeed& speed, const Faults& faults, Random& random, EventQueue<Time>& queue,
              WorkerNetwork& network);

  void Start();
  void Kill() { alive_ = false; }
  void Deliver(const AnyMessage& message, const Bytes& payload) { Step(MessageReceived{message, payload}); }
  void TellPeerUnreachable(WorkerId worker) { Step(PeerUnreachable{worker}); }

  bool alive() const { return alive_; }
  bool stopped() const { return stopped_; }
  const WorkerMachine& machine() const { return machine_; }
  const WorkerConfig& config() const { return config_; }
  std::size_t images() const { return images_.size(); }

 private:
  struct Outstanding {
    std::uint64_t bytes = 0;
    Time requested;
  };
  using ChunkName = std::tuple<DatasetId, Box, std::uint32_t>;

  void Step(const WorkerEvent& event);
  void Wake();
  // When a thread that was busy until `free` is done with this work, which begins after all before it.
  Time After(Time& free, Duration work) const;
  Time CombineThread(Duration work) { return After(combine_thread_free_, work); }

  void Perform(const SendControl& action);
  void Perform(const SendChunkRequest& action);
  void Perform(const ConnectSlabs&) {}
  void Perform(const OpenSlab& action);
  void Perform(const StoreChunk& action);
  void Perform(const DropSlab& action);
  bool Complete(const SlabKey& key) const;
  void Perform(const StartRender& action);
  void Perform(const CancelRender& action);
  void Perform(const StartCombine& action);
  void Perform(const FindHidden& action);
  void Perform(const SendPartial& action);
  void Perform(const SendFrame& action);
  void Perform(const ReleaseImage& action) { images_.Release(action.image); }
  void Perform(const StopProcess&);

  void FinishRender(std::uint64_t number, Status status, Duration time);
  void CheckCredit();

  const int node_;
  const WorkerConfig config_;
  const WorkerSpeed speed_;
  const Faults& faults_;
  Random& random_;
  EventQueue<Time>& queue_;
  WorkerNetwork& network_;
  WorkerMachine machine_;
  Alarm alarm_;
  bool alive_ = true, stopped_ = false;
  int idle_wakes_ = 0;  // wakes without time going on

  SymbolicImages images_;
  std::optional<StartRender> rendering_;
  std::uint64_t render_number_ = 0;
  Time combine_thread_free_, finish_thread_free_;
  struct ModelSlab {
    std::map<Box, std::set<std::uint32_t>> chunks;  // stored, by box
    std::vector<OpenSlab::Copy> copied;
    bool rendered = false;
  };
  std::map<SlabKey, ModelSlab> slabs_;          // that are open
  std::map<ChunkName, Outstanding> requested_;  // and not yet stored, as the credit counts
};

}  // namespace slabstream
