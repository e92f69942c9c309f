// The listener that --metrics starts in a coordinator or worker: GET /metrics, and nothing else, on a thread of its own. Requests have
// limits of size and time, so that no peer can hold up or fill the process; it serves a few connections at a time.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/cli/command.h"
#include "common/http/address.h"

namespace slabstream {

struct MetricsOptions {
  std::optional<ListenAddress> listen;  // none: there is no listener
  std::string token_file;               // empty: everybody may ask, which is for loopback alone
};

// --metrics and --metrics-token-file.
void AddMetricsOptions(const Command& app, MetricsOptions& options);

// "[HOST:]PORT". InvalidArgument.
Result<ListenAddress> ParseMetricsAddress(std::string_view option, std::string_view text);

class MetricsListener {
 public:
  // `text` is called on the listener's thread until the destructor returns. Null if no address is given. InvalidArgument: an address that
  // is not loopback without a token, or the token's file; Unavailable: the address.
  static Result<std::unique_ptr<MetricsListener>> Start(const MetricsOptions& options, std::function<std::string()> text);
  ~MetricsListener();

  std::string url() const;  // "http://127.0.0.1:9464/metrics"

 private:
  struct Impl;
  explicit MetricsListener(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
