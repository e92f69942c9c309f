// ConnectionMonitor: hears what becomes of a socket's connections. Private to this folder.
#pragma once

#include <zmq.hpp>

namespace slabstream {

// For the socket's thread only; ends before the socket.
class ConnectionMonitor : private zmq::monitor_t {
 public:
  // Calls the handlers of all events since the last call. Call it now and then: until then ZeroMQ keeps the events.
  void HandleEvents();

 protected:
  // Before the socket binds or connects. `events`: ZMQ_EVENT_ flags. Throws zmq::error_t.
  ConnectionMonitor(zmq::socket_t& socket, int events);
};

}  // namespace slabstream
