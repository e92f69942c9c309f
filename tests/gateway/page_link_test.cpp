// What is known of the way to a page: its delay, what pictures take, and how many may be under way.
#include "gateway/page_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

Time Clock(int ms) { return Time{} + milliseconds(100000 + ms); }

// A way with a delay, on which a picture takes a time of its own once those before it are over; the sender has a picture every `pace` ms.
struct Way {
  int delay = 0, time = 0, pace = 1;
  PageLink link;
  std::size_t most = 0;  // pictures under way
  int longest = 0;       // round trip, ms
  int sent = 0;

  void Run(int from, int until) {
    std::deque<std::pair<int, int>> acks;  // when, and sent when
    int free = from, next = from;
    for (int now = from; now < until; ++now) {
      if (now % 1000 == 0) link.OnEcho(std::max<Duration>(milliseconds(delay), Duration(1)), Clock(now));
      while (!acks.empty() && acks.front().first <= now) {
        longest = std::max(longest, now - acks.front().second);
        EXPECT_TRUE(link.OnAck(std::uint64_t(sent) - acks.size() + 1, {}, Clock(now)));
        acks.pop_front();
      }
      if (now < next || link.is_full() || link.ready() > Clock(now)) continue;
      link.OnSent(std::uint64_t(++sent), true, Clock(now));
      free = std::max(free, now) + time;
      acks.emplace_back(free + delay, now);
      most = std::max(most, acks.size());
      next = now + pace;
    }
    while (!acks.empty()) {
      link.OnAck(std::uint64_t(sent) - acks.size() + 1, {}, Clock(std::max(until, acks.front().first)));
      acks.pop_front();
    }
  }
};

TEST(PageLink, NearByOnePictureIsUnderWay) {
  Way way{.delay = 2, .time = 8};
  way.Run(0, 5000);
  EXPECT_EQ(way.most, 1);
  EXPECT_EQ(way.link.picture_time(), milliseconds(8));
  EXPECT_EQ(way.link.round_trip(), milliseconds(10));
}

TEST(PageLink, WithoutEchoesItIsAllThePicturesTime) {
  PageLink link;
  link.OnSent(1, true, Clock(0));
  EXPECT_TRUE(link.is_full());
  EXPECT_TRUE(link.OnAck(1, {}, Clock(120)));
  EXPECT_EQ(link.picture_time(), milliseconds(120));
}

TEST(PageLink, ThePagesOwnTimeIsNotTheConnections) {
  PageLink link;
  link.OnEcho(milliseconds(50), Clock(0));
  link.OnSent(1, true, Clock(0));
  link.OnAck(1, milliseconds(70), Clock(130));
  EXPECT_EQ(link.picture_time(), milliseconds(80));
  EXPECT_EQ(link.connection_time(), milliseconds(10));
  link.OnSent(2, true, Clock(200));
  link.OnAck(2, std::chrono::hours(1), Clock(210));  // whatever the page says
  EXPECT_GT(link.connection_time(), Duration::zero());
}

TEST(PageLink, FarAwayPicturesFollowOneAnother) {
  Way way{.delay = 150, .time = 10, .pace = 25};
  way.Run(0, 10000);
  EXPECT_GT(way.sent, 380) << "of 400; one at a time would be 62";
  EXPECT_LE(way.most, 7);
  EXPECT_LE(way.longest, 161) << "none waits for another";
  EXPECT_NEAR(double(way.link.picture_time().count()), 10e6, 1e6);
}

TEST(PageLink, OnASlowWayPicturesDoNotQueue) {
  Way way{.delay = 100, .time = 80};
  way.Run(0, 10000);
  EXPECT_GT(way.sent, 118) << "of 125: the way is never idle";
  EXPECT_LE(way.most, 3);
  EXPECT_LE(way.longest, 190);
}

TEST(PageLink, AtMost16AreUnderWay) {
  Way way{.delay = 900, .time = 1, .pace = 5};  // a page may hold its answers back
  way.Run(0, 10000);
  EXPECT_EQ(way.most, 16);
}

TEST(PageLink, LosslessPicturesDoNotCount) {
  PageLink link;
  link.OnSent(1, true, Clock(0));
  link.OnAck(1, {}, Clock(10));
  link.OnSent(2, false, Clock(20));
  link.OnAck(2, {}, Clock(900));
  EXPECT_EQ(link.picture_time(), milliseconds(10));
  EXPECT_EQ(link.last_round_trip(), milliseconds(880));
}

TEST(PageLink, AnAcknowledgementHoldsForAllBefore) {
  PageLink link;
  for (std::uint64_t frame : {1, 2, 3}) link.OnSent(frame, true, Clock(int(frame)));
  EXPECT_TRUE(link.OnAck(2, {}, Clock(120)));
  EXPECT_FALSE(link.OnAck(1, {}, Clock(121)));
  EXPECT_FALSE(link.OnAck(4, {}, Clock(121)));
  EXPECT_TRUE(link.OnAck(3, {}, Clock(122)));
}

TEST(PageLink, ADelayThatIsOverIsForgotten) {
  PageLink link;
  link.OnSent(1, true, Clock(-10));
  link.OnAck(1, {}, Clock(0));
  link.OnEcho(milliseconds(5), Clock(0));
  for (int second = 1; second <= 25; ++second) link.OnEcho(milliseconds(200), Clock(1000 * second));
  for (std::uint64_t frame = 2; frame <= 4; ++frame) link.OnSent(frame, true, Clock(26000));
  EXPECT_FALSE(link.is_full()) << "the way has become long";
  link.OnEcho(milliseconds(5), Clock(26001));
  EXPECT_TRUE(link.is_full()) << "it has become short: that holds at once";
}

TEST(PageLink, WaysThatChangeAreFollowed) {
  Random random(29);
  SCOPED_TRACE(random.trace());
  for (int run = 0; run < 50; ++run) {
    Way way;
    int now = 0;
    for (int change = 0; change < 5; ++change) {
      way.delay = random.Integer(0, 300);
      way.time = random.Integer(1, 200);
      way.Run(now, now + 22000);
      now += 22000;
    }
    way.most = 0;
    const int before = way.sent;
    way.longest = 0;
    way.Run(now, now + 10000);
    const int most_a_run = 10000 / std::max(way.time, 1);
    const int expected = std::min(most_a_run, way.delay < 25 ? 10000 / (way.delay + way.time) : 400);
    EXPECT_GE(way.sent - before, 9 * expected / 10 - 2) << way.delay << " + " << way.time;
    EXPECT_LE(way.longest, way.delay + 2 * way.time + 2) << way.delay << " + " << way.time;
  }
}

}  // namespace
}  // namespace slabstream
