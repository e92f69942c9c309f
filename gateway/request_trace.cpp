#include "gateway/request_trace.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "common/otlp/trace_context.h"

namespace slabstream {

std::shared_ptr<RequestTrace> RequestTrace::Begin(const std::shared_ptr<TraceSender>& sender, const HttpRequest& request,
                                                  std::string_view scheme, std::string_view route) {
  if (sender == nullptr) return nullptr;
  const std::optional<TraceParent> parent = ParseTraceParent(request.traceparent);
  if (parent && !parent->sampled) return nullptr;
  const WallClock clock;
  TraceSpan root;
  root.trace = parent ? parent->trace : NewTraceId();
  if (parent) root.parent = parent->span;
  root.name = request.method + " " + std::string(route);
  root.kind = SpanKind::kServer;
  root.begin_ns = clock.At(MonotonicNow());
  // Not the query: it may hold the token.
  root.attributes = {{"http.request.method", request.method},
                     {"http.route", std::string(route)},
                     {"url.path", std::string(route)},
                     {"url.scheme", std::string(scheme)}};
  return std::make_shared<RequestTrace>(sender, std::move(root), clock);
}

RequestTrace::RequestTrace(std::shared_ptr<TraceSender> sender, TraceSpan root, const WallClock& clock)
    : sender_(std::move(sender)), clock_(clock), root_(std::move(root)) {}

RequestTrace::~RequestTrace() {
  if (!ended_) {
    root_.end_ns = clock_.At(MonotonicNow());
    root_.error = "whoever asked has gone";
  }
  spans_.push_back(std::move(root_));
  sender_->Put(std::move(spans_));
}

void RequestTrace::AddFrames(const std::string& dataset, const std::vector<Picture>& pictures) {
  const Time end = MonotonicNow();
  Duration longest{};
  for (const Picture& picture : pictures) longest = std::max(longest, picture.latency);
  const Time begin = end - longest;
  for (const Picture& picture : pictures) AddFrame(spans_, root_, clock_, begin, begin + picture.latency, dataset, picture.statistics);
}

void RequestTrace::AddFailure(const std::string& dataset, Time begin, const Status& failure) {
  TraceSpan frame = ChildOf(root_, "frame", clock_.At(begin), clock_.At(MonotonicNow()));
  frame.kind = SpanKind::kClient;
  frame.attributes = {{"slabstream.dataset", dataset}, {"error.type", std::string(ToString(failure.code()))}};
  frame.error = failure.message();
  spans_.push_back(std::move(frame));
}

void RequestTrace::AddEncoding(Time begin) { spans_.push_back(ChildOf(root_, "encode-file", clock_.At(begin), clock_.At(MonotonicNow()))); }

void RequestTrace::End(unsigned status) {
  constexpr unsigned kServerFailed = 500;
  ended_ = true;
  root_.end_ns = clock_.At(MonotonicNow());
  root_.attributes.emplace_back("http.response.status_code", std::int64_t{status});
  if (status < kServerFailed) return;
  root_.attributes.emplace_back("error.type", std::to_string(status));
  root_.error.emplace();
}

}  // namespace slabstream
