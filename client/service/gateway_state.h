// The record that a gateway keeps of itself while it runs, so that `slabstream token` finds its address and its token: one JSON file a
// gateway in StateDirectory(), which its user alone can read.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

struct GatewayState {
  std::string address;  // of the page, without the token: "http://127.0.0.1:41733/"
  std::string token;    // its own
  pid_t pid = 0;
  double started_unix = 0;  // seconds
};

// Unavailable: as StateDirectory and WritePrivateTextFile.
Status SaveGateway(const GatewayState& state);
void ForgetGateway(pid_t pid);

// Those of this user that run on this machine, the first one started first. Forgets those that have ended without doing so.
std::vector<GatewayState> RunningGateways();

}  // namespace slabstream
