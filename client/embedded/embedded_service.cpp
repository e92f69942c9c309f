#include "client/embedded/embedded_service.h"

#include <atomic>
#include <cstdint>
#include <utility>

#include "common/base/check.h"
#include "common/memory/large_buffers.h"
#include "common/volume/memory_budget.h"
#include "data/stores/http_transfers.h"

namespace slabstream {
namespace {

constexpr int kMaxEmbeddedWorkers = 256;

// A process does not lose single threads, and what they send arrives. So silence only means that the machine is busy.
constexpr Duration kPatience = std::chrono::minutes(10);  // what a Welcome can say at most

// Names within one process: several embedded services may share a context.
std::string UniqueEndpoint() {
  static std::atomic<std::uint64_t> count = 0;
  return "inproc://slabstream-" + std::to_string(++count);
}

}  // namespace

Result<std::unique_ptr<EmbeddedService>> EmbeddedService::Start(Context& context, EmbeddedOptions options) {
  if (options.workers < 1 || options.workers > kMaxEmbeddedWorkers) {
    return Status::InvalidArgument("workers " + std::to_string(options.workers) + " is out of range [1, " +
                                   std::to_string(kMaxEmbeddedWorkers) + "]");
  }
  options.coordinator.client_endpoint = UniqueEndpoint();
  options.coordinator.worker_endpoint = UniqueEndpoint();
  options.coordinator.voxels_endpoint = UniqueEndpoint();
  KeepBlocks(KeptBytes(options.worker.memory_bytes == 0 ? MachineMemoryBytes() : options.worker.memory_bytes));
  CoordinatorConfig& machine = options.coordinator.machine;
  machine.web_traffic = HttpTransfers::TrafficOfProcess;  // the workers' too, which are of this process
  machine.worker_timeout = machine.client_timeout = machine.stall_timeout = options.worker.chunk_timeout = kPatience;
  Result<std::unique_ptr<CoordinatorService>> coordinator = CoordinatorService::Start(context, std::move(options.coordinator));
  if (!coordinator.ok()) return coordinator.status();
  std::unique_ptr<EmbeddedService> service(new EmbeddedService(context, std::move(options.worker), std::move(*coordinator)));
  for (int i = 0; i < options.workers; ++i) {
    if (Status status = service->AddWorker(); !status.ok()) return status;
  }
  // So that the first frame is planned for all of them, not only for those that happen to be quick.
  for (const auto& worker : service->workers_) worker->WaitUntilRegistered();
  return service;
}

EmbeddedService::EmbeddedService(Context& context, WorkerConfig worker_config, std::unique_ptr<CoordinatorService> coordinator)
    : context_(context), worker_config_(std::move(worker_config)), coordinator_(std::move(coordinator)) {}

EmbeddedService::~EmbeddedService() {
  // All at once rather than in sequence: each waits for its running tasks.
  for (const auto& worker : workers_) worker->RequestStop();
  coordinator_->RequestStop();
}

const std::string& EmbeddedService::endpoint() const { return coordinator_->client_endpoint(); }

Result<Client> EmbeddedService::Connect() const { return Client::Connect(context_, endpoint(), kPatience); }

WorkerService& EmbeddedService::worker(int index) {
  CHECK(index >= 0 && std::size_t(index) < workers_.size()) << "worker " << index;
  return *workers_[std::size_t(index)];
}

Status EmbeddedService::AddWorker() {
  WorkerOptions options;
  options.coordinator_endpoint = coordinator_->worker_endpoint();
  options.machine = worker_config_;
  options.find_held = [this](DatasetId dataset) { return coordinator_->FindHeld(dataset); };
  Result<std::unique_ptr<WorkerService>> worker = WorkerService::Start(context_, std::move(options));
  if (!worker.ok()) return worker.status();
  workers_.push_back(std::move(*worker));
  return Status::Ok();
}

}  // namespace slabstream
