#include "common/transport/connection_limit.h"

#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>

#include "common/transport/socket_cookie.h"

namespace slabstream {
namespace {

std::size_t FileShare() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? limit.rlim_cur / 4 : SIZE_MAX;
}

}  // namespace

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

}  // namespace slabstream
