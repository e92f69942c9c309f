#include "common/planning/team.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/random.h"

namespace slabstream {
namespace {

TEST(Teams, DivideTheSlotsEvenlyAndTakeTurns) {
  for (std::uint32_t slots = 1; slots <= 13; ++slots) {
    Roster roster;
    for (WorkerId worker = 1; worker <= slots; ++worker) roster.slots.push_back(worker);
    for (std::uint32_t teams = 1; teams <= slots + 2; ++teams) {
      const std::uint32_t count = std::min(teams, slots);
      std::multiset<WorkerId> seen;
      for (std::uint64_t frame = 0; frame < count; ++frame) {
        const Team team = TeamOf(roster, teams, frame);
        EXPECT_EQ(team.turn, (Turn{0, count}));
        EXPECT_GE(team.roster.slots.size(), slots / count);
        EXPECT_LE(team.roster.slots.size(), (slots + count - 1) / count);
        seen.insert(team.roster.slots.begin(), team.roster.slots.end());
        const Team next = TeamOf(roster, teams, frame + 5 * count);
        EXPECT_EQ(next.roster, team.roster);
        EXPECT_EQ(next.turn, (Turn{5, count}));
      }
      EXPECT_EQ(seen, std::multiset<WorkerId>(roster.slots.begin(), roster.slots.end())) << teams << " teams";
    }
  }
}

TEST(Teams, AreNeverWithoutAWorkerWhileThereIsOne) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 500; ++i) {
    Roster roster;
    const auto slots = random.Integer<std::uint32_t>(1, 9);
    for (WorkerId worker = 1; worker <= slots; ++worker) roster.slots.push_back(random.Chance(0.4) ? worker : 0);
    std::set<WorkerId> present(roster.slots.begin(), roster.slots.end()), seen;
    present.erase(0);
    const auto teams = random.Integer<std::uint32_t>(1, 9);
    for (std::uint64_t frame = 0; frame < 20; ++frame) {
      const Team team = TeamOf(roster, teams, frame);
      std::set<WorkerId> workers(team.roster.slots.begin(), team.roster.slots.end());
      workers.erase(0);
      EXPECT_EQ(workers.empty(), present.empty());
      seen.insert(workers.begin(), workers.end());
    }
    EXPECT_EQ(seen, present);
  }
}

}  // namespace
}  // namespace slabstream
