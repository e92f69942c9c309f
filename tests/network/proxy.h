// Proxy: passes tcp connections on, as badly as a test wants: late, not at all, or until it resets them. On a host of its own.
#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstddef>
#include <deque>
#include <list>
#include <string>
#include <thread>
#include <vector>

#include "common/base/time.h"
#include "tests/network/hosts.h"

namespace slabstream {

class Proxy {
 public:
  // `target`: tcp://ADDRESS:PORT, of IPv4.
  Proxy(const Hosts& hosts, int host, const std::string& target);
  ~Proxy();
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  const std::string& endpoint() const { return endpoint_; }
  // From any thread.
  void SetDelay(Duration delay) { delay_ = delay; }         // delays everything that comes from now on, each way
  void SetStalled(bool stalled) { stalled_ = stalled; }     // nothing passes; connections stay
  void ResetAll() { ++resets_; }                            // the connections of now
  std::size_t connections() const { return connections_; }  // connections that were ever made

 private:
  struct Chunk {
    Time due;
    std::vector<char> bytes;
    std::size_t sent = 0;
  };
  struct End {
    int descriptor = -1;
    std::deque<Chunk> outgoing;
    std::size_t queued = 0;  // bytes
  };
  struct Link {
    End near, far;
    bool broken = false;
  };
  void Run(const std::stop_token& stop);
  void Accept();
  void Receive(Link& link, End& from, End& to) const;
  static void Send(Link& link, End& to);
  static void Reset(Link& link);

  sockaddr_in target_{};
  int listener_ = -1;
  std::string endpoint_;
  std::atomic<Duration> delay_{Duration::zero()};
  std::atomic<bool> stalled_ = false;
  std::atomic<int> resets_ = 0;
  std::atomic<std::size_t> connections_ = 0;
  std::list<Link> links_;  // the thread's
  std::jthread thread_;    // last member
};

}  // namespace slabstream
