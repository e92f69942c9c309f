#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "common/base/check.h"
#include "common/transport/socket.h"

namespace slabstream {

Wakeup::Wakeup() : file_descriptor_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  CHECK_GE(file_descriptor_, 0) << "no file descriptor left";
}

Wakeup::~Wakeup() { ::close(file_descriptor_); }

void Wakeup::Notify() {
  const int saved = errno;  // a signal handler may be the caller
  const std::uint64_t one = 1;
  // It fails only when 2^64 - 2 notifications wait, and then the waiting thread wakes anyway.
  if (::write(file_descriptor_, &one, sizeof(one)) < 0) errno = saved;
}

bool Wakeup::Drain() {
  std::uint64_t count = 0;
  return ::read(file_descriptor_, &count, sizeof(count)) > 0;  // EAGAIN: nobody had notified
}

}  // namespace slabstream
