// ConnectionLimit: how many connections a router's listeners accept at a time. ZeroMQ would accept them all, until the process has no
// descriptors left for anything else. Private to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <zmq.hpp>

namespace slabstream {

// For the socket's thread only; ends before the socket.
class ConnectionLimit : private zmq::monitor_t {
 public:
  // Before the socket binds. At most `most` connections, and at most a quarter of the files that this process may open. Throws
  // zmq::error_t.
  ConnectionLimit(zmq::socket_t& socket, std::size_t most);

  // Shuts down the connections that came since the last call and are too many. Call it now and then.
  void Enforce();

 private:
  void on_event_accepted(const zmq_event_t& event, const char* endpoint) override;

  const std::size_t most_;
  std::unordered_map<int, std::uint64_t> accepted_;  // cookies by descriptors; some may be closed
};

}  // namespace slabstream
