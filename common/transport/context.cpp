#include "common/transport/context.h"

#include "common/transport/context_impl.h"

namespace slabstream {

Context::Context() : impl_(std::make_unique<Impl>()) {
  constexpr int kMaxSockets = 65535;  // the usual 1023 would limit the embedded workers: each has a socket to every other
  impl_->context.set(zmq::ctxopt::max_sockets, kMaxSockets);
}

Context::~Context() = default;

Authenticator& Context::authenticator() {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->authenticator == nullptr) impl_->authenticator = std::make_unique<Authenticator>(*this);
  return *impl_->authenticator;
}

}  // namespace slabstream
