#include "common/otlp/trace_sender.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "common/base/printable.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

constexpr std::string_view kTracesPath = "/v1/traces";
constexpr std::size_t kBatch = 512;             // spans of a request; a trace is never divided by TraceSender
constexpr std::size_t kMostQueued = 16 * 1024;  // spans that wait for a collector
constexpr Duration kPatience = std::chrono::seconds(5), kFarewell = std::chrono::seconds(1);

Status PostSpans(HttpPoster& poster, const TraceSource& source, std::span<const TraceSpan> spans) {
  const Result<HttpAnswer> answer = poster.Post("application/json", OtlpTraces(source, spans), kPatience);
  if (!answer.ok()) return answer.status();
  if (answer->status < 200 || answer->status > 299) {
    constexpr std::size_t kMostShown = 200;
    const std::string shown = answer->body.substr(0, kMostShown);
    return Status::Unavailable(
        Printable(fmt::format("{} answers {}{}{}", ToString(poster.url()), answer->status, shown.empty() ? "" : ": ", shown)));
  }
  const std::string rejection = RejectionIn(answer->body);
  if (!rejection.empty()) return Status::Unavailable(Printable(fmt::format("{} {}", ToString(poster.url()), rejection)));
  return Status::Ok();
}

}  // namespace

Result<HttpUrl> ParseCollector(std::string_view option, std::string_view text) {
  Result<HttpUrl> url = ParseHttpUrl(option, text);
  if (url.ok() && url->target == "/") url->target = kTracesPath;
  return url;
}

Result<std::optional<HttpUrl>> CollectorOfProcess() {
  const char* const text = std::getenv("OTEL_EXPORTER_OTLP_ENDPOINT");
  if (text == nullptr || *text == '\0') return std::optional<HttpUrl>();
  Result<HttpUrl> url = ParseHttpUrl("$OTEL_EXPORTER_OTLP_ENDPOINT", text);
  if (!url.ok()) return url.status();
  if (url->target.ends_with('/')) url->target.pop_back();
  url->target += kTracesPath;
  return std::optional(*std::move(url));
}

Status SendSpans(const HttpUrl& collector, const TraceSource& source, std::span<const TraceSpan> spans) {
  HttpPoster poster(collector);
  while (!spans.empty()) {
    const std::size_t count = std::min(spans.size(), kBatch);
    if (Status status = PostSpans(poster, source, spans.first(count)); !status.ok()) return status;
    spans = spans.subspan(count);
  }
  return Status::Ok();
}

TraceSender::TraceSender(HttpUrl collector, TraceSource source)
    : poster_(std::move(collector)), source_(std::move(source)), log_(1, std::chrono::minutes(1)), thread_([this] { Run(); }) {}

TraceSender::~TraceSender() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  poster_.EndBy(MonotonicNow() + kFarewell);
  changed_.notify_one();
  thread_.join();
}

void TraceSender::Put(std::vector<TraceSpan> trace) {
  const std::lock_guard lock(mutex_);
  if (queued_spans_ + trace.size() > kMostQueued) {
    ++counts_.dropped;
    return;
  }
  queued_spans_ += trace.size();
  queue_.push_back(std::move(trace));
  changed_.notify_one();
}

TraceSender::Counts TraceSender::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void TraceSender::Run() {
  std::uint64_t dropped_before = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (queue_.empty()) return;
    std::vector<TraceSpan> batch;
    std::uint64_t traces = 0;
    for (; !queue_.empty() && (traces == 0 || batch.size() + queue_.front().size() <= kBatch); ++traces) {
      std::ranges::move(queue_.front(), std::back_inserter(batch));
      queue_.pop_front();
    }
    queued_spans_ -= batch.size();
    lock.unlock();
    const Status status = Guarded("traces", [&] { return PostSpans(poster_, source_, batch); });
    lock.lock();
    (status.ok() ? counts_.sent : counts_.dropped) += traces;
    if (std::exchange(dropped_before, counts_.dropped) == counts_.dropped) continue;
    log_.Warning(fmt::format("traces are dropped: {}", status.ok() ? HostOf(poster_.url()) + " takes them too slowly" : status.message()));
  }
}

}  // namespace slabstream
