#include "gateway/reply.h"

namespace slabstream {
namespace {

unsigned HttpStatus(StatusCode code) {
  switch (code) {
    case StatusCode::kOk: return 200;
    case StatusCode::kInvalidArgument: return 400;
    case StatusCode::kNotFound: return 404;
    case StatusCode::kUnavailable:
    case StatusCode::kResourceExhausted:
    case StatusCode::kCancelled: return 503;
    case StatusCode::kDeadlineExceeded: return 504;
    case StatusCode::kDataLoss:
    case StatusCode::kInternal: break;
  }
  return 500;
}

}  // namespace

HttpReply JsonReply(const Json& json) { return {.body = json.dump() + "\n"}; }
HttpReply Failure(unsigned status, std::string_view message) {
  HttpReply reply = JsonReply({{"error", message}});
  reply.status = status;
  return reply;
}
HttpReply Failure(const Status& status) { return Failure(HttpStatus(status.code()), status.message()); }

}  // namespace slabstream
