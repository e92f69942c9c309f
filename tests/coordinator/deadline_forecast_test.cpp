// Frames that begin when the forecast says so, on a service that shares its time equally among clients.
#include "coordinator/frames/deadline_forecast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Forecast = DeadlineForecast::Frame;
using Ended = DeadlineForecast::Ended;

constexpr FrameKind kKind = 7;
Time At(double time) { return Time(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(time))); }

// Clients that ask again at once, each for a frame of this cost within this time, for `length`.
struct Load {
  int clients = 0;
  double cost = 0, within = 0, length = 0;
};
struct Served {
  int in_time = 0, late = 0, refused = 0;
};

// `asks`: whether frames begin only if the forecast says so. Time passes in steps.
Served Serve(const Load& load, bool asks, DeadlineForecast& forecast, Random& random) {
  constexpr double kStep = 0.01;
  struct Client {
    double left = 0, deadline = 0;
    Duration used{};
    FrameId frame = 0;  // that runs
  };
  std::vector<Client> clients(std::size_t(load.clients));
  for (Client& client : clients) client.deadline = load.within;
  Served served;
  FrameId last = 0;
  for (double now = 0; now < load.length; now += kStep) {
    std::vector<std::size_t> waiting;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (clients[i].frame == 0) waiting.push_back(i);
    }
    for (std::size_t i = waiting.size(); i > 1; --i) std::swap(waiting[i - 1], waiting[random.Integer<std::size_t>(0, i - 1)]);
    std::ranges::stable_sort(waiting, {}, [&](std::size_t i) { return clients[i].used; });  // as FairTurns does
    for (const std::size_t i : waiting) {
      Client& client = clients[i];
      const Forecast frame{PeerToken(i + 1), kKind, At(client.deadline), client.used};
      if (asks && !forecast.MayBegin(frame, At(now))) continue;
      client.frame = ++last;
      client.left = load.cost;
      forecast.Begin(client.frame, frame, At(now));
    }
    const auto running = std::ranges::count_if(clients, [](const Client& client) { return client.frame != 0; });
    for (Client& client : clients) {
      if (client.frame != 0) {
        client.left -= kStep / double(running);
        const bool done = client.left <= 0, late = !done && now + kStep >= client.deadline;
        if (!done && !late) continue;
        forecast.End(client.frame, done ? Ended::kDone : Ended::kLate, At(now + kStep));
        client.used += std::chrono::duration_cast<Duration>(std::chrono::duration<double>(load.cost - std::max(client.left, 0.0)));
        ++(done ? served.in_time : served.late);
        client.frame = 0;
      } else if (now + kStep >= client.deadline) {
        ++served.refused;
      } else {
        continue;
      }
      client.deadline = now + kStep + load.within;
    }
  }
  return served;
}

TEST(DeadlineForecast, AnOverloadedServiceDoesMostOfWhatItCan) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (const int clients : {1, 2, 4, 6, 12, 24, 64}) {
    for (const double cost : {0.2, 0.8, 1.4}) {
      const Load load{.clients = clients, .cost = cost, .within = 3, .length = 60};
      DeadlineForecast forecast;
      const Served served = Serve(load, true, forecast, random);
      const double possible = load.length / cost;
      EXPECT_GT(served.in_time, 0.5 * possible)
          << clients << " clients, " << cost << " s: " << served.late << " late, " << served.refused << " not begun";
      if (double(clients) * cost <= 1.4 * load.within) continue;
      DeadlineForecast unasked;
      EXPECT_LT(Serve(load, false, unasked, random).in_time, served.in_time / 4) << "without it, as many are in time";
    }
  }
}

TEST(DeadlineForecast, CostsAreWhatAFrameTakesAlone) {
  DeadlineForecast forecast;
  for (int round = 0; round < 2; ++round) {
    const double begin = 100 * round;
    for (PeerToken client = 1; client <= 4; ++client) forecast.Begin(10 * round + client, {client, kKind, At(1000), {}}, At(begin));
    for (PeerToken client = 1; client <= 4; ++client) forecast.End(10 * round + client, Ended::kDone, At(begin + 8));
    EXPECT_EQ(forecast.Expected(kKind), seconds(2)) << "4 frames shared 8 s";
  }
}

