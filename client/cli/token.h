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

// Prints the token. If the gateway runs here, prints a link with the token, too. InvalidArgument: the gateway's own token is too short to
// sign others, or there are too many datasets. Unavailable: no gateway of this user runs here, and no token file is named.
Status RunToken(const TokenOptions& options);

}  // namespace slabstream
