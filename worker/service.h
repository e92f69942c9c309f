// WorkerService: runs a WorkerMachine over ZeroMQ.
//
// One thread owns all sockets and runs the machine; those of the Executor compute. So heartbeats are on time whatever is computed. If a
// task throws, its group fails, and the coordinator is told at once. If the thread that runs the machine throws, the worker leaves and logs
// why.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "common/transport/socket.h"
#include "worker/executor.h"
#include "worker/image_packing.h"
#include "worker/renderers/renderer.h"
#include "worker/worker_machine.h"

namespace slabstream {

struct WorkerOptions {
  std::string coordinator_endpoint;  // its worker endpoint
  std::string images_endpoint;       // bound; empty: any port of the coordinator's scheme (tcp), a path of its own (ipc), a name (inproc)
  Compression compression = Compression::kAuto;
  bool share_memory = true;  // lend images to workers of this host
  RendererFactory make_renderer = MakeRenderer;
  TaskHook task_hook;  // of the executor, and for "send"
  // Start fills in incarnation, pid, host, images_endpoint, memory_scope, lends_memory. threads: [1, kMaxThreads].
  WorkerConfig machine;
};

class WorkerService {
 public:
  static Result<std::unique_ptr<WorkerService>> Start(Context& context, WorkerOptions options);
  ~WorkerService();  // stops and joins

  // Returns once the coordinator has registered this worker for the first time, or the service has stopped.
  void WaitUntilRegistered();

  void RequestStop();
  void WaitUntilStopped();
  bool stopped() const;

 private:
  struct Impl;
  explicit WorkerService(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
