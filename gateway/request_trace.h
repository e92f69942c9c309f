// RequestTrace: the trace of one request over HTTP, from its arrival to its reply. Its parts are told in turn, by one thread at a time;
// when nobody holds it any more, it goes to the collector.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "client/client.h"
#include "client/telemetry/frame_trace.h"
#include "common/base/status.h"
#include "common/http/http.h"
#include "common/otlp/trace_sender.h"

namespace slabstream {

class RequestTrace {
 public:
  // The request's span belongs to the one that its header `traceparent` names, if it has one. Null if there is no sender, or if the caller
  // says that nobody records the trace. `scheme`: "http" or "https".
  static std::shared_ptr<RequestTrace> Begin(const std::shared_ptr<TraceSender>& sender, const HttpRequest& request,
                                             std::string_view scheme, std::string_view route);
  RequestTrace(std::shared_ptr<TraceSender> sender, TraceSpan root, const WallClock& clock);
  ~RequestTrace();
  RequestTrace(const RequestTrace&) = delete;
  RequestTrace& operator=(const RequestTrace&) = delete;

  // Frames that were requested together; the last picture has come just now.
  void AddFrames(const std::string& dataset, const std::vector<Picture>& pictures);
  // Instead: they failed.
  void AddFailure(const std::string& dataset, Time begin, const Status& failure);
  // A picture was compressed, from `begin` until now.
  void AddEncoding(Time begin);
  // The reply leaves. Without it, whoever asked has gone.
  void End(unsigned status);

 private:
  const std::shared_ptr<TraceSender> sender_;
  const WallClock clock_;
  TraceSpan root_;
  bool ended_ = false;
  std::vector<TraceSpan> spans_;  // but the root
};

using RequestTracePointer = std::shared_ptr<RequestTrace>;

}  // namespace slabstream
