// ModelClient: a client that submits requests, pings while they are open, submits again what the service does not know any more, and gives
// up when nobody answers; or cancels, or vanishes. It keeps how each request ended.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <vector>

#include "common/wire/any_message.h"
#include "simulator/simulated_service.h"

namespace slabstream {

class ModelClient {
 public:
  using Send = std::function<void(ClientToFrames)>;

  ModelClient(SimulatedService& service, Send send) : service_(service), send_(std::move(send)) {}

  struct Ended {
    Status status;  // ok: the picture arrived
    FrameStatistics statistics;
    bool given_up = false;  // by this client, not by the service
  };

  void Submit(SubmitFrame submit);
  void Cancel(RequestId request);
  void Vanish() { vanished_ = true; }
  void Deliver(const CoordinatorToClient& message);

  bool idle() const { return vanished_ || open_.empty(); }
  bool vanished() const { return vanished_; }
  std::size_t submitted() const { return submitted_; }
  const SubmitFrame* Find(RequestId request) const {  // null: it is not open
    const auto open = open_.find(request);
    return open == open_.end() ? nullptr : &open->second.submit;
  }
  const std::map<RequestId, Ended>& ended() const { return ended_; }
  const std::set<RequestId>& cancelled() const { return cancelled_; }

 private:
  struct Open {
    SubmitFrame submit;
    int unknown = 0;  // pongs in a row that did not know it
    int submissions = 1;
  };

  void Ping();
  void End(RequestId request, Ended how);

  SimulatedService& service_;
  Send send_;
  std::size_t submitted_ = 0;
  std::map<RequestId, Open> open_;
  std::map<RequestId, Ended> ended_;
  std::set<RequestId> cancelled_;
  bool vanished_ = false;
  bool pinging_ = false;
  std::uint64_t nonce_ = 0;
  std::map<std::uint64_t, std::vector<RequestId>> asked_;  // by nonce
  Time last_pong_;
};

}  // namespace slabstream
