// ConnectionTuner: sets options of a socket's connections for which ZeroMQ has none, and hears what becomes of them. Private to this
// folder.
//
// A connection that stays on this host gets reno as its congestion control, which every process may choose. If the system's choice paces
// packets, as BBR does, an image costs twice the processor time on the loopback, which has no queue to keep short. All other connections
// keep the system's choice.
#pragma once

#include <string>
#include <utility>
#include <zmq.hpp>

#include "common/transport/connection_monitor.h"

namespace slabstream {

// For the socket's thread only; ends before the socket.
class ConnectionTuner : public ConnectionMonitor {
 public:
  // Before the socket connects. Throws zmq::error_t.
  explicit ConnectionTuner(zmq::socket_t& socket);

  // Somebody listens who does not admit the socket's key; or who has keys while the socket has none, or the other way round.
  bool refused() const { return refused_; }
  // Whether there is a connection, and the other end has admitted this one.
  bool connected() const { return connected_; }
  // Whether a connection broke, or could not be made, since the last call.
  bool TakeBroken() { return std::exchange(broken_, false); }
  // This host's address on the latest connection, as the host of an endpoint; empty: there was none.
  const std::string& local_host() const { return local_host_; }

 private:
  void on_event_connected(const zmq_event_t& event, const char* endpoint) override;
  void on_event_handshake_succeeded(const zmq_event_t&, const char*) override { connected_ = true; }
  void on_event_disconnected(const zmq_event_t&, const char*) override {
    broken_ = true;
    connected_ = false;
  }
  void on_event_closed(const zmq_event_t&, const char*) override { broken_ = true; }  // it could not be made
  void on_event_handshake_failed_auth(const zmq_event_t&, const char*) override { refused_ = true; }
  void on_event_handshake_failed_protocol(const zmq_event_t& event, const char*) override {
    if (event.value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) refused_ = true;
  }

  bool refused_ = false, connected_ = false, broken_ = false;
  std::string local_host_;
};

}  // namespace slabstream
