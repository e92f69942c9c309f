// RequestsUnderWay: what HTTP requests have under way at the service, so many at a time and no more. Each ends once: by its reply, or
// because its connection has closed. Functions are called on the io thread, unless their comment names another.
#pragma once

#include <functional>
#include <string>

#include "gateway/metrics.h"
#include "gateway/reply.h"
#include "gateway/request_fields.h"
#include "gateway/request_trace.h"
#include "gateway/service_link.h"

namespace boost::asio {
class io_context;
}

namespace slabstream {

inline constexpr Duration kAnswerDeadline = std::chrono::minutes(2);  // how long the service may take

// A request over HTTP.
struct Asked {
  PictureFields fields;  // all but the token
  std::string body;      // of a POST; in JSON its fields are among `fields`
  bool post = false;
  Asker asker;
  ReplyFunction reply;
  Gone gone;
  RequestTracePointer trace;  // may be null
};

class RequestsUnderWay {
 public:
  // `what` is the plural of one, and the reason of refusals. All must outlive this.
  RequestsUnderWay(boost::asio::io_context& io, Metrics& metrics, ServiceLink& link, std::string what, int most)
      : io_(io), metrics_(metrics), link_(link), what_(std::move(what)), most_(most) {}

  // Any thread: makes the reply on the io thread, if somebody still waits for it.
  using Finish = std::function<void(std::function<HttpReply()>)>;
  using Start = std::function<ServiceLink::Ticket(Finish)>;
  // Replies 429 if there are too many; else starts one, and cancels its ticket if `request.gone` says so.
  void Begin(ReplyFunction reply, const Gone& gone, const Start& start);

 private:
  boost::asio::io_context& io_;
  Metrics& metrics_;
  ServiceLink& link_;
  const std::string what_;
  const int most_;
  int open_ = 0;
};

}  // namespace slabstream
