// Endpoints as users type them: tcp://HOST:PORT, ipc://PATH, inproc://NAME.
//
// Hosts are addresses, or names where a connection is made. What is not loopback (127.0.0.0/8, [::1] or localhost) leaves this machine, and
// sockets then need keys.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

enum class Scheme { kTcp, kIpc, kInproc };

struct Endpoint {
  Scheme scheme = Scheme::kTcp;
  std::string host;  // tcp: "127.0.0.1", "[::1]", "node7"
  int port = 0;      // tcp: [1, 65535]; 0 stands for "*", any free port (binding only)
  std::string path;  // ipc: absolute path, at most 107 bytes; inproc: name

  bool remote() const;           // tcp beyond this machine's loopback
  std::string ToString() const;  // as ZeroMQ takes it
};

// InvalidArgument naming the text and what is expected. At most 512 printable bytes without spaces. `to_bind`: "*" or 0 as port is fine,
// and the host is an address.
Result<Endpoint> ParseEndpoint(std::string_view text, bool to_bind);

// This machine's own address, as an endpoint spells it, on the network that leads to a tcp endpoint. Nothing is sent. Unavailable: the name
// is not known, or no network leads there.
Result<std::string> LocalHostTowards(const Endpoint& endpoint);

// This machine's end of a connected tcp socket, as the host of an endpoint; empty: it is not connected.
std::string LocalHostOf(int descriptor);

// Removes the socket files whose paths begin like this ipc endpoint's, if nobody listens there now: processes that were killed leave
// theirs. Does nothing for other endpoints.
void RemoveDeadSockets(const Endpoint& prefix);

// A worker's own endpoint for images begins with the coordinator's path and this, unless it is told otherwise.
inline constexpr char kImagesSuffix[] = ".images-";

// Where the coordinator listens for workers if only the client endpoint is given: the next tcp port (any for any; the one before for
// 65535), or the path with ".workers".
Endpoint WorkerEndpointFor(const Endpoint& client_endpoint);

}  // namespace slabstream
