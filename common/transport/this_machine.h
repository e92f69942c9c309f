// What is known of this machine's own endpoints before a socket is made.
#pragma once

#include <string>

namespace slabstream {

// Whether an endpoint on this machine, tcp or ipc, refuses connections at once. False: somebody listens there, or nothing is known.
bool NobodyListens(const std::string& endpoint);

// The host of this machine's own endpoints: "127.0.0.1", or "[::1]" where there is no IPv4.
std::string OwnHost();

}  // namespace slabstream
