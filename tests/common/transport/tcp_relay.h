// TcpRelay: somebody on the network between a dealer and a router: reads and records all that the dealer sends, can alter or repeat it, and
// can connect to the router and say it again.
#pragma once

#include <cstddef>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/loopback_listener.h"

namespace slabstream {

class TcpRelay {
 public:
  // Relays one connection after the other to this port of 127.0.0.1.
  explicit TcpRelay(int port);
  ~TcpRelay();
  TcpRelay(const TcpRelay&) = delete;

  std::string endpoint() const;  // to connect to

  // All bytes that came from those who connected so far, as they came.
  std::string Recorded() const;
  int connections() const;

  // Alters the next byte that comes once `bytes` more have passed.
  void AlterAfter(std::size_t bytes);

  // The next piece passes twice.
  void RepeatNext();

  // The same in pieces. Between two of them the other end had a moment to answer, as a handshake needs.
  std::vector<std::string> Pieces() const;

  // Sends these pieces to the port in a connection of its own and takes what comes. False: the other end does not close it.
  bool Replay(const std::vector<std::string>& pieces) const;

 private:
  void Run(const std::stop_token& stop);
  void Pass(int from, int to, const std::stop_token& stop);

  const int port_;
  const LoopbackListener listener_ = ListenOnLoopback();
  mutable std::mutex mutex_;
  std::vector<std::string> pieces_;  // guarded by mutex_, as are the next three
  int connections_ = 0;
  std::size_t alter_after_ = 0;  // 0: nothing is altered
  bool repeat_next_ = false;
  std::jthread thread_;  // last member
};

}  // namespace slabstream
