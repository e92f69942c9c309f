#include "tests/network/proxy.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostQueued = std::size_t{1} << 20;  // of each direction; more waits in the kernel
constexpr int kTurnMs = 5;                                 // between looks at what is due

sockaddr_in AddressOf(const std::string& endpoint) {
  const std::size_t colon = endpoint.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = ::inet_addr(endpoint.substr(6, colon - 6).c_str());
  address.sin_port = htons(std::uint16_t(std::atoi(endpoint.c_str() + colon + 1)));
  return address;
}

}  // namespace

Proxy::Proxy(const Hosts& hosts, int host, const std::string& target) : target_(AddressOf(target)) {
  hosts.Run(host, [&] {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    sockaddr_in own = AddressOf("tcp://" + hosts.AddressOf(host) + ":0");
    socklen_t bytes = sizeof(own);
    CHECK_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&own), bytes), 0);
    CHECK_EQ(::listen(listener_, 64), 0);
    CHECK_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&own), &bytes), 0);
    endpoint_ = "tcp://" + hosts.AddressOf(host) + ":" + std::to_string(ntohs(own.sin_port));
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  });
}

Proxy::~Proxy() {
  thread_.request_stop();
  thread_.join();
  for (Link& link : links_) Reset(link);
  ::close(listener_);
}

void Proxy::Run(const std::stop_token& stop) {
  for (int resets = 0; !stop.stop_requested();) {
    std::vector<pollfd> descriptors;
    if (!stalled_) {
      descriptors.push_back({listener_, POLLIN, 0});
      for (const Link& link : links_) {
        for (const End* end : {&link.near, &link.far}) descriptors.push_back({end->descriptor, POLLIN, 0});
      }
    }
    ::poll(descriptors.data(), descriptors.size(), kTurnMs);
    const bool reset_all = std::exchange(resets, resets_.load()) != resets;
    if (stalled_ && !reset_all) continue;
    Accept();
    for (Link& link : links_) {
      Receive(link, link.near, link.far);
      Receive(link, link.far, link.near);
      Send(link, link.near);
      Send(link, link.far);
      if (reset_all || link.broken) Reset(link);
    }
    links_.remove_if([](const Link& link) { return link.near.descriptor < 0; });
  }
}

void Proxy::Accept() {
  const int near = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (near < 0) return;
  const int far = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int connected = ::connect(far, reinterpret_cast<const sockaddr*>(&target_), sizeof(target_));
  CHECK(connected == 0 || errno == EINPROGRESS);
  links_.push_back({.near = {.descriptor = near, .outgoing = {}}, .far = {.descriptor = far, .outgoing = {}}});
  ++connections_;
}

void Proxy::Receive(Link& link, End& from, End& to) const {
  std::array<char, 1 << 16> buffer{};
  while (to.queued < kMostQueued) {
    const ssize_t bytes = ::recv(from.descriptor, buffer.data(), buffer.size(), 0);
    if (bytes <= 0) {
      link.broken |= bytes == 0 || (errno != EAGAIN && errno != ENOTCONN);
      return;
    }
    to.outgoing.push_back({MonotonicNow() + delay_.load(), {buffer.data(), buffer.data() + bytes}});
    to.queued += std::size_t(bytes);
  }
}

void Proxy::Send(Link& link, End& to) {
  while (!to.outgoing.empty() && to.outgoing.front().due <= MonotonicNow()) {
    Chunk& chunk = to.outgoing.front();
    const ssize_t bytes = ::send(to.descriptor, chunk.bytes.data() + chunk.sent, chunk.bytes.size() - chunk.sent, MSG_NOSIGNAL);
    if (bytes < 0) {
      link.broken |= errno != EAGAIN && errno != ENOTCONN;
      return;
    }
    chunk.sent += std::size_t(bytes);
    to.queued -= std::size_t(bytes);
    if (chunk.sent == chunk.bytes.size()) to.outgoing.pop_front();
  }
}

// Both ends hear RST, not FIN.
void Proxy::Reset(Link& link) {
  const linger at_once = {.l_onoff = 1, .l_linger = 0};
  for (End* end : {&link.near, &link.far}) {
    (void)::setsockopt(end->descriptor, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
    ::close(std::exchange(end->descriptor, -1));
  }
}

}  // namespace slabstream
