// `slabstream token`: a token of a gateway for others, which expires (docs/http.md).
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"

namespace slabstream {

struct TokenOptions {
  Duration lasts{};                   // at least a second
  std::vector<std::string> datasets;  // empty: all
  bool view_only = false;
  std::string token_file;  // the gateway's; empty: the token of the gateway of this user that was started here last
};

// Prints the token, and the link to the gateway if it runs here. InvalidArgument, Unavailable: there is no gateway.
Status RunToken(const TokenOptions& options);

}  // namespace slabstream
