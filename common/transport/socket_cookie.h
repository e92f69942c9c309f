// The kernel's name for a socket. A descriptor that was closed may be another socket's now; its cookie then differs. Private to this
// folder.
#pragma once

#include <sys/socket.h>

#include <cstdint>

namespace slabstream {

// 0: not a socket.
inline std::uint64_t SocketCookie(int descriptor) {
  std::uint64_t cookie = 0;
  socklen_t bytes = sizeof(cookie);
  return ::getsockopt(descriptor, SOL_SOCKET, SO_COOKIE, &cookie, &bytes) == 0 ? cookie : 0;
}

}  // namespace slabstream
