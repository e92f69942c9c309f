#include "coordinator/frames/request_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

OpenRequest Request(PeerToken client, RequestId id, const std::string& dataset = "d") {
  OpenRequest request{.client = client};
  request.submit.request = id;
  request.submit.frame.dataset = dataset;
  return request;
}

bool Any(const OpenRequest&) { return true; }

std::optional<OpenRequest> TakeNext(RequestQueue& queue, const RequestQueue::Predicate& ready) {
  const OpenRequest* const next = queue.FindNext(ready);
  return next == nullptr ? std::nullopt : std::optional(queue.Take(*next));
}

// Takes the next request, whose frame costs a second, and returns its client.
PeerToken Serve(RequestQueue& queue, const RequestQueue::Predicate& ready) {
  const OpenRequest served = TakeNext(queue, ready).value();
  queue.Settle(served, std::chrono::seconds(1));
  return served.client;
}

// The clients of the next four.
std::multiset<PeerToken> ServeFour(RequestQueue& queue, const RequestQueue::Predicate& ready) {
  std::multiset<PeerToken> served;
  while (served.size() < 4) served.insert(Serve(queue, ready));
  return served;
}

TEST(RequestQueue, ClientsAreServedInTurn) {
  RequestQueue queue;
  for (RequestId id = 1; id <= 3; ++id) queue.Push(Request(1, id));
  queue.Push(Request(2, 1));
  queue.Push(Request(2, 2));
  std::vector<std::pair<PeerToken, RequestId>> served;
  while (auto next = TakeNext(queue, Any)) served.emplace_back(next->client, next->submit.request);
  EXPECT_EQ(served, (std::vector<std::pair<PeerToken, RequestId>>{{1, 1}, {2, 1}, {1, 2}, {2, 2}, {1, 3}}));
}

TEST(RequestQueue, ClientsThatAlwaysAskGetEqualTime) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  constexpr Duration kLongest = std::chrono::milliseconds(1000);
  for (int round = 0; round < 20; ++round) {
    RequestQueue queue;
    const int clients = random.Integer(2, 6), in_flight = random.Integer(1, 3);
    std::map<PeerToken, Duration> usual, used;
    for (PeerToken client = 1; client <= PeerToken(clients); ++client) {
      usual[client] = kLongest / random.Integer(1, 200);
      for (RequestId id = 1; id <= 4; ++id) queue.Push(Request(client, id));  // more than can run
    }
    std::deque<OpenRequest> running;
    for (RequestId id = 10; id < 2000; ++id) {
      while (running.size() < std::size_t(in_flight)) running.push_back(*TakeNext(queue, Any));
      const OpenRequest ended = std::move(running.front());
      running.pop_front();
      const Duration cost = usual[ended.client] * random.Integer(50, 100) / 100;
      queue.Settle(ended, cost);
      used[ended.client] += cost;
      queue.Push(Request(ended.client, id));
    }
    const auto [least, most] = std::ranges::minmax(used | std::views::values);
    EXPECT_LE(most - least, 2 * in_flight * kLongest) << clients << " clients, " << in_flight << " frames at a time";
  }
}

TEST(RequestQueue, WhoDidNotAskHasNotSavedUpTime) {
  RequestQueue queue;
  queue.Push(Request(2, 1));
  Serve(queue, Any);
  for (RequestId id = 1; id <= 100; ++id) {
    queue.Push(Request(1, id));
    Serve(queue, Any);
  }
  for (RequestId id = 101; id <= 104; ++id) {
    queue.Push(Request(1, id));
    queue.Push(Request(2, id));
  }
  EXPECT_EQ(ServeFour(queue, Any), (std::multiset<PeerToken>{1, 1, 2, 2}));
}

TEST(RequestQueue, WhoHadToWaitForItsDatasetDoesNotHoldUpTheOthers) {
  RequestQueue queue;
  for (RequestId id = 1; id <= 10; ++id) queue.Push(Request(1, id, "loading"));
  bool loaded = false;
  const auto ready = [&](const OpenRequest& request) { return loaded || request.submit.frame.dataset != "loading"; };
  for (RequestId id = 1; id <= 100; ++id) {
    queue.Push(Request(2, id));
    Serve(queue, ready);
  }
  loaded = true;
  for (RequestId id = 101; id <= 104; ++id) queue.Push(Request(2, id));
  EXPECT_EQ(ServeFour(queue, ready), (std::multiset<PeerToken>{1, 1, 2, 2}));
}

TEST(RequestQueue, RequestsThatAreNotReadyLetOthersPass) {
  RequestQueue queue;
  queue.Push(Request(1, 1, "loading"));
  queue.Push(Request(1, 2));
  queue.Push(Request(2, 1, "loading"));
  const auto ready = [](const OpenRequest& request) { return request.submit.frame.dataset != "loading"; };
  const auto next = TakeNext(queue, ready);
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->Is(1, 2));
  EXPECT_FALSE(TakeNext(queue, ready));
  EXPECT_EQ(queue.size(), 2U);
}

TEST(RequestQueue, PositionsAreTheOrderOfService) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 200; ++round) {
    RequestQueue queue;
    RequestId id = 0;
    const int count = random.Integer(1, 30);
    for (int i = 0; i < count; ++i) {
      queue.Push(Request(random.Integer<PeerToken>(1, 5), ++id));
      if (!random.Chance(0.2)) continue;
      const auto taken = TakeNext(queue, Any);  // what it cost changes the order of the clients
      if (taken && random.Chance(0.7)) queue.Settle(*taken, std::chrono::milliseconds(random.Integer(0, 100)));
    }
    std::map<std::pair<PeerToken, RequestId>, std::uint32_t> promised;
    queue.ForEach([&](const OpenRequest& r) { promised[{r.client, r.submit.request}] = queue.PositionOf(r.client, r.submit.request); });
    ASSERT_EQ(promised.size(), queue.size());
    for (std::uint32_t position = 0; const auto next = TakeNext(queue, Any); ++position) {
      EXPECT_EQ((promised[{next->client, next->submit.request}]), position);
    }
  }
}

TEST(RequestQueue, VisitsInTheOrderInWhichRequestsAreServed) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  RequestQueue queue;
  for (int i = 0; i < 40; ++i) queue.Push(Request(random.Integer<PeerToken>(1, 5), RequestId(i)));
  std::vector<RequestId> visited, served;
  queue.VisitInTurn([&](const OpenRequest& request) {
    visited.push_back(request.submit.request);
    return visited.size() < 30;
  });
  while (served.size() < 30) served.push_back(TakeNext(queue, Any)->submit.request);
  EXPECT_EQ(visited, served);
}

TEST(RequestQueue, ExtractTakesOutWhatIsWantedAndNothingElse) {
  RequestQueue queue;
  for (RequestId id = 1; id <= 4; ++id) queue.Push(Request(1, id));
  queue.Push(Request(2, 1));
  const auto odd = queue.Extract([](const OpenRequest& r) { return r.submit.request % 2 == 1; });
  EXPECT_EQ(odd.size(), 3U);
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(queue.CountOf(1), 2U);
  EXPECT_EQ(queue.CountOf(2), 0U);
  EXPECT_NE(queue.Find(1, 2), nullptr);
  EXPECT_EQ(queue.Find(1, 1), nullptr);
  EXPECT_EQ(queue.Find(2, 2), nullptr);
  queue.Forget(1);
  EXPECT_EQ(queue.size(), 0U);
}

}  // namespace
}  // namespace slabstream
