#include "common/transport/this_machine.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "common/transport/endpoint.h"

namespace slabstream {

bool NobodyListens(const std::string& text) {
  const Result<Endpoint> endpoint = ParseEndpoint(text, false);
  if (!endpoint.ok() || endpoint->scheme == Scheme::kInproc || endpoint->remote()) return false;
  union {
    sockaddr any = {};
    sockaddr_in four;
    sockaddr_in6 six;
    sockaddr_un file;
  } address;
  if (endpoint->scheme == Scheme::kIpc) {
    address.file = {.sun_family = AF_UNIX, .sun_path = {}};
    endpoint->path.copy(address.file.sun_path, sizeof(address.file.sun_path) - 1);
  } else if (endpoint->host.starts_with('[')) {
    address.six = {.sin6_family = AF_INET6, .sin6_port = htons(std::uint16_t(endpoint->port)), .sin6_addr = in6addr_loopback};
  } else {
    address.four = {
        .sin_family = AF_INET, .sin_port = htons(std::uint16_t(endpoint->port)), .sin_addr = {inet_addr(endpoint->host.c_str())}};
  }
  const int descriptor = ::socket(address.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  // On the loopback the answer comes at once, unless a full queue or a firewall swallows the question.
  const timeval patience{1, 0};
  (void)::setsockopt(descriptor, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
  const bool refused = ::connect(descriptor, &address.any, sizeof(address.file)) != 0 && (errno == ECONNREFUSED || errno == ENOENT);
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
