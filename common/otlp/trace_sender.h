// Sends spans to an OpenTelemetry collector, by OTLP over HTTP without TLS: collectors run beside those whose spans they take.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

#include "common/base/limited_log.h"
#include "common/base/status.h"
#include "common/http/address.h"
#include "common/http/http_poster.h"
#include "common/otlp/otlp_json.h"

namespace slabstream {

// "http://HOST:PORT[/PATH]"; the path is /v1/traces unless there is one. InvalidArgument.
Result<HttpUrl> ParseCollector(std::string_view option, std::string_view text);

// What $OTEL_EXPORTER_OTLP_ENDPOINT names; as the standard wants it, /v1/traces follows. none: it is not set. InvalidArgument.
Result<std::optional<HttpUrl>> CollectorOfProcess();

// Sends now, some hundred spans at a time. Unavailable, DeadlineExceeded: nobody answers, or the collector refuses; then the rest is not
// sent.
Status SendSpans(const HttpUrl& collector, const TraceSource& source, std::span<const TraceSpan> spans);

// Sends from a thread of its own. Whoever puts a trace never waits: what the collector does not take in time is dropped and counted, and
// the log says so once a minute.
class TraceSender {
 public:
  TraceSender(HttpUrl collector, TraceSource source);
  ~TraceSender();  // sends what waits, in two seconds at most

  // The spans of one trace. Any thread.
  void Put(std::vector<TraceSpan> trace);

  struct Counts {
    std::uint64_t sent = 0, dropped = 0;  // traces
  };
  Counts counts() const;  // any thread

 private:
  void Run();

  HttpPoster poster_;
  const TraceSource source_;
  LimitedLog log_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::vector<TraceSpan>> queue_;
  std::size_t queued_spans_ = 0;
  Counts counts_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace slabstream
