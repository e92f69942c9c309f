// HttpPoster: sends bodies to a server, one at a time, and reads its answers. No TLS.
#pragma once

#include <memory>
#include <string>
#include <string_view>

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

  explicit HttpPoster(HttpUrl url);
  ~HttpPoster();

  // POST with a connection of its own; waits for the whole answer. One thread at a time. Unavailable, naming the server: there is no
  // connection, or no answer; DeadlineExceeded: none within `time`.
  Result<HttpAnswer> Post(std::string_view type, const std::string& body, Duration time);
  // Any thread. What is under way, and whatever is posted from now on, has until then and no longer.
  void EndBy(Time limit);

  const HttpUrl& url() const { return url_; }

 private:
  struct Impl;
  const HttpUrl url_;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
