// ConnectionTable: the users of a router's connections, and how to end these. ZeroMQ has no call for that, so the table knows the
// descriptors. Private to this folder.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <zmq.hpp>

namespace slabstream {

class ConnectionTable {
 public:
  struct Sender {
    std::string user;  // as it was admitted; empty: the connection is not encrypted
    std::string host;  // its address, as the host of an endpoint; empty: not tcp
  };
  // Who is at the other end of the connection `identity`, of which this message part has come. Valid until the next call.
  const Sender& Heard(const std::string& identity, zmq::message_t& part);

  // Shut down the user's connections, or the one of this identity, if they are still there; ZeroMQ then closes them.
  void End(const std::string& user);
  void EndOne(const std::string& identity);

 private:
  struct Connection {
    Sender sender;
    int descriptor = -1;
    std::uint64_t cookie = 0;  // SocketCookie; 0: no socket
    bool open() const;
    void ShutDown() const;
  };

  std::unordered_map<std::string, Connection> connections_;  // by identity, which ZeroMQ never uses again
  std::size_t next_sweep_ = 64;                              // connections
};

}  // namespace slabstream
