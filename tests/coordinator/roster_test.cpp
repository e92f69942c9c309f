#include "coordinator/frames/roster.h"

#include <gtest/gtest.h>

#include <chrono>
#include <set>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
constexpr Time kStart{seconds(100)};

Register Incarnated(Incarnation incarnation) {
  return {.incarnation = incarnation, .images_endpoint = "inproc://" + std::to_string(incarnation)};
}

LiveRoster ThreeWorkers() {
  LiveRoster roster(seconds(6), seconds(30), seconds(2));
  for (Incarnation i = 1; i <= 3; ++i) EXPECT_EQ(roster.Admit(Incarnated(i), 10 + i, kStart), WorkerId(i));
  return roster;
}

TEST(LiveRoster, ReplacementTakesTheVacantSlotAndNobodyElseMoves) {
  LiveRoster roster = ThreeWorkers();
  roster.Remove(2, kStart);
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{1, 0, 3}));
  EXPECT_EQ(roster.Admit(Incarnated(9), 19, kStart), WorkerId{4}) << "ids are never given twice";
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{1, 4, 3}));
}

Register Returning(Incarnation incarnation, SlotPlace place) {
  Register message = Incarnated(incarnation);
  message.place = place;
  return message;
}

TEST(LiveRoster, WorkersOfAnEarlierCoordinatorGetTheirSlotsAgain) {
  LiveRoster roster(seconds(6), seconds(30), seconds(2));
  roster.Admit(Returning(9, {.slot = 2, .slots = 3}), 19, kStart);
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{0, 0, 1}));
  EXPECT_TRUE(roster.AwaitsReturn());
  roster.Admit(Returning(8, {.slot = 1, .slots = 3}), 18, kStart);
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{0, 2, 1}));
  EXPECT_TRUE(roster.AwaitsReturn());
  roster.Admit(Returning(7, {.slot = 1, .slots = 2}), 17, kStart);
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{3, 2, 1})) << "its slot is taken";
  EXPECT_FALSE(roster.AwaitsReturn()) << "nobody is missing";
  EXPECT_EQ(roster.PlaceOf(2), (SlotPlace{.slot = 1, .slots = 3}));
  EXPECT_EQ(roster.Admit(Incarnated(6), 16, kStart), WorkerId{4});
  EXPECT_EQ(roster.slots().slots.size(), 4U);
}

TEST(LiveRoster, WorkersThatDoNotReturnAreAwaitedForAWhile) {
  LiveRoster roster(seconds(6), seconds(30), seconds(2));
  roster.Admit(Returning(9, {.slot = 1, .slots = 2}), 19, kStart);
  EXPECT_EQ(roster.NextWake(), kStart + seconds(2));
  roster.GiveUpVacancies(kStart + seconds(2) - Duration(1));
  EXPECT_TRUE(roster.AwaitsReturn());
  roster.GiveUpVacancies(kStart + seconds(2));
  EXPECT_FALSE(roster.AwaitsReturn());
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{0, 1})) << "its boxes are lent";
  EXPECT_EQ(roster.NextWake(), kStart + seconds(6));
}

TEST(LiveRoster, ARunningServiceMakesNoSlotsForWhoComesBackLate) {
  LiveRoster roster = ThreeWorkers();
  EXPECT_FALSE(roster.AwaitsReturn()) << "nobody had a slot before";
  roster.Admit(Returning(9, {.slot = 7, .slots = 9}), 19, kStart + seconds(30));
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{1, 2, 3, 4}));
  LiveRoster hostile(seconds(6), seconds(30), seconds(2));
  hostile.Admit(Returning(9, {.slot = 4000000000, .slots = 4294967295}), 19, kStart);
  EXPECT_LE(hostile.slots().slots.size(), 4096U);
}

TEST(LiveRoster, VacantSlotsAreGivenUpAfterTheGracePeriod) {
  LiveRoster roster = ThreeWorkers();
  roster.Remove(2, kStart);
  for (const WorkerId worker : {1, 3}) roster.Touch(worker, kStart + seconds(29));
  EXPECT_EQ(roster.NextWake(), kStart + seconds(30));
  roster.GiveUpVacancies(kStart + seconds(30) - Duration(1));
  EXPECT_EQ(roster.slots().slots.size(), 3U);
  roster.GiveUpVacancies(kStart + seconds(30));
  EXPECT_EQ(roster.slots().slots, (std::vector<WorkerId>{1, 3}));
}

