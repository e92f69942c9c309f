#include "coordinator/frames/request_queue.h"

#include <utility>

namespace slabstream {

void RequestQueue::Push(OpenRequest request) {
  ClientQueue& queue = clients_[request.client];
  if (queue.requests.empty()) turns_.Join(request.client);
  queue.requests.push_back(std::move(request));
}

const OpenRequest* RequestQueue::FindNext(const Predicate& ready) const {
  const OpenRequest* next = nullptr;
  FairTurns<PeerToken>::Turn first;
  for (const auto& [client, queue] : clients_) {
    const auto turn = turns_.TurnOf(client);
    if (next != nullptr && first < turn) continue;
    const auto found = std::ranges::find_if(queue.requests, ready);
    if (found == queue.requests.end()) continue;
    next = &*found;
    first = turn;
  }
  return next;
}

OpenRequest RequestQueue::Take(const OpenRequest& next) {
  ClientQueue& queue = clients_.at(next.client);
  const auto found = std::ranges::find_if(queue.requests, [&](const OpenRequest& request) { return &request == &next; });
  OpenRequest request = std::move(*found);
  queue.requests.erase(found);
  request.used = UsedBy(request.client);
  request.charged = queue.expected;
  turns_.Take(request.client);
  turns_.Charge(request.client, request.charged);
  return request;
}

void RequestQueue::Settle(const OpenRequest& taken, Duration cost) {
  const auto client = clients_.find(taken.client);
  if (client == clients_.end()) return;
  turns_.Charge(taken.client, cost - taken.charged);
  client->second.expected = cost;
}

std::vector<OpenRequest> RequestQueue::Extract(const Predicate& wanted) {
  std::vector<OpenRequest> extracted;
  for (auto& [client, queue] : clients_) {
    std::erase_if(queue.requests, [&](OpenRequest& request) {
      if (!wanted(request)) return false;
      extracted.push_back(request);
      return true;
    });
  }
  return extracted;
}

std::deque<OpenRequest> RequestQueue::Forget(PeerToken client) {
  turns_.Forget(client);
  auto forgotten = clients_.extract(client);
  return forgotten.empty() ? std::deque<OpenRequest>() : std::move(forgotten.mapped().requests);
}

void RequestQueue::ForEach(const std::function<void(OpenRequest&)>& visit) {
  for (auto& [client, queue] : clients_) {
    for (OpenRequest& request : queue.requests) visit(request);
  }
}

void RequestQueue::VisitInTurn(const std::function<bool(OpenRequest&)>& visit) {
  struct Waiting {
    FairTurns<PeerToken>::Turn turn;
    PeerToken client = 0;
    ClientQueue* queue = nullptr;
    std::size_t visited = 0;
  };
  const auto later = [](const Waiting& a, const Waiting& b) { return a.turn > b.turn; };
  FairTurns<PeerToken> turns = turns_;
  std::vector<Waiting> heap;  // the first is next
  for (auto& [client, queue] : clients_) {
    if (!queue.requests.empty()) heap.push_back({turns.TurnOf(client), client, &queue});
  }
  std::ranges::make_heap(heap, later);
  while (!heap.empty()) {
    std::ranges::pop_heap(heap, later);
    Waiting& next = heap.back();
    if (!visit(next.queue->requests[next.visited])) return;
    if (++next.visited == next.queue->requests.size()) {
      heap.pop_back();
    } else {
      turns.Take(next.client);
      turns.Charge(next.client, next.queue->expected);
      next.turn = turns.TurnOf(next.client);
      std::ranges::push_heap(heap, later);
    }
  }
}

void RequestQueue::VisitFirsts(const std::function<bool(OpenRequest&)>& visit) {
  std::vector<std::pair<FairTurns<PeerToken>::Turn, ClientQueue*>> queues;
  for (auto& [client, queue] : clients_) {
    if (!queue.requests.empty()) queues.emplace_back(turns_.TurnOf(client), &queue);
  }
  std::ranges::sort(queues, {}, [](const auto& each) { return each.first; });
  for (const auto& [turn, queue] : queues) {
    if (!visit(queue->requests.front())) return;
  }
}

const OpenRequest* RequestQueue::Find(PeerToken client, RequestId request) const {
  return FindIf(client, [&](const OpenRequest& r) { return r.Is(client, request); });
}

const OpenRequest* RequestQueue::FindCoarse(PeerToken client, RequestId request) const {
  return FindIf(client, [&](const OpenRequest& r) { return r.coarse && r.submit.request == request; });
}

const OpenRequest* RequestQueue::FindIf(PeerToken client, const Predicate& wanted) const {
  const auto queue = clients_.find(client);
  if (queue == clients_.end()) return nullptr;
  const auto found = std::ranges::find_if(queue->second.requests, wanted);
  return found == queue->second.requests.end() ? nullptr : &*found;
}

std::size_t RequestQueue::size() const {
  std::size_t count = 0;
  for (const auto& [client, queue] : clients_) count += queue.requests.size();
  return count;
}

std::size_t RequestQueue::clients() const {
  return std::size_t(std::ranges::count_if(clients_, [](const auto& each) { return !each.second.requests.empty(); }));
}

std::size_t RequestQueue::CountOf(PeerToken client) const {
  const auto queue = clients_.find(client);
  return queue == clients_.end() ? 0 : std::size_t(std::ranges::count(queue->second.requests, false, &OpenRequest::coarse));
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
