// Conditions: all that the machines of a simulated service do not decide. How long work takes and what it gives; when messages arrive, and
// whether; what clients do; what a dataset holds. Costs stand behind one kind of simulation (FrameSimulation), faults behind another (the
// tests). Every function is called at the virtual time at which it happens.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>

#include "coordinator/frames/frame_machine.h"
#include "simulator/worker_lanes.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

// What a thread of a worker does. It stays until its result, or the last copy of its message, has arrived. In whole cache lines: there may
// be a million, and each is looked at when the others have filled the caches.
struct alignas(64) Job {
  Node node = 0;                 // its worker
  std::uint8_t copies = 0;       // copies of the message that it sends, which have not arrived
  bool cancelled = false;        // its rendering, in time
  Node to = 0;                   // the worker to which its message goes
  WorkerId receiver = 0;         // that worker, as the sender knows it
  double bytes = 0, pixels = 0;  // what links carry for that message; its pixels that are not empty
  Rare<Bytes> payload;           // what the message that it sends carries; none: it has no bytes
  std::variant<StartRender, StoreChunk, StartCombine, FindHidden, SendPartial, SendFrame> action;
};

// When copies of a message arrive: at most two.
struct Arrivals {
  std::array<double, 2> times{};
  int count = 0;
  bool nobody = false;  // the sender learns at once that nobody is there

  static Arrivals At(double time) { return {{time}, 1}; }
};

class Conditions {
 public:
  virtual ~Conditions() = default;

  // ---- workers
  // The job is ordered. Fills in what it sends. No cost: it is done now, by no thread.
  virtual std::optional<WorkCost> Begin(Job& job) = 0;
  virtual void OnWorked(const Job&, const LaneTask&) {}  // its thread is done with it, now
  // The answer to StartRender, StoreChunk, StartCombine or FindHidden.
  virtual WorkerEvent Answer(Job& job) = 0;
  virtual bool CancelsInTime() { return false; }  // a rendering that is to be cancelled: it ends now
  virtual void Perform(Node node, SendChunkRequest& action) = 0;
  virtual void Perform(Node, const DrawTiles&) {}
  virtual void Perform(Node, const OpenBox&) {}
  virtual void Perform(Node, const DropBox&) {}
  virtual void Perform(Node, const ReleaseImage&) {}
  virtual void Perform(Node, const StopProcess&) {}
  virtual void AfterStep(Node) {}

  // ---- messages. They may be changed on their way; the coordinator's leave at `sent`
  virtual Arrivals ToWorker(Node to, CoordinatorToWorker& message, double sent) = 0;
  virtual Arrivals ToCoordinator(Node from, WorkerToCoordinator& message) = 0;
  virtual Arrivals ToPeer(Node to, Job& sends) = 0;  // its SendPartial

  // ---- the coordinator
  virtual void BeforeStep(const FrameEvent&) {}
  virtual void Perform(ToClient& action) = 0;
  virtual void Perform(const ToDatasets& action) = 0;
  virtual void Perform(const CountDataset& action) = 0;
  virtual void Perform(const PlanRequest& action) = 0;
  virtual void Perform(const FrameMeasured&) {}
};

}  // namespace slabstream
