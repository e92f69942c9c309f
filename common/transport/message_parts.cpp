#include "common/transport/message_parts.h"

#include <span>
#include <utility>

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace slabstream {
namespace {

// What a thread did before it sent a message happens before what another does after receiving or freeing it. ThreadSanitizer does not see
// that inside ZeroMQ, which is not instrumented, so these calls tell it.
void BeforeHandOver([[maybe_unused]] const void* data) {
#ifdef __SANITIZE_THREAD__
  __tsan_release(const_cast<void*>(data));
#endif
}
void AfterHandOver([[maybe_unused]] const void* data) {
#ifdef __SANITIZE_THREAD__
  __tsan_acquire(const_cast<void*>(data));
#endif
}

struct Shared {
  Bytes bytes;
  HeldBytes held;
};

void LetGo(void* data, void* owner) {
  AfterHandOver(data);
  const std::unique_ptr<Shared> shared(static_cast<Shared*>(owner));
  if (shared->held != nullptr) *shared->held -= shared->bytes.size();
}

}  // namespace

zmq::message_t Share(Bytes bytes, HeldBytes held) {
  if (bytes.empty()) return {};
  auto owner = std::make_unique<Shared>(Shared{std::move(bytes), std::move(held)});
  const std::span<const std::byte> data = owner->bytes.span();
  zmq::message_t message(const_cast<std::byte*>(data.data()), data.size(), LetGo, owner.get());
  if (owner->held != nullptr) *owner->held += data.size();
  BeforeHandOver(data.data());
  (void)owner.release();  // the message owns it now
  return message;
}

Bytes Adopt(zmq::message_t message) {
  auto owner = std::make_shared<zmq::message_t>(std::move(message));
  const std::span<const std::byte> data(static_cast<const std::byte*>(owner->data()), owner->size());
  AfterHandOver(data.data());
  return Bytes(std::move(owner), data);
}

int SendPart(zmq::socket_t& socket, zmq::message_t message, bool more) {
  const zmq::send_flags flags = more ? zmq::send_flags::dontwait | zmq::send_flags::sndmore : zmq::send_flags::dontwait;
  for (bool looked = false;;) {
    try {
      if (socket.send(message, flags)) return 0;
      if (std::exchange(looked, true)) return EAGAIN;
      // A busy socket takes note of what was read at the other ends once a millisecond at most: a queue that is full may be empty by now.
      // Asked for its events, it does so at once.
      (void)socket.get(zmq::sockopt::events);
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) return error.num();
    }
  }
}

bool ReceivePart(zmq::socket_t& socket, zmq::message_t& message) {
  while (true) {
    try {
      return socket.recv(message, zmq::recv_flags::dontwait).has_value();
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) return false;
    }
  }
}

}  // namespace slabstream