TEST(LiveRoster, RegisterProvesOtherLivesOfTheSamePlaceDead) {
  LiveRoster roster = ThreeWorkers();
  EXPECT_TRUE(roster.ReplacedBy(Incarnated(2), 12).empty()) << "repeated";
  EXPECT_TRUE(roster.ReplacedBy(Incarnated(9), 19).empty()) << "somebody new";
  EXPECT_EQ(roster.ReplacedBy(Incarnated(9), 12), (std::vector<WorkerId>{2})) << "same connection";
  Register same_endpoint = Incarnated(9);
  same_endpoint.images_endpoint = "inproc://3";
  EXPECT_EQ(roster.ReplacedBy(same_endpoint, 19), (std::vector<WorkerId>{3}));
}

TEST(LiveRoster, HeartbeatsTellLifeProgressAndConnection) {
  LiveRoster roster = ThreeWorkers();
  Heartbeat beat{.incarnation = 2, .worker = 2, .fetched_bytes = 5};
  EXPECT_TRUE(roster.Hear(beat, 12, kStart).progressed);
  EXPECT_FALSE(roster.Hear(beat, 12, kStart).progressed) << "nothing new";
  beat.fetched_bytes = 4;
  EXPECT_FALSE(roster.Hear(beat, 12, kStart).progressed) << "an old heartbeat that arrives late";
  EXPECT_TRUE(roster.Hear(beat, 50, kStart + seconds(6)).known);
  EXPECT_EQ(roster.Find(2)->peer, 50U) << "it speaks on another connection now";
  EXPECT_EQ(roster.Silent(kStart + seconds(6)), (std::vector<WorkerId>{1, 3}));

  EXPECT_FALSE(roster.Hear({.incarnation = 8, .worker = 2}, 12, kStart).known);
  EXPECT_FALSE(roster.Hear({.incarnation = 8, .worker = 2}, 12, kStart).stale);
  EXPECT_TRUE(roster.Hear({.incarnation = 2, .worker = 1}, 12, kStart).stale) << "of an id that this incarnation had before";
}

// For a plan of any age: survivors stay where they are, nobody gets two slots, and no slot is vacant while a worker has none.
TEST(LiveRoster, RefillMovesNobodyAndLeavesNobodyOut) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 300; ++round) {
    LiveRoster roster(seconds(6), seconds(30), seconds(2));
    Incarnation incarnation = 0;
    const auto churn = [&](int events) {
      for (int i = 0; i < events; ++i) {
        if (roster.empty() || random.Chance(0.6)) {
          ++incarnation;
          roster.Admit(Incarnated(incarnation), incarnation, kStart);
        } else {
          const auto& members = roster.members();
          roster.Remove(members[random.Integer<std::size_t>(0, members.size() - 1)].id, kStart);
        }
        if (random.Chance(0.1)) roster.GiveUpVacancies(kStart + seconds(60));
      }
    };
    churn(random.Integer(1, 10));
    const Roster planned = roster.slots();
    churn(random.Integer(0, 10));
    const Roster refilled = roster.Refill(planned);

    ASSERT_EQ(refilled.slots.size(), planned.slots.size());
    std::multiset<WorkerId> used;
    int vacant = 0;
    for (std::size_t slot = 0; slot < planned.slots.size(); ++slot) {
      const WorkerId worker = refilled.slots[slot];
      EXPECT_TRUE(roster.Find(planned.slots[slot]) == nullptr || worker == planned.slots[slot]);
      if (worker == 0) {
        ++vacant;
        continue;
      }
      EXPECT_NE(roster.Find(worker), nullptr);
      used.insert(worker);
    }
    for (const WorkerId worker : used) EXPECT_EQ(used.count(worker), 1U);
    EXPECT_TRUE(vacant == 0 || used.size() == roster.members().size());
  }
}

}  // namespace
}  // namespace slabstream
