// What watches the connections of a socket. Private to this folder: socket.cpp makes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <zmq.hpp>

namespace slabstream {

// Hears what becomes of a socket's connections. For the socket's thread only; ends before the socket.
class ConnectionMonitor : private zmq::monitor_t {
 public:
  // Calls the handlers of all events since the last call. Call it now and then: until then ZeroMQ keeps the events.
  void HandleEvents();

 protected:
  // Before the socket binds or connects. `events`: ZMQ_EVENT_ flags. Throws zmq::error_t.
  ConnectionMonitor(zmq::socket_t& socket, int events);
};

// Limits how many connections a router's listeners accept at a time, and closes those that are too many. ZeroMQ would accept them all,
// until the process has no descriptors left for anything else.
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

// Sets options of a socket's connections that ZeroMQ cannot set, and hears what becomes of the connections.
//
// A connection that stays on this host gets reno as its congestion control, which every process may choose. If the system's choice paces
// packets, as BBR does, an image costs twice the processor time on the loopback, which has no queue to keep short. All other connections
// keep the system's choice.
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
