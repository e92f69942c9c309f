#include "coordinator/request_queue.h"

#include <algorithm>
#include <utility>

namespace slabstream {

void RequestQueue::Push(OpenRequest request) {
  auto queue = std::ranges::find(turn_, request.client, &ClientQueue::client);
  if (queue == turn_.end()) queue = turn_.insert(queue, ClientQueue{.client = request.client});
  queue->requests.push_back(std::move(request));
}

const OpenRequest* RequestQueue::FindNext(const Predicate& ready) const {
  for (const ClientQueue& queue : turn_) {
    const auto found = std::ranges::find_if(queue.requests, ready);
    if (found != queue.requests.end()) return &*found;
  }
  return nullptr;
}

OpenRequest RequestQueue::Take(const OpenRequest& next) {
  const auto queue = std::ranges::find(turn_, next.client, &ClientQueue::client);
  const auto found = std::ranges::find_if(queue->requests, [&](const OpenRequest& request) { return &request == &next; });
  OpenRequest request = std::move(*found);
  queue->requests.erase(found);
  if (queue->requests.empty()) {
    turn_.erase(queue);
  } else {
    turn_.splice(turn_.end(), turn_, queue);
  }
  return request;
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

void RequestQueue::ForEach(const std::function<void(OpenRequest&)>& visit) {
  for (ClientQueue& queue : turn_) {
    for (OpenRequest& request : queue.requests) visit(request);
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
  const auto queue = std::ranges::find(turn_, client, &ClientQueue::client);
  return queue != turn_.end() && std::ranges::any_of(queue->requests, [&](const OpenRequest& r) { return r.Is(client, request); });
}

std::size_t RequestQueue::size() const {
  std::size_t count = 0;
  for (const ClientQueue& queue : turn_) count += queue.requests.size();
  return count;
}

std::size_t RequestQueue::CountOf(PeerToken client) const {
  const auto queue = std::ranges::find(turn_, client, &ClientQueue::client);
  return queue == turn_.end() ? 0 : queue->requests.size();
}

std::uint32_t RequestQueue::PositionOf(PeerToken client, RequestId request) {
  std::uint32_t position = 0;
  VisitInTurn([&](const OpenRequest& r) {
    if (r.Is(client, request)) return false;
    ++position;
    return true;
  });
  return position;
}

}  // namespace slabstream
