// ConnectionLimit: how many connections a router's listeners accept at a time; it closes those that are too many. ZeroMQ would accept them
// all, until the process has no descriptors left for anything else. Private to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <zmq.hpp>

#include "common/transport/connection_monitor.h"

namespace slabstream {

// For the socket's thread only; ends before the socket.
class ConnectionLimit : public ConnectionMonitor {
 public:
  // Before the socket binds. At most `most` connections, and at most a quarter of the files that this process may open. Throws
  // zmq::error_t.
  ConnectionLimit(zmq::socket_t& socket, std::size_t most);

 private:
  void on_event_accepted(const zmq_event_t& event, const char* endpoint) override;

  const std::size_t most_;
  std::unordered_map<int, std::uint64_t> accepted_;  // cookies by descriptors; some may be closed
};

}  // namespace slabstream
