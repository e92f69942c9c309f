// WorkerService: runs a WorkerMachine over ZeroMQ.
//
// One thread owns all sockets and runs the machine; those of the Executor compute. So heartbeats are on time during any computation. If a
// task throws, its group fails, and the coordinator is told at once. If the thread that runs the machine throws, or the coordinator refuses
// the worker's key, the worker leaves and logs why.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/transport/socket.h"
#include "data/sources/held_voxels.h"
#include "worker/machine/worker_machine.h"
#include "worker/renderers/renderer.h"
#include "worker/service/executor.h"

namespace slabstream {

struct WorkerOptions {
  std::string coordinator_endpoint;  // its worker endpoint
  std::string images_endpoint;       // bound; empty: any port on the way to the coordinator (tcp), a path of its own (ipc), a name (inproc)
  bool share_memory = true;          // lend images to workers of this host
  FindHeldVoxels find_held = {};     // finds voxels that a coordinator of this process holds, which are read in place; empty: there is none
  RendererFactory make_renderer = MakeRenderer;
  TaskHook task_hook;                             // called for the executor's tasks, and for "send"
  std::optional<ClientKeys> keys = std::nullopt;  // the worker's keys; none: the service has no keys
  // Start fills in incarnation, pid, host, images_endpoint, images_key, memory_scope, lends_memory. threads: [1, kMaxThreads].
  WorkerConfig machine;
};

class WorkerService {
 public:
  static Result<std::unique_ptr<WorkerService>> Start(Context& context, WorkerOptions options);
  ~WorkerService();  // stops and joins

  const std::string& images_endpoint() const;  // where other workers send images at first, with the port that was chosen

  std::string MetricsText();  // for Prometheus; from any thread

  // Returns once the coordinator has registered this worker for the first time, or the service has stopped.
  void WaitUntilRegistered();

  // From any thread or a signal handler; return at once.
  void RequestLeave();  // ends when no frame needs it, after the machine's `drain` at the latest. The second time: like RequestStop
  void RequestStop();   // ends now
  void WaitUntilStopped();
  bool stopped() const;
  Status ended() const;  // not ok: why it stopped though nobody told it to

 private:
  struct Impl;
  explicit WorkerService(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
