#include "tests/common/transport/tcp_relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr int kGlanceMs = 20;        // between looks at the order to stop
constexpr int kAnswerGlances = 5;    // that an answer may take
constexpr int kCloseGlances = 1000;  // until the test fails

sockaddr_in Loopback(int port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(std::uint16_t(port));
  return address;
}

int ConnectTo(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in address = Loopback(port);
  CHECK(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
  return socket;
}

void SendAll(int socket, const char* data, std::size_t bytes) {
  while (bytes > 0) {
    const ssize_t sent = ::send(socket, data, bytes, MSG_NOSIGNAL);
    if (sent <= 0) return;  // the other end has closed
    data += sent;
    bytes -= std::size_t(sent);
  }
}

bool Readable(int socket) {
  pollfd item = {socket, POLLIN, 0};
  return ::poll(&item, 1, kGlanceMs) > 0;
}

}  // namespace

TcpRelay::TcpRelay(int port) : port_(port) {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

TcpRelay::~TcpRelay() {
  thread_.request_stop();
  thread_.join();
  ::close(listener_.socket);
}

std::string TcpRelay::endpoint() const { return "tcp://127.0.0.1:" + std::to_string(listener_.port); }

std::string TcpRelay::Recorded() const {
  std::string all;
  for (const std::string& piece : Pieces()) all += piece;
  return all;
}

std::vector<std::string> TcpRelay::Pieces() const {
  const std::lock_guard lock(mutex_);
  return pieces_;
}

int TcpRelay::connections() const {
  const std::lock_guard lock(mutex_);
  return connections_;
}

void TcpRelay::AlterAfter(std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  alter_after_ = bytes + 1;
}

void TcpRelay::RepeatNext() {
  const std::lock_guard lock(mutex_);
  repeat_next_ = true;
}

bool TcpRelay::Replay(const std::vector<std::string>& pieces) const {
  const int socket = ConnectTo(port_);
  std::array<char, 4096> taken{};
  bool closed = false;
  const auto take = [&](int glances) {
    for (int i = 0; i < glances && !closed; ++i) closed = Readable(socket) && ::recv(socket, taken.data(), taken.size(), 0) <= 0;
  };
  for (const std::string& piece : pieces) {
    SendAll(socket, piece.data(), piece.size());
    take(kAnswerGlances);
  }
  take(kCloseGlances);
  ::close(socket);
  return closed;
}

void TcpRelay::Run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (!Readable(listener_.socket)) continue;
    const int from = ::accept(listener_.socket, nullptr, nullptr), to = ConnectTo(port_);
    {
      const std::lock_guard lock(mutex_);
      ++connections_;
    }
    Pass(from, to, stop);
    ::close(from);
    ::close(to);
  }
}

// Until one of the two closes.
void TcpRelay::Pass(int from, int to, const std::stop_token& stop) {
  std::array<char, 65536> bytes{};
  while (!stop.stop_requested()) {
    std::array<pollfd, 2> items = {{{from, POLLIN, 0}, {to, POLLIN, 0}}};
    ::poll(items.data(), items.size(), kGlanceMs);
    if (items[1].revents != 0) {
      const ssize_t count = ::recv(to, bytes.data(), bytes.size(), 0);
      if (count <= 0) return;
      SendAll(from, bytes.data(), std::size_t(count));
    }
    if (items[0].revents == 0) continue;
    const ssize_t count = ::recv(from, bytes.data(), bytes.size(), 0);
    if (count <= 0) return;
    bool twice = false;
    {
      const std::lock_guard lock(mutex_);
      twice = std::exchange(repeat_next_, false);
      pieces_.emplace_back(bytes.data(), std::size_t(count));
      if (alter_after_ > std::size_t(count)) {
        alter_after_ -= std::size_t(count);
      } else if (alter_after_ > 0) {
        bytes[alter_after_ - 1] ^= 1;
        alter_after_ = 0;
      }
    }
    SendAll(to, bytes.data(), std::size_t(count));
    if (twice) SendAll(to, bytes.data(), std::size_t(count));
  }
}

}  // namespace slabstream
