// `token`: a token of a gateway for others, which expires (docs/http.md).
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>

#include "client/cli/commands.h"
#include "client/service/gateway_state.h"
#include "common/base/time.h"
#include "common/cli/program.h"
#include "common/http/access_token.h"
#include "common/http/address.h"

namespace slabstream {

Status RunToken(const TokenOptions& options) {
  const std::vector<GatewayState> gateways = RunningGateways();
  if (options.token_file.empty() && gateways.empty()) {
    return Status::Unavailable("no gateway of this user runs here; --token-file names the file of its token");
  }
  const Result<std::string> secret =
      options.token_file.empty() ? Result<std::string>(gateways.back().token) : ReadToken("--token-file", options.token_file);
  if (!secret.ok()) return secret.status();
  Access access;
  access.until = UnixNow() + std::chrono::duration_cast<std::chrono::seconds>(options.lasts).count();
  if (!options.datasets.empty()) access.datasets = options.datasets;
  access.view_only = options.view_only;
  const Result<std::string> token = SignAccess(access, *secret);
  if (!token.ok()) return token.status();
  std::cout << *token << "\n";
  const auto gateway = std::find_if(gateways.rbegin(), gateways.rend(), [&](const GatewayState& each) { return each.token == *secret; });
  if (gateway != gateways.rend()) {
    std::cout << fmt::format("{}#token={}{}\n", gateway->address, *token,
                             options.datasets.size() == 1 ? "&dataset=" + options.datasets.front() : "");
  }
  return FlushOutput();
}

}  // namespace slabstream
