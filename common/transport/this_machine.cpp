#include "common/transport/this_machine.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

namespace slabstream {

bool NobodyListens(const Endpoint& endpoint) {
  if (endpoint.scheme != Scheme::kTcp || endpoint.remote()) return false;
  sockaddr_storage address{};
  socklen_t bytes = 0;
  if (endpoint.host.starts_with('[')) {
    auto& six = reinterpret_cast<sockaddr_in6&>(address);
    six.sin6_family = AF_INET6;
    six.sin6_addr = in6addr_loopback;
    six.sin6_port = htons(static_cast<std::uint16_t>(endpoint.port));
    bytes = sizeof(six);
  } else {
    auto& four = reinterpret_cast<sockaddr_in&>(address);
    four.sin_family = AF_INET;
    if (inet_pton(AF_INET, endpoint.host.c_str(), &four.sin_addr) != 1) return false;
    four.sin_port = htons(static_cast<std::uint16_t>(endpoint.port));
    bytes = sizeof(four);
  }
  const int descriptor = ::socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  // On the loopback the answer comes at once, unless a full queue or a firewall swallows the question.
  const timeval patience{1, 0};
  (void)::setsockopt(descriptor, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
  const bool refused = ::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), bytes) != 0 && errno == ECONNREFUSED;
  ::close(descriptor);
  return refused;
}

std::string OwnHost() {
  sockaddr_in four{};
  four.sin_family = AF_INET;
  four.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool has_ipv4 = descriptor >= 0 && ::bind(descriptor, reinterpret_cast<const sockaddr*>(&four), sizeof(four)) == 0;
  if (descriptor >= 0) ::close(descriptor);
  return has_ipv4 ? "127.0.0.1" : "[::1]";
}

}  // namespace slabstream
