#include "tests/simulator/model_client.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace slabstream {
namespace {

constexpr Duration kPingInterval = std::chrono::seconds(1), kPatience = std::chrono::seconds(8);
constexpr int kSubmissions = 4;

}  // namespace

void ModelClient::Submit(SubmitFrame submit) {
  if (vanished_) return;
  if (open_.empty()) last_pong_ = service_.time();
  ++submitted_;
  open_[submit.request] = {submit, 0, 1};
  send_(std::move(submit));
  if (!pinging_) Ping();
}

void ModelClient::Cancel(RequestId request) {
  if (vanished_ || open_.count(request) == 0) return;
  cancelled_.insert(request);
  send_(CancelFrame{request});
}

void ModelClient::Ping() {
  pinging_ = !idle();
  if (!pinging_) return;
  if (service_.time() >= last_pong_ + kPatience) {
    while (!open_.empty()) End(open_.begin()->first, {Status::Unavailable("the service does not answer"), {}, true});
    pinging_ = false;
    return;
  }
  ClientPing ping{++nonce_, {}};
  for (const auto& [request, open] : open_) ping.open.push_back(request);
  asked_[ping.nonce] = ping.open;
  send_(std::move(ping));
  service_.queue().After(kPingInterval, [this] { Ping(); });
}

void ModelClient::Deliver(const CoordinatorToClient& message) {
  if (vanished_) return;
  if (const auto* reply = std::get_if<FrameReply>(&message)) {
    const auto open = open_.find(reply->request);
    if (open == open_.end()) return;
    EXPECT_EQ(reply->size, open->second.submit.frame.size) << "the picture of another request";
    if (reply->groups_done == reply->group_count) End(reply->request, {{}, reply->statistics, false});
  } else if (const auto* failed = std::get_if<FrameFailed>(&message)) {
    End(failed->request, {failed->status, {}, false});
  } else if (const auto* pong = std::get_if<ClientPong>(&message)) {
    const auto asked = asked_.find(pong->nonce);
    if (asked == asked_.end()) return;
    last_pong_ = service_.time();
    for (const RequestId request : asked->second) {
      const auto open = open_.find(request);
      if (open == open_.end()) continue;
      const bool known = std::find(pong->known.begin(), pong->known.end(), request) != pong->known.end();
      open->second.unknown = known ? 0 : open->second.unknown + 1;
      if (open->second.unknown < 2) continue;
      open->second.unknown = 0;
      if (++open->second.submissions > kSubmissions) {
        End(request, {Status::Unavailable("the service forgets the request"), {}, true});
      } else {
        send_(open->second.submit);
      }
    }
    asked_.erase(asked);
  }
}

void ModelClient::End(RequestId request, Ended how) {
  if (open_.erase(request) == 0) return;
  EXPECT_TRUE(ended_.emplace(request, std::move(how)).second) << "request " << request << " ends twice";
}

}  // namespace slabstream
