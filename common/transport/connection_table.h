// ConnectionTable: the users of a router's encrypted connections, and how to end these. ZeroMQ has no call for that, so the table knows the
// descriptors. Private to this folder.
#pragma once

#include <sys/socket.h>

#include <string>
#include <unordered_map>
#include <zmq.hpp>

namespace slabstream {

class ConnectionTable {
 public:
  // The user that the connection `identity`, of which this message part has come, was admitted as; empty: it is not encrypted.
  std::string Heard(const std::string& identity, zmq::message_t& part);

  // Shuts down the user's connections that are still there, which ZeroMQ then closes.
  void End(const std::string& user);

 private:
  struct Connection {
    std::string user;
    int descriptor = -1;
    sockaddr_storage peer{};  // a descriptor that was closed may be another connection's now: then its peer differs
  };
  static sockaddr_storage PeerOf(int descriptor);  // zeros: none
  void ForgetClosed();

  std::unordered_map<std::string, Connection> connections_;  // by identity, which ZeroMQ never uses again
  std::size_t next_sweep_ = 64;                              // connections
};

}  // namespace slabstream
