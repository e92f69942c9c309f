#include "gateway/requests_under_way.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <utility>

namespace slabstream {

void RequestsUnderWay::Begin(ReplyFunction reply, const Gone& gone, const Start& start) {
  if (open_ >= most_) {
    metrics_.CountRefusal(what_);
    return reply(Failure(429, fmt::format("{} {} are under way, which is the limit", open_, what_)));
  }
  ++open_;
  const auto ended = std::make_shared<bool>(false);
  const ServiceLink::Ticket ticket = start([this, reply = std::move(reply), ended](std::function<HttpReply()> make) {
    boost::asio::post(io_, [this, reply, ended, make = std::move(make)] {
      if (std::exchange(*ended, true)) return;
      --open_;
      reply(make());
    });
  });
  *gone = [this, ended, ticket] {
    if (std::exchange(*ended, true)) return;
    --open_;
    metrics_.CountRefusal("gone");
    link_.Cancel(ticket);
  };
}

}  // namespace slabstream
