#include "common/transport/connection_monitor.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "common/transport/endpoint.h"
#include "common/transport/socket_cookie.h"

namespace slabstream {
namespace {

std::size_t FileShare() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? limit.rlim_cur / 4 : SIZE_MAX;
}

constexpr const char* kReno = "reno";
constexpr std::size_t kMostNameBytes = 16;  // of a congestion control, TCP_CA_NAME_MAX of the kernel

// Both ends have the same address.
bool StaysOnThisHost(int descriptor) {
  sockaddr_storage here = {}, there = {};
  socklen_t here_bytes = sizeof(here), there_bytes = sizeof(there);
  if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&here), &here_bytes) != 0 ||
      ::getpeername(descriptor, reinterpret_cast<sockaddr*>(&there), &there_bytes) != 0 || here.ss_family != there.ss_family) {
    return false;
  }
  if (here.ss_family == AF_INET) {
    return reinterpret_cast<const sockaddr_in&>(here).sin_addr.s_addr == reinterpret_cast<const sockaddr_in&>(there).sin_addr.s_addr;
  }
  return here.ss_family == AF_INET6 && std::memcmp(&reinterpret_cast<const sockaddr_in6&>(here).sin6_addr,
                                                   &reinterpret_cast<const sockaddr_in6&>(there).sin6_addr, sizeof(in6_addr)) == 0;
}

}  // namespace

ConnectionMonitor::ConnectionMonitor(zmq::socket_t& socket, int events) {
  static std::atomic<std::uint64_t> last = 0;
  init(socket, "inproc://connection-monitor-" + std::to_string(++last), events);
}

void ConnectionMonitor::HandleEvents() {
  try {
    while (check_event()) {
    }
  } catch (const zmq::error_t&) {  // a signal: the next call goes on
  }
}

ConnectionLimit::ConnectionLimit(zmq::socket_t& socket, std::size_t most)
    : ConnectionMonitor(socket, ZMQ_EVENT_ACCEPTED), most_(std::min(most, FileShare())) {}

void ConnectionLimit::on_event_accepted(const zmq_event_t& event, const char*) {
  const int descriptor = event.value;
  if (accepted_.size() >= most_) std::erase_if(accepted_, [](const auto& entry) { return SocketCookie(entry.first) != entry.second; });
  const std::uint64_t cookie = SocketCookie(descriptor);
  if (cookie == 0) return;  // it is closed already
  if (accepted_.size() < most_ || accepted_.contains(descriptor)) {
    accepted_[descriptor] = cookie;
  } else {
    (void)::shutdown(descriptor, SHUT_RDWR);  // ZeroMQ, whose descriptor it is, then closes it
  }
}

ConnectionTuner::ConnectionTuner(zmq::socket_t& socket)
    : ConnectionMonitor(socket, ZMQ_EVENT_CONNECTED | ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED |
                                    ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {}

// The connection may be gone and its descriptor reused: then the new connection is one of this host too, or stays unchanged.
void ConnectionTuner::on_event_connected(const zmq_event_t& event, const char*) {
  const int descriptor = event.value;
  if (std::string host = LocalHostOf(descriptor); !host.empty()) local_host_ = std::move(host);
  if (!StaysOnThisHost(descriptor)) return;
  std::array<char, kMostNameBytes> system{};
  socklen_t bytes = system.size();
  if (::getsockopt(descriptor, IPPROTO_TCP, TCP_CONGESTION, system.data(), &bytes) != 0) return;
  // If one fails, the connection is merely slower. If something was sent already, BBR has lowered the slow start threshold to what was in
  // flight, and reno would be held to that for ever. So BBR starts anew, which removes the threshold.
  for (const char* name : {kReno, std::as_const(system).data(), kReno}) {
    (void)::setsockopt(descriptor, IPPROTO_TCP, TCP_CONGESTION, name, socklen_t(std::strlen(name)));
  }
}

}  // namespace slabstream
