// Endpoints as users type them: tcp://HOST:PORT, ipc://PATH, inproc://NAME.
//
// Until the service has keys it stays on this machine: tcp hosts must be loopback (127.0.0.0/8, [::1] or localhost); everything else is
// refused.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

enum class Scheme { kTcp, kIpc, kInproc };

struct Endpoint {
  Scheme scheme = Scheme::kTcp;
  std::string host;  // tcp: "127.0.0.1"
  int port = 0;      // tcp: [1, 65535]; 0 stands for "*", any free port (binding only)
  std::string path;  // ipc: absolute path, at most 107 bytes; inproc: name

  std::string ToString() const;  // as ZeroMQ takes it
};

// InvalidArgument naming the text and what is expected. At most 512 printable bytes without spaces. `allow_wildcard`: "*" as port is fine
// (binding).
Result<Endpoint> ParseEndpoint(std::string_view text, bool allow_wildcard);

// Where the coordinator listens for workers if only the client endpoint is given: the next tcp port (any for any; the one before for
// 65535), or the path with ".workers".
Endpoint WorkerEndpointFor(const Endpoint& client_endpoint);

}  // namespace slabstream
