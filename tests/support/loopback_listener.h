// A socket that listens on a loopback port of its own.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>

#include "common/base/check.h"

namespace slabstream {

struct LoopbackListener {
  int socket = -1;  // the caller's to close
  std::uint16_t port = 0;
};

inline LoopbackListener ListenOnLoopback() {
  constexpr int kMostWaiting = 128;  // connections
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  CHECK_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), size), 0);
  CHECK_EQ(::listen(socket, kMostWaiting), 0);
  CHECK_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size), 0);
  return {socket, ntohs(address.sin_port)};
}

}  // namespace slabstream
