// What processes have asked web servers for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace slabstream {

inline constexpr std::size_t kMaxWebServers = 64;  // servers that are told of; the first ones by name

// What a process has asked one server for since it began.
struct WebTraffic {
  std::string server;              // "host:port"
  std::uint64_t requests = 0;      // each try is one
  std::uint64_t retries = 0;       // requests that followed one that failed
  std::uint64_t failures = 0;      // after which nothing was tried again; 404 is an answer
  std::uint64_t unchanged = 0;     // answers without bytes, of objects that the disk has
  std::uint64_t bytes = 0;         // bytes of bodies
  std::uint64_t milliseconds = 0;  // from the begin of each try to its end; tries that ran at a time count each

  std::uint64_t answered() const { return requests - retries - failures - unchanged; }  // with bytes, or 404

  WebTraffic& operator+=(const WebTraffic& more) {
    requests += more.requests;
    retries += more.retries;
    failures += more.failures;
    unchanged += more.unchanged;
    bytes += more.bytes;
    milliseconds += more.milliseconds;
    return *this;
  }
  friend bool operator==(const WebTraffic&, const WebTraffic&) = default;
};

}  // namespace slabstream
