// CoordinatorService: runs a FrameMachine and a DatasetMachine over ZeroMQ. Binds the client, control and voxels planes, loads datasets,
// serves voxels.
//
// Threads: one owns the client and control sockets and runs the machines; one owns the voxels socket, cuts and packs chunks; and those of
// BackgroundActions. If the machines' own thread throws, open requests fail with the reason and the service stops.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "common/base/status.h"
#include "common/transport/socket.h"
#include "coordinator/frames/frame_machine.h"
#include "coordinator/planner/planner.h"
#include "coordinator/service/background_actions.h"
#include "data/catalogue/catalogue.h"

namespace slabstream {

struct CoordinatorOptions {
  std::string client_endpoint;    // bound; a wildcard port is read back
  std::string worker_endpoint;    // bound; empty: WorkerEndpointFor(client_endpoint)
  std::string voxels_endpoint;    // bound; empty: any port, ".voxels" beside an ipc path or inproc name
  std::string keys_folder;        // its keys encrypt tcp connections (KeyFolder); empty: none, the service stays on this machine
  Catalogue catalogue;            // datasets
  std::set<std::string> folders;  // folders that are watched (FoundData)
  Codec codec = Codec::kRaw;      // how voxels travel to workers; zstd pays if the link is slower than packing
  CoordinatorConfig machine;      // filled in by Start: epoch, pid, voxels_endpoint
  PlanFunction make_plan = &Planner::Plan;
  CountFunction count_occupied = CountOccupied;
};

class CoordinatorService {
 public:
  // Binds and starts the threads. `context` must outlive the service. InvalidArgument: an endpoint; Unavailable: it is taken.
  static Result<std::unique_ptr<CoordinatorService>> Start(Context& context, CoordinatorOptions options);
  // Stops. Does not wait for a load, count or plan that is running (BackgroundTasks): what the catalogue's loaders use must outlive them.
  ~CoordinatorService();

  const std::string& client_endpoint() const;  // with the port that was chosen
  const std::string& worker_endpoint() const;

  std::string MetricsText();  // for Prometheus; from any thread

  std::shared_ptr<const HeldVoxels> FindHeld(DatasetId dataset);  // for workers of this process, from any thread, as FindHeldVoxels

  void RequestStop();       // from any thread or a signal-handling one; returns at once
  void WaitUntilStopped();  // until RequestStop or a client's ShutDown has been carried out
  bool stopped() const;

 private:
  struct Impl;
  explicit CoordinatorService(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
