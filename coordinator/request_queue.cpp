#include "coordinator/request_queue.h"

#include <algorithm>
#include <utility>

namespace slabstream {

void RequestQueue::Push(OpenRequest request) {
  auto queue = std::find_if(turn_.begin(), turn_.end(), [&](const ClientQueue& q) { return q.client == request.client; });
  if (queue == turn_.end()) queue = turn_.insert(queue, ClientQueue{.client = request.client});
  queue->requests.push_back(std::move(request));
}

std::optional<OpenRequest> RequestQueue::TakeNext(const Predicate& ready) {
  for (auto queue = turn_.begin(); queue != turn_.end(); ++queue) {
    const auto found = std::find_if(queue->requests.begin(), queue->requests.end(), ready);
    if (found == queue->requests.end()) continue;
    OpenRequest request = std::move(*found);
    queue->requests.erase(found);
    if (queue->requests.empty()) {
      turn_.erase(queue);
    } else {
      turn_.splice(turn_.end(), turn_, queue);
    }
    return request;
  }
  return std::nullopt;
}

std::vector<OpenRequest> RequestQueue::Extract(const Predicate& wanted) {
  std::vector<OpenRequest> extracted;
  for (ClientQueue& queue : turn_) {
    std::erase_if(queue.requests, [&](OpenRequest& request) {
      if (!wanted(request)) return false;
      extracted.push_back(request);
      return true;
    });
  }
  turn_.remove_if([](const ClientQueue& queue) { return queue.requests.empty(); });
  return extracted;
}

void RequestQueue::ForEach(const std::function<void(const OpenRequest&)>& visit) const {
  for (const ClientQueue& queue : turn_) {
    for (const OpenRequest& request : queue.requests) visit(request);
  }
}

void RequestQueue::Update(const std::function<void(OpenRequest&)>& change) {
  for (ClientQueue& queue : turn_) {
    for (OpenRequest& request : queue.requests) change(request);
  }
}

void RequestQueue::VisitInTurn(const std::function<bool(OpenRequest&)>& visit) {
  bool more = true;
  for (std::size_t round = 0; more; ++round) {
    more = false;
    for (ClientQueue& queue : turn_) {
      if (round >= queue.requests.size()) continue;
      more = true;
      if (!visit(queue.requests[round])) return;
    }
  }
}

bool RequestQueue::Contains(PeerToken client, RequestId request) const {
  return std::any_of(turn_.begin(), turn_.end(), [&](const ClientQueue& queue) {
    return queue.client == client &&
           std::any_of(queue.requests.begin(), queue.requests.end(), [&](const OpenRequest& r) { return r.submit.request == request; });
  });
}

std::size_t RequestQueue::size() const {
  std::size_t count = 0;
  for (const ClientQueue& queue : turn_) count += queue.requests.size();
  return count;
}

std::size_t RequestQueue::CountOf(PeerToken client) const {
  const auto queue = std::find_if(turn_.begin(), turn_.end(), [&](const ClientQueue& q) { return q.client == client; });
  return queue == turn_.end() ? 0 : queue->requests.size();
}

std::uint32_t RequestQueue::PositionOf(PeerToken client, RequestId request) const {
  const auto own = std::find_if(turn_.begin(), turn_.end(), [&](const ClientQueue& q) { return q.client == client; });
  CHECK(own != turn_.end()) << "client " << client;
  const auto found =
      std::find_if(own->requests.begin(), own->requests.end(), [&](const OpenRequest& r) { return r.submit.request == request; });
  CHECK(found != own->requests.end()) << "request " << request;
  // Before its turn, `before` requests of each client behind it in turn are served, and one more of each client in front of it.
  const std::size_t before = std::size_t(found - own->requests.begin());
  std::size_t position = before;
  std::size_t served = before + 1;
  for (auto queue = turn_.begin(); queue != turn_.end(); ++queue) {
    if (queue == own) {
      served = before;
    } else {
      position += std::min(queue->requests.size(), served);
    }
  }
  return std::uint32_t(position);
}

}  // namespace slabstream