// The first of them waited for its voxels.
TEST(DeadlineForecast, OneFrameThatTookLongMeansNothing) {
  DeadlineForecast forecast;
  Time now = At(0);
  for (const Duration cost : {Duration(seconds(30)), Duration(milliseconds(100))}) {
    forecast.Begin(1, {1, kKind, now + seconds(60), {}}, now);
    forecast.End(1, Ended::kDone, now += cost);
  }
  EXPECT_EQ(forecast.Expected(kKind), milliseconds(100));
}

// Four times what was measured is a guess: frames wait by it, but nobody is refused by it.
TEST(DeadlineForecast, OfALateFrameItIsKnownWhatWasMeasured) {
  DeadlineForecast forecast;
  for (PeerToken client = 1; client <= 4; ++client) forecast.Begin(client, {client, kKind, At(120), {}}, At(0));
  for (PeerToken client = 1; client <= 4; ++client) forecast.End(client, Ended::kLate, At(120));
  EXPECT_EQ(forecast.Expected(kKind), seconds(120));
  EXPECT_EQ(forecast.Least(kKind), seconds(30));
  forecast.Begin(5, {1, kKind, At(320), {}}, At(200));
  EXPECT_EQ(forecast.Left(At(200)), seconds(30));
  EXPECT_FALSE(forecast.MayBegin({2, kKind, At(320), {}}, At(200)));
  forecast.End(5, Ended::kDone, At(201));
  EXPECT_EQ(forecast.Expected(kKind), seconds(1));
  EXPECT_EQ(forecast.Least(kKind), seconds(1));
}

class TwoClients : public testing::Test {
 protected:
  // Frames cost 1 s.
  void SetUp() override {
    for (int i = 0; i < 2; ++i) {
      forecast_.Begin(1, {1, kKind, At(1000), {}}, At(10 * i));
      forecast_.End(1, Ended::kDone, At(10 * i + 1));
    }
  }
  DeadlineForecast forecast_;
};

TEST_F(TwoClients, AFrameThatMakesAnotherOneLateWaits) {
  forecast_.Begin(1, {1, kKind, At(101.5), {}}, At(100));
  EXPECT_FALSE(forecast_.MayBegin({2, kKind, At(1000), {}}, At(100)));
  EXPECT_TRUE(forecast_.MayBegin({2, kKind, At(1000), {}}, At(100.8))) << "0.2 s are left of it, and 0.7 s to its deadline";
}

TEST_F(TwoClients, WhoeverHasUsedLessWaitsForNobody) {
  forecast_.Begin(1, {1, kKind, At(101.5), seconds(50)}, At(100));
  EXPECT_TRUE(forecast_.MayBegin({2, kKind, At(1000), seconds(3)}, At(100)));
}

TEST_F(TwoClients, AClientWaitsNotForItself) {
  forecast_.Begin(1, {1, kKind, At(101.5), {}}, At(100));
  EXPECT_TRUE(forecast_.MayBegin({1, kKind, At(101.6), {}}, At(100)));
}

TEST_F(TwoClients, AFrameThatCannotBeInTimeDoesNotBegin) {
  forecast_.Begin(1, {1, kKind, At(1000), {}}, At(100));
  EXPECT_FALSE(forecast_.MayBegin({2, kKind, At(101.9), {}}, At(100)));
  EXPECT_TRUE(forecast_.MayBegin({2, kKind, At(102.1), {}}, At(100)));
  EXPECT_TRUE(forecast_.MayBegin({2, kKind + 1, At(100.1), {}}, At(100))) << "what it costs is not known";
  EXPECT_EQ(forecast_.Left(At(100.25)), milliseconds(750));
}

}  // namespace
}  // namespace slabstream
