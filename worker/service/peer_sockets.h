// PeerSockets: the sending ends of the images plane, one DEALER for each worker that was sent to lately.
//
// A DEALER queues silently while its peer is down. The coordinator detects dead peers and orders nothing more for them; TakeBroken names
// those that may be alive and yet have not got what was sent. A socket and its queue are closed after kPeerIdle without use.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/transport/socket.h"
#include "common/wire/control_messages.h"

namespace slabstream {

inline constexpr Duration kPeerIdle = std::chrono::seconds(10);

class PeerSockets {
 public:
  // `own`: this worker's keys, for peers whose images planes are encrypted.
  PeerSockets(Context& context, std::optional<KeyPair> own) : context_(context), own_(std::move(own)) {}

  // Connects if need be. Errors: the endpoint cannot be connected to, or too much is queued for it.
  Status Send(const Peer& to, std::vector<std::byte> header, const Bytes& payload, Time now);

  // Workers that messages to may have been lost since the last call: a connection broke, or could not be made.
  std::vector<WorkerId> TakeBroken();

  void CloseIdle(Time now);

 private:
  struct Connection {
    Socket socket;
    Time last_used;
    WorkerId worker = 0;  // the worker that was sent to last
  };
  Context& context_;
  const std::optional<KeyPair> own_;
  std::map<std::string, Connection> connections_;  // by endpoint
};

}  // namespace slabstream
