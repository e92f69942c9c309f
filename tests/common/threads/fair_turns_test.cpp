// Fair turns against what they promise, for members that want time by chance.
#include "common/threads/fair_turns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::microseconds;

constexpr Duration kLongest = std::chrono::milliseconds(10);  // of a turn

// One thing that members share, in virtual time. A member has a list of demands, each with the time at which it comes up.
struct Shared {
  struct Demand {
    Time when;
    Duration left{};
  };
  FairTurns<int> turns;
  std::map<int, std::vector<Demand>> wanted;  // in order of time
  std::map<int, Duration> used;
  Time now{};

  bool Wants(int member) const { return !wanted.at(member).empty() && wanted.at(member).front().when <= now; }

  // Runs until `end`; `watch(member, length)` sees each turn.
  template <class Watch>
  void Run(Time end, Watch&& watch) {
    std::map<int, bool> joined;
    while (now < end) {
      std::optional<int> next;
      for (auto& [member, demands] : wanted) {
        if (!Wants(member)) continue;
        if (!std::exchange(joined[member], true)) turns.Join(member);
        if (!next || turns.TurnOf(member) < turns.TurnOf(*next)) next = member;
      }
      if (!next) {
        now += microseconds(100);
        turns.ForgetAll();
        continue;
      }
      Demand& demand = wanted.at(*next).front();
      const Duration length = std::min(demand.left, kLongest);
      turns.Take(*next);
      turns.Charge(*next, length);
      watch(*next, length);
      now += length;
      used[*next] += length;
      demand.left -= length;
      if (demand.left == Duration::zero()) {
        wanted.at(*next).erase(wanted.at(*next).begin());
        joined[*next] = Wants(*next);
      }
      turns.ForgetIdle([&](int member) { return Wants(member); });
    }
  }
};

// Goyal, Vin and Cheng: while two members both want more, what they get differs by a turn of each at most.
TEST(FairTurns, MembersThatAlwaysWantMoreGetTheSameWhateverOthersDo) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 200; ++round) {
    Shared shared;
    const int greedy = random.Integer(2, 4), fickle = random.Integer(0, 4);
    for (int member = 0; member < greedy; ++member) shared.wanted[member] = {{Time{}, std::chrono::hours(1)}};
    for (int member = greedy; member < greedy + fickle; ++member) {
      Time when{};
      for (int i = 0; i < 100; ++i) {
        when += microseconds(random.Integer(1, 50'000));
        shared.wanted[member].push_back({when, microseconds(random.Integer(1, 30'000))});
      }
    }
    shared.Run(Time{} + std::chrono::seconds(3), [&](int, Duration) {
      Duration least = Duration::max(), most{};
      for (int member = 0; member < greedy; ++member) {
        least = std::min(least, shared.used[member]);
        most = std::max(most, shared.used[member]);
      }
      EXPECT_LE(most - least, 2 * kLongest) << "round " << round;
    });
  }
}

// One member wants little; the others always want more. If that one takes no more than half of its share, it waits for the end of the
// present turn and for no other turn.
TEST(FairTurns, WhoWantsLittleWaitsForOneTurnOnly) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 200; ++round) {
    Shared shared;
    const int greedy = random.Integer(1, 6);
    for (int member = 1; member <= greedy; ++member) {  // no two of them ever have used the same
      shared.wanted[member] = {{Time{}, microseconds(random.Integer(1, 9999))}, {Time{}, std::chrono::hours(1)}};
    }
    Time when{};
    for (int i = 0; i < 100; ++i) {
      when += kLongest * random.Integer(2 * (greedy + 1), 20);  // half of its share: it has never used more than they
      shared.wanted[0].push_back({when, microseconds(random.Integer(1, 10'000))});
    }
    shared.Run(Time{} + std::chrono::seconds(3), [&](int member, Duration) {
      if (member != 0) return;
      EXPECT_LE(shared.now - shared.wanted.at(0).front().when, kLongest) << "round " << round;
    });
  }
}

// An endless loop of small demands takes its share and no more, and saves nothing up while it is away.
TEST(FairTurns, ALoopOfSmallDemandsTakesItsShareAtMost) {
  Shared shared;
  shared.wanted[0] = {};
  shared.wanted[1] = {{Time{}, std::chrono::hours(1)}};
  for (int i = 0; i < 3000; ++i) shared.wanted[0].push_back({Time{} + std::chrono::seconds(1), std::chrono::milliseconds(1)});
  shared.Run(Time{} + std::chrono::seconds(3), [](int, Duration) {});
  EXPECT_LE(shared.used[0], std::chrono::seconds(1) + kLongest);
  EXPECT_GE(shared.used[0], std::chrono::seconds(1) - kLongest);
}

TEST(FairTurns, ForgettingThoseWhoHaveNothingToMakeUpForChangesNoTurn) {
  FairTurns<int> turns;
  turns.Join(1);
  turns.Join(2);
  turns.Take(1);
  turns.Charge(1, kLongest);
  turns.ForgetIdle([](int) { return false; });
  EXPECT_EQ(turns.size(), 1U) << "1 has used more than the others";
  EXPECT_EQ(turns.TurnOf(2).used, Duration::zero());
  turns.Join(2);
  EXPECT_LT(turns.TurnOf(2), turns.TurnOf(1));
}

// A member that waits for something between its demands has the turns that it has missed, up to the credit. After a longer absence it is
// new.
TEST(FairTurns, WithCreditTurnsThatWereMissedComeLater) {
  constexpr Duration kTurn = std::chrono::milliseconds(10);
  FairTurns<int> turns(5 * kTurn);
  const auto take = [&](int member) {
    turns.Take(member);
    turns.Charge(member, kTurn);
    turns.ForgetIdle([](int each) { return each == 2; });
  };
  turns.Join(1);
  turns.Join(2);
  take(1);
  for (int i = 0; i < 4; ++i) take(2);
  turns.Join(1);
  int missed = 0;
  for (; turns.TurnOf(1) < turns.TurnOf(2); ++missed) take(1);
  EXPECT_EQ(missed, 3);
  for (int i = 0; i < 20; ++i) take(2);
  turns.Join(1);
  EXPECT_EQ(turns.TurnOf(2).used - turns.TurnOf(1).used, kTurn) << "as if it had not been there before";
}

}  // namespace
}  // namespace slabstream
