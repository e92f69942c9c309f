// What tests of sockets say, and how they wait for it.
#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/transport/socket.h"
#include "tests/support/text_of.h"

namespace slabstream {

inline constexpr Duration kPatience = std::chrono::seconds(30);  // what should happen happens long before; else the test fails

inline std::vector<std::byte> BytesOf(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

// Calls `done` until it is true, while the socket takes notice of what happens. False: it never was.
template <class Done>
bool Until(Socket& socket, Done&& done, Duration patience = kPatience) {
  const Time limit = MonotonicNow() + patience;
  const std::array<Socket*, 1> sockets = {&socket};
  while (MonotonicNow() < limit) {
    if (done()) return true;
    Wait(sockets, nullptr, std::chrono::milliseconds(10));
  }
  return false;
}

// The next message, waited for.
inline std::optional<Incoming> Receive(Socket& socket, Duration patience = kPatience) {
  std::optional<Incoming> incoming;
  Until(
      socket, [&] { return (incoming = socket.TryReceive()).has_value(); }, patience);
  return incoming;
}

// Sending ends with this status, at last.
template <class Send>
bool SendsUntil(StatusCode code, Socket& socket, Send&& send) {
  return Until(socket, [&] { return send().code() == code; });
}

}  // namespace slabstream
