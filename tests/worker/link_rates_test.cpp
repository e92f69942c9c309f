// Rates of links, from sent bytes and answers alone.
#include "worker/machine/link_rates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/wire/image_messages.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr WorkerId kPeer = 7;

// A link that moves one byte after the other, and then takes its latency.
struct ModelLink {
  double bytes_per_second;
  Duration latency{};
  Time free{};

  Time Arrival(Time sent, std::size_t bytes) {
    free = std::max(free, sent) + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(double(bytes) / bytes_per_second));
    return free + latency;
  }
};

TEST(LinkRates, FindsTheRateOfALinkWhateverIsQueued) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (int trial = 0; trial < 200; ++trial) {
    LinkRates rates;
    ModelLink link{std::pow(10.0, random.Real(6.5, 9.5)), std::chrono::microseconds(random.Integer(0, 200))};
    Time now{};
    struct Answer {
      Time at;
      std::uint64_t number;
    };
    std::vector<Answer> answers;
    for (int frame = 0; frame < 40; ++frame) {  // bursts of images, as strips of a frame are sent
      const int burst = random.Integer(1, 8);
      for (int i = 0; i < burst; ++i) {
        const auto bytes = std::size_t(random.Integer(4 << 20, 16 << 20));
        const std::uint64_t number = rates.Ask(kPeer, now);
        rates.Sent(kPeer, number, bytes, now);
        const Time at = link.Arrival(now, bytes);
        if (number != 0) answers.push_back({at, number});
        now += std::chrono::microseconds(random.Integer(0, 500));
        std::erase_if(answers, [&](const Answer& answer) {
          if (answer.at > now) return false;
          rates.Received(kPeer, answer.number, now);
          return true;
        });
      }
      now = std::max(now, link.free) + std::chrono::milliseconds(random.Integer(0, 300));
      for (const Answer& answer : answers) rates.Received(kPeer, answer.number, answer.at);
      answers.clear();
    }
    // Latency and late looks make it slower than it is; nothing makes it faster.
    EXPECT_LE(rates.Of(kPeer), 1.0001 * link.bytes_per_second);
    EXPECT_GE(rates.Of(kPeer), 0.5 * link.bytes_per_second) << "of " << link.bytes_per_second;
  }
}

TEST(LinkRates, IsUnknownUntilThereAreAnswers) {
  LinkRates rates;
  const Time now{};
  EXPECT_EQ(rates.Of(kPeer), LinkRates::kUnknown);
  for (std::size_t i = 0; i < LinkRates::kLeastAnswers; ++i) {
    EXPECT_EQ(rates.Of(kPeer), LinkRates::kUnknown);
    const Time sent = now + i * std::chrono::seconds(1);
    const std::uint64_t number = rates.Ask(kPeer, sent);
    ASSERT_NE(number, 0U);
    EXPECT_EQ(rates.Ask(kPeer, sent), 0U) << "one at a time";
    rates.Sent(kPeer, number, 1'000'000, sent);
    rates.Received(kPeer + 1, number, sent);                               // somebody else
    rates.Received(kPeer, number + 1, sent);                               // another number
    rates.Received(kPeer, number, sent + std::chrono::milliseconds(100));  // 10 MB/s
    rates.Received(kPeer, number, sent + std::chrono::milliseconds(1));    // again
  }
  EXPECT_NEAR(rates.Of(kPeer), 1e7, 1);
  rates.ForgetAll();
  EXPECT_EQ(rates.Of(kPeer), LinkRates::kUnknown);
}

TEST(LinkRates, AsksOftenAtFirstAndThenOnceASecond) {
  LinkRates rates;
  Time now{};
  int asked = 0;
  for (int i = 0; i < 1000; ++i) {  // ten seconds
    const std::uint64_t number = rates.Ask(kPeer, now);
    rates.Sent(kPeer, number, kLeastAcknowledgedBytes, now);
    now += std::chrono::milliseconds(10);
    if (number == 0) continue;
    ++asked;
    rates.Received(kPeer, number, now);
  }
  EXPECT_GE(asked, int(LinkRates::kAnswers) + 9);
  EXPECT_LE(asked, int(LinkRates::kAnswers) + 11);
}

TEST(LinkRates, LostAnswersAreAskedForAgain) {
  LinkRates rates;
  const Time now{};
  const std::uint64_t lost = rates.Ask(kPeer, now);
  rates.Sent(kPeer, lost, 1'000'000, now);
  EXPECT_EQ(rates.Ask(kPeer, now + LinkRates::kPatience / 2), 0U);
  const std::uint64_t second = rates.Ask(kPeer, now + LinkRates::kPatience);
  EXPECT_NE(second, 0U);
  rates.Sent(kPeer, second, kLeastAcknowledgedBytes - 1, now + LinkRates::kPatience);  // too small to be answered
  EXPECT_NE(rates.Ask(kPeer, now + LinkRates::kPatience), 0U);
}

TEST(LinkRates, AReceiverThatSleptIsNoSlowLink) {
  LinkRates rates;
  Time now{};
  for (const int took : {1, 300, 250, 400}) {
    const std::uint64_t number = rates.Ask(kPeer, now);
    rates.Sent(kPeer, number, 1'000'000, now);
    rates.Received(kPeer, number, now + std::chrono::milliseconds(took));
    now += std::chrono::seconds(2);
  }
  EXPECT_NEAR(rates.Of(kPeer), 1e9, 1);
}

}  // namespace
}  // namespace slabstream
