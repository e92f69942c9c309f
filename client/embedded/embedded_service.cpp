#include "client/embedded/embedded_service.h"

#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr int kMaxEmbeddedWorkers = 256;

// Names within one process: several embedded services may share a context.
std::string UniqueEndpoint() {
  static std::atomic<std::uint64_t> count = 0;
  return "inproc://slabstream-" + std::to_string(++count);
}

}  // namespace

struct EmbeddedService::Impl {
  Context& context;
  WorkerConfig worker_config;
  std::unique_ptr<CoordinatorService> coordinator;
  std::vector<std::unique_ptr<WorkerService>> workers;
};

Result<std::unique_ptr<EmbeddedService>> EmbeddedService::Start(Context& context, EmbeddedOptions options) {
  if (options.workers < 1 || options.workers > kMaxEmbeddedWorkers) {
    return Status::InvalidArgument("workers " + std::to_string(options.workers) + " is out of range [1, " +
                                   std::to_string(kMaxEmbeddedWorkers) + "]");
  }
  options.coordinator.client_endpoint = UniqueEndpoint();
  options.coordinator.worker_endpoint = UniqueEndpoint();
  options.coordinator.slabs_endpoint = UniqueEndpoint();
  Result<std::unique_ptr<CoordinatorService>> coordinator = CoordinatorService::Start(context, std::move(options.coordinator));
  if (!coordinator.ok()) return coordinator.status();
  auto impl = std::make_unique<Impl>(Impl{context, std::move(options.worker), std::move(*coordinator), {}});
  std::unique_ptr<EmbeddedService> service(new EmbeddedService(std::move(impl)));
  for (int i = 0; i < options.workers; ++i) {
    if (Status status = service->AddWorker(); !status.ok()) return status;
  }
  // So that the first frame is planned for all of them, not only for those that happen to be quick.
  for (const auto& worker : service->impl_->workers) worker->WaitUntilRegistered();
  return service;
}

EmbeddedService::EmbeddedService(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

EmbeddedService::~EmbeddedService() {
  // All at once rather than in sequence: each waits for its running tasks.
  for (const auto& worker : impl_->workers) worker->RequestStop();
  impl_->coordinator->RequestStop();
}

const std::string& EmbeddedService::endpoint() const { return impl_->coordinator->client_endpoint(); }

WorkerService& EmbeddedService::worker(int index) {
  CHECK(index >= 0 && std::size_t(index) < impl_->workers.size()) << "worker " << index;
  return *impl_->workers[std::size_t(index)];
}

Status EmbeddedService::AddWorker() {
  WorkerOptions options;
  options.coordinator_endpoint = impl_->coordinator->worker_endpoint();
  options.machine = impl_->worker_config;
  Result<std::unique_ptr<WorkerService>> worker = WorkerService::Start(impl_->context, std::move(options));
  if (!worker.ok()) return worker.status();
  impl_->workers.push_back(std::move(*worker));
  return Status::Ok();
}

}  // namespace slabstream
