// PeerSockets: the sending ends of the images plane, one DEALER for each worker that was sent to lately.
//
// A DEALER queues silently while its peer is down. The coordinator detects dead peers and orders nothing more for them. A socket and its
// queue are closed after kPeerIdle without use.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "common/base/time.h"
#include "common/transport/socket.h"

namespace slabstream {

inline constexpr Duration kPeerIdle = std::chrono::seconds(10);

class PeerSockets {
 public:
  explicit PeerSockets(Context& context) : context_(context) {}

  // Connects if need be. Errors: the endpoint cannot be connected to, or too much is queued for it.
  Status Send(const std::string& endpoint, std::vector<std::byte> header, const Bytes& payload, Time now);

  void CloseIdle(Time now);

 private:
  struct Peer {
    Socket socket;
    Time last_used;
  };
  Context& context_;
  std::map<std::string, Peer> peers_;  // by endpoint
};

}  // namespace slabstream
