#include "gateway/service_monitor.h"

#include <utility>

namespace slabstream {
namespace {

constexpr Duration kEach = std::chrono::seconds(1);
constexpr Duration kPatience = std::chrono::seconds(2);  // for an answer
constexpr Duration kPauseWhenGone = std::chrono::milliseconds(250);

}  // namespace

std::string_view NameOf(ServiceHealth health) {
  switch (health) {
    case ServiceHealth::kReady: return "ready";
    case ServiceHealth::kNoWorkers: return "no-workers";
    case ServiceHealth::kGone: break;
  }
  return "gone";
}

ServiceMonitor::ServiceMonitor(Context& context, ServiceAddress address, Listener listener)
    : context_(context), address_(std::move(address)), listener_(std::move(listener)) {
  thread_ = std::thread([this] { Run(); });
}

ServiceMonitor::~ServiceMonitor() {
  RequestStop();
  thread_.join();
}

void ServiceMonitor::RequestStop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  stop_.notify_one();
  if (client_ != nullptr) client_->wakeup().Notify();
}

Result<StatusReply> ServiceMonitor::Ask() {
  if (client_ == nullptr) {
    Result<Client> client = Client::Connect(context_, address_, kPatience, {}, [this] {
      const std::lock_guard lock(mutex_);
      return stopping_;
    });
    if (!client.ok()) return client.status();
    const std::lock_guard lock(mutex_);
    if (stopping_) return Status::Cancelled("the gateway ends");
    client_ = std::make_unique<Client>(*std::move(client));
  }
  return client_->QueryStatus(kPatience);
}

void ServiceMonitor::Run() {
  ServiceNews news;
  while (true) {
    Result<StatusReply> reply = Ask();
    if (reply.ok()) {
      news.status = *std::move(reply);
      news.health = news.status.workers.empty() ? ServiceHealth::kNoWorkers : ServiceHealth::kReady;
      news.reason = news.status.workers.empty() ? "the service has no workers" : "";
    } else {
      news.health = ServiceHealth::kGone;
      news.reason = reply.status().message();
    }
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
    }
    listener_(std::make_shared<const ServiceNews>(news));
    std::unique_lock lock(mutex_);
    const Duration pause = news.health == ServiceHealth::kGone ? kPauseWhenGone : kEach;
    if (stop_.wait_for(lock, pause, [this] { return stopping_; })) return;
  }
}

}  // namespace slabstream
