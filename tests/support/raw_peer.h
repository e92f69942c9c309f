// RawPeer: a tcp connection that speaks ZeroMQ's protocol (ZMTP 3.0, RFC 23) as far as a test wants, and then anything.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/check.h"
#include "common/transport/endpoint.h"

namespace slabstream {

class RawPeer {
 public:
  // `endpoint`: tcp://127.0.0.1:PORT, where somebody listens.
  explicit RawPeer(const std::string& endpoint) : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    CHECK_GE(descriptor_, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(std::uint16_t(ParseEndpoint(endpoint, false)->port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    CHECK_EQ(::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0) << endpoint;
  }
  RawPeer(RawPeer&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  RawPeer& operator=(RawPeer&&) = delete;
  ~RawPeer() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  // What the other end still takes; it may have closed the connection. What it answers stays unread.
  RawPeer& Send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) break;
      bytes.remove_prefix(std::size_t(sent));
    }
    return *this;
  }

  static std::string Greeting(std::string_view mechanism = "NULL") {
    std::string greeting("\xff\0\0\0\0\0\0\0\x01\x7f\x03\0", 12);
    greeting.append(mechanism);
    greeting.resize(64, '\0');
    return greeting;
  }
  static std::string Command(std::string_view name, std::string_view body) {
    return std::string(1, '\x04') + char(1 + name.size() + body.size()) + char(name.size()) + std::string(name) + std::string(body);
  }
  static std::string Ready(std::string_view socket_type = "DEALER") {
    return Command("READY", Property("Socket-Type", socket_type) + Property("Identity", ""));
  }
  static std::string Property(std::string_view name, std::string_view value) {
    return std::string(1, char(name.size())) + std::string(name) + std::string(3, '\0') + char(value.size()) + std::string(value);
  }
  // A frame that says it has `length` bytes, with `bytes`.
  static std::string Frame(std::string_view bytes, bool more, std::uint64_t length) {
    std::string frame(1, more ? '\x03' : '\x02');
    for (int shift = 56; shift >= 0; shift -= 8) frame += char(length >> unsigned(shift));
    return frame.append(bytes);
  }
  static std::string Frame(std::string_view bytes, bool more = false) { return Frame(bytes, more, bytes.size()); }

 private:
  int descriptor_ = -1;
};

}  // namespace slabstream
