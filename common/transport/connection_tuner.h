// ConnectionTuner: sets on the connections that a socket has made what ZeroMQ has no option for. Private to this folder.
//
// A connection that stays on this host gets reno for its congestion control, which every process may choose. Where the system's choice
// paces what is sent, as BBR does, an image costs twice the processor time on the loopback, which has no queue to be kept short. All other
// connections keep the system's choice.
#pragma once

#include <zmq.hpp>

namespace slabstream {

// Of the thread that the socket belongs to; ends before the socket.
class ConnectionTuner : private zmq::monitor_t {
 public:
  // Before the socket connects. Throws zmq::error_t.
  explicit ConnectionTuner(zmq::socket_t& socket);

  // Tunes connections that were made since the last call. To be called now and then: until then ZeroMQ remembers them.
  void TuneNew();

 private:
  void on_event_connected(const zmq_event_t& event, const char* endpoint) override;
};

}  // namespace slabstream
