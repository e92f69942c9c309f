#include "common/combining/schedule.h"

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <set>
#include <vector>

namespace slabstream {
namespace {

constexpr PixelRange kFrame = {0, 1000};

TEST(CombiningSchemes, EveryOneEndsWithAllRanksAtTheRoot) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    EXPECT_EQ(FindCombiningScheme(entry.name), &entry);
    for (Rank ranks = 1; ranks <= 64; ++ranks) {
      for (Rank root = 0; root < ranks; ++root) {
        SCOPED_TRACE(testing::Message() << entry.name << ", " << ranks << " ranks, root " << root);
        const Schedule schedule = entry.make({ranks, root, kFrame});
        EXPECT_EQ(schedule.ranks, ranks);
        EXPECT_EQ(schedule.root, root);
        ASSERT_EQ(CheckSchedule(schedule, kFrame), Status::Ok());
      }
    }
  }
  EXPECT_EQ(FindCombiningScheme("nonsense"), nullptr);
}

TEST(CombiningSchemes, CarryManyRanks) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    EXPECT_EQ(CheckSchedule(entry.make({4099, 1234, kFrame}), kFrame), Status::Ok()) << entry.name;
  }
}

TEST(FanIn, TakesLogarithmicallyManyRoundsWithOneSendARank) {
  for (Rank ranks = 1; ranks <= 64; ++ranks) {
    const Schedule schedule = MakeFanIn({ranks, ranks / 2, kFrame});
    EXPECT_EQ(schedule.steps.size(), ranks - 1);
    const unsigned rounds = std::bit_width(ranks - 1);  // log2, rounded up
    std::set<Rank> sent;
    for (const Step& step : schedule.steps) {
      EXPECT_LT(step.round, rounds);
      EXPECT_TRUE(sent.insert(step.from).second);
    }
    if (ranks > 1) {
      EXPECT_EQ(schedule.steps.back().round, rounds - 1);
    }
  }
}

TEST(Centralized, EverybodySendsToTheRootOnce) {
  const Schedule schedule = MakeCentralized({7, 2, kFrame});
  EXPECT_EQ(schedule.steps.size(), 6U);
  for (const Step& step : schedule.steps) EXPECT_EQ(step.to, 2U);
}

// ---- schedules of families to come, made by hand

// Four ranks halve the frame twice (recursive halving), then collect at rank 1.
Schedule RecursiveHalving() {
  const PixelRange low = {0, 500}, high = {500, 1000}, q0 = {0, 250}, q1 = {250, 500}, q2 = {500, 750}, q3 = {750, 1000};
  return {4,
          1,
          {{0, 0, 1, high},
           {0, 1, 0, low},
           {0, 2, 3, high},
           {0, 3, 2, low},  // pairs swap halves
           {1, 0, 2, q1},
           {1, 2, 0, q0},
           {1, 1, 3, q3},
           {1, 3, 1, q2},  // then quarters
           {2, 0, 1, q0},
           {3, 2, 1, q1},
           {4, 3, 1, q3}}};  // rank 1 keeps q2
}

TEST(CheckSchedule, UnderstandsSwapsOfPixelRanges) {
  ASSERT_EQ(CheckSchedule(RecursiveHalving(), kFrame), Status::Ok());
  // A chain in image strips: the strips need not be sent in one piece.
  const Schedule strips = {3, 0, {{0, 2, 1, {0, 300}}, {1, 1, 0, {0, 300}}, {1, 2, 1, {300, 1000}}, {2, 1, 0, {300, 1000}}}};
  EXPECT_EQ(CheckSchedule(strips, kFrame), Status::Ok());
  // Fragments of different history leave in one step.
  const Schedule pieces = {2, 0, {{0, 0, 1, {0, 10}}, {1, 1, 0, {0, 10}}, {2, 1, 0, {10, 1000}}}};
  EXPECT_EQ(CheckSchedule(pieces, kFrame), Status::Ok());
}

TEST(CheckSchedule, SaysWhatIsWrong) {
  const auto message = [](const Schedule& schedule) {
    const Status status = CheckSchedule(schedule, kFrame);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.message();
  };
  const auto expect = [&](const Schedule& schedule, const char* part) {
    const std::string text = message(schedule);
    EXPECT_NE(text.find(part), std::string::npos) << text << "\nhas no: " << part;
  };
  expect({kMaxRanks + 1, 0, {}}, "schedule.ranks is 65537");
  expect({2, 2, {{0, 1, 0, kFrame}}}, "schedule.root is 2");
  expect({2, 0, {{0, 2, 0, kFrame}}}, "steps[0]: goes from rank 2 to 0");
  expect({2, 0, {{0, 0, 0, kFrame}}}, "two different ranks");
  expect({3, 0, {{1, 2, 1, kFrame}, {0, 1, 0, kFrame}}}, "steps[1]: is of round 0, but follows round 1");
  expect({2, 0, {{0, 1, 0, {0, 1001}}}}, "moves pixels [0, 1001)");
  expect({2, 0, {{0, 1, 0, {5, 5}}}}, "moves pixels [5, 5)");
  expect({3, 0, {{0, 2, 0, kFrame}}}, "not adjacent");
  expect({2, 0, {}}, "root 0 does not end with ranks [0, 2)");
  expect({2, 0, {{0, 1, 0, {0, 999}}}}, "does not end");
  expect({2, 1, {{0, 1, 0, kFrame}}}, "does not end");  // at the wrong rank
  expect({3, 0, {{0, 1, 0, kFrame}, {1, 1, 0, kFrame}}}, "steps[1]: rank 1 sends pixels that it does not hold");
  expect({3, 0, {{0, 1, 0, {0, 10}}, {1, 1, 0, {5, 20}}}}, "does not hold");
  expect({3, 0, {{0, 1, 0, kFrame}, {0, 2, 0, kFrame}}}, "rank 0 touches the same pixels twice in round 0");
  expect({3, 0, {{0, 2, 1, {0, 10}}, {0, 1, 0, {9, 20}}}}, "rank 1 touches the same pixels twice in round 0");
  Schedule twice = RecursiveHalving();
  twice.steps.push_back({5, 0, 1, {0, 250}});
  expect(twice, "does not hold");
}

TEST(CheckSchedule, AGroupWithoutImagesNeedsNoSteps) {
  EXPECT_TRUE(CheckSchedule({0, 0, {}}, kFrame).ok());
  EXPECT_FALSE(CheckSchedule({0, 0, {{0, 0, 1, kFrame}}}, kFrame).ok());
}

// Any single change to a good schedule is noticed, unless it is another good one.
TEST(CheckSchedule, NoticesALostStep) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    const Schedule good = entry.make({13, 5, kFrame});
    for (std::size_t lost = 0; lost < good.steps.size(); ++lost) {
      Schedule bad = good;
      bad.steps.erase(bad.steps.begin() + std::ptrdiff_t(lost));
      EXPECT_FALSE(CheckSchedule(bad, kFrame).ok()) << entry.name << " without step " << lost;
    }
  }
}

}  // namespace
}  // namespace slabstream
