// A tcp connection to this host that says nothing.
#pragma once

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>

namespace slabstream {

class SilentConnection {
 public:
  explicit SilentConnection(std::uint16_t port) : descriptor_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  }
  ~SilentConnection() { ::close(descriptor_); }
  SilentConnection(const SilentConnection&) = delete;
  SilentConnection& operator=(const SilentConnection&) = delete;

  // The other end has closed it; what that said before is passed over.
  bool closed() const {
    std::array<char, 256> said{};
    ssize_t count = 0;
    do {
      count = ::recv(descriptor_, said.data(), said.size(), MSG_DONTWAIT);
    } while (count > 0);
    return count == 0 || errno == ECONNRESET;
  }

 private:
  const int descriptor_;
};

}  // namespace slabstream
