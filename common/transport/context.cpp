#include "common/transport/context.h"

#include <chrono>
#include <future>
#include <thread>
#include <utility>

#include "common/transport/context_impl.h"

namespace slabstream {
namespace {

constexpr std::chrono::seconds kMostEndTime{2};  // longer than sockets linger

}  // namespace

Context::Context() : impl_(std::make_unique<Impl>()) {
  constexpr int kMaxSockets = 65535;  // the usual 1023 would limit the embedded workers: each has a socket to every other
  impl_->context.set(zmq::ctxopt::max_sockets, kMaxSockets);
}

// ZeroMQ ends a context only after it has looked up the host name of its last socket, and a name server that does not answer takes half a
// minute. Then the context ends by itself, or with the process.
Context::~Context() {
  impl_->authenticator.reset();
  std::promise<void> ended;
  const std::future<void> end = ended.get_future();
  std::thread([context = std::move(impl_->context), ended = std::move(ended)]() mutable {
    context.close();
    ended.set_value();
  }).detach();
  (void)end.wait_for(kMostEndTime);
}

Authenticator& Context::authenticator() {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->authenticator == nullptr) impl_->authenticator = std::make_unique<Authenticator>(*this);
  return *impl_->authenticator;
}

}  // namespace slabstream
