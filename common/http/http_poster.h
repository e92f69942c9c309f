// HttpPoster: sends bodies to a server, one at a time, and reads its answers. No TLS.
#pragma once

#include <atomic>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/http/address.h"

namespace slabstream {

struct HttpAnswer {
  unsigned status = 0;
  std::string body;  // at most HttpPoster::kMostAnswerBytes
};

class HttpPoster {
 public:
  static constexpr std::size_t kMostAnswerBytes = std::size_t{64} << 10;

  explicit HttpPoster(HttpUrl url) : url_(std::move(url)) {}

  // POST with a connection of its own; waits for the whole answer. One thread at a time. Unavailable, naming the server: there is no
  // connection, or no answer; DeadlineExceeded: none within `time`.
  Result<HttpAnswer> Post(std::string_view type, const std::string& body, Duration time);
  // Any thread. What is under way ends at most a second after `limit`, and what is posted after it fails at once.
  void EndBy(Time limit) { limit_ = limit; }

  const HttpUrl& url() const { return url_; }

 private:
  const HttpUrl url_;
  std::atomic<Time> limit_{Time::max()};
};

}  // namespace slabstream
