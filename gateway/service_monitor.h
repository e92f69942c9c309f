// ServiceMonitor: asks the service how it is, once a second, on a thread of its own.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "client/client.h"
#include "common/base/status.h"

namespace slabstream {

enum class ServiceHealth : std::uint8_t { kReady, kNoWorkers, kGone };
std::string_view NameOf(ServiceHealth health);  // "ready", "no-workers", "gone"

// What is known of the service.
struct ServiceNews {
  ServiceHealth health = ServiceHealth::kGone;
  std::string reason = "not asked yet";  // empty if it is ready
  StatusReply status;                    // the last answer, kept when the service is gone
};

class ServiceMonitor {
 public:
  using Listener = std::function<void(std::shared_ptr<const ServiceNews>)>;

  // `context` must outlive it. `listener` is called on the monitor's thread after each answer, and when there was none.
  ServiceMonitor(Context& context, ServiceAddress address, Listener listener);
  ~ServiceMonitor();
  void RequestStop();  // any thread, returns at once: the thread begins to end
  ServiceMonitor(const ServiceMonitor&) = delete;
  ServiceMonitor& operator=(const ServiceMonitor&) = delete;

 private:
  void Run();
  Result<StatusReply> Ask();

  Context& context_;
  const ServiceAddress address_;
  const Listener listener_;
  std::mutex mutex_;
  std::unique_ptr<Client> client_;  // made and used by the monitor's thread; others use its wakeup only, under the mutex
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace slabstream
