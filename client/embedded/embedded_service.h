// EmbeddedService: the coordinator and workers as threads of this process, over inproc. For `--local` and for tests.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "common/base/status.h"
#include "common/transport/socket.h"
#include "coordinator/service/service.h"
#include "worker/service/service.h"

namespace slabstream {

struct EmbeddedOptions {
  int workers = 1;                 // [1, 256]
  CoordinatorOptions coordinator;  // endpoints and time-outs are filled in; the catalogue is used
  WorkerConfig worker;             // what each worker gets; its threads and budgets are used
};

class EmbeddedService {
 public:
  static Result<std::unique_ptr<EmbeddedService>> Start(Context& context, EmbeddedOptions options);
  ~EmbeddedService();

  const std::string& endpoint() const;  // for Client::Connect with the same context
  Result<Client> Connect() const;       // waits as long as it takes
  WorkerService& worker(int index);     // tests: RequestStop makes it leave
  Status AddWorker();                   // joins the running service

 private:
  EmbeddedService(Context& context, WorkerConfig worker_config, std::unique_ptr<CoordinatorService> coordinator);
  Context& context_;
  WorkerConfig worker_config_;
  std::unique_ptr<CoordinatorService> coordinator_;
  std::vector<std::unique_ptr<WorkerService>> workers_;
};

}  // namespace slabstream
