#include "common/combining/schedule.h"

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/check_schedule.h"
#include "tests/support/random_combining.h"

namespace slabstream {
namespace {

constexpr PixelRange kFrame = {0, 1000};

TEST(CombiningSchemes, EveryOneEndsWithAllRanksAtTheRoot) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const CombiningEntry& entry : CombiningSchemes()) {
    for (Rank ranks = 1; ranks <= 64; ++ranks) {
      for (Rank root = 0; root < ranks; ++root) {
        const std::string combining = root == 0 ? std::string(entry.name) : RandomArguments(entry, random);
        SCOPED_TRACE(testing::Message() << combining << ", " << ranks << " ranks, root " << root);
        const Schedule schedule = MakeSchedule(combining, {ranks, root, kFrame});
        EXPECT_EQ(schedule.ranks, ranks);
        EXPECT_EQ(schedule.roots, std::vector<Rank>{root});
        ASSERT_EQ(CheckSchedule(schedule, kFrame), Status::Ok());
      }
    }
  }
}

TEST(CombiningSchemes, EveryRootEndsWithItsShare) {
  Random random(6);
  SCOPED_TRACE(random.trace());
  for (const CombiningEntry& entry : CombiningSchemes()) {
    for (Rank ranks = 1; ranks <= 40; ++ranks) {
      const std::string combining = ranks % 2 == 0 ? std::string(entry.name) : RandomArguments(entry, random);
      std::vector<Rank> roots(random.Integer<std::size_t>(1, 20));
      for (Rank& root : roots) root = random.Integer<Rank>(0, ranks - 1);
      SCOPED_TRACE(testing::Message() << combining << ", " << ranks << " ranks, " << roots.size() << " roots");
      const Schedule schedule = ParseCombining(combining)->Make(ranks, roots, kFrame);
      EXPECT_EQ(schedule.roots, roots);
      ASSERT_EQ(CheckSchedule(schedule, kFrame), Status::Ok());
    }
  }
}

// If every rank has a share, each receives as many pixels as in a swap without the collecting.
TEST(CombiningSchemes, SharesDivideTheWorkEvenly) {
  for (const char* combining : {"fan-in", "centralized", "tree:4", "radix-k:4x4", "binary-swap", "direct-send"}) {
    const Schedule schedule = ParseCombining(combining)->Make(16, AllRanks(16), {0, 16000});
    std::map<Rank, std::uint64_t> received;
    for (const Step& step : schedule.steps) received[step.to] += PixelCount(step.pixels);
    EXPECT_EQ(received.size(), 16U) << combining;
    for (const auto& [rank, pixels] : received) EXPECT_EQ(pixels, 15000U) << combining << ", rank " << rank;
  }
}

TEST(CombiningSchemes, TakeFewerPixelsThanRanks) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    for (std::uint64_t pixels = 1; pixels <= 9; ++pixels) {
      const PixelRange frame = {0, pixels};
      EXPECT_EQ(CheckSchedule(MakeSchedule(std::string(entry.name), {7, 3, frame}), frame), Status::Ok()) << entry.name;
    }
  }
}

TEST(CombiningSchemes, CarryManyRanks) {
  constexpr PixelRange kLarge = {0, 1 << 24};
  for (const CombiningEntry& entry : CombiningSchemes()) {
    for (const Rank ranks : {1024U, 4099U}) {
      const Schedule schedule = MakeSchedule(std::string(entry.name), {ranks, 345, kLarge});
      EXPECT_LE(schedule.steps.size(), kMaxSteps) << entry.name;
      EXPECT_EQ(CheckSchedule(schedule, kLarge), Status::Ok()) << entry.name << ", " << ranks << " ranks";
    }
  }
  // No arguments make more steps than a schedule may have, for as many ranks as there may be.
  for (const char* combining : {"chain:strips=256", "tree:2,strips=256", "radix-k:1024x64", "direct-send"}) {
    EXPECT_LE(MakeSchedule(combining, {kMaxRanks, 0, kLarge}).steps.size(), kMaxSteps) << combining;
  }
}

TEST(ParseCombining, TakesWhatTheSchemeTakes) {
  const auto arguments = [](std::string_view text) {
    const Result<CombiningChoice> choice = ParseCombining(text);
    EXPECT_TRUE(choice.ok()) << choice.status().message();
    return choice.ok() ? choice->arguments : CombiningArguments{};
  };
  for (const CombiningEntry& entry : CombiningSchemes()) {
    const Result<CombiningChoice> choice = ParseCombining(entry.name);
    ASSERT_TRUE(choice.ok());
    EXPECT_EQ(choice->scheme, &entry);
    EXPECT_EQ(choice->arguments, CombiningArguments{});
  }
  EXPECT_EQ(arguments("tree:4"), (CombiningArguments{{4}, 0}));
  EXPECT_EQ(arguments("tree:4,strips=8"), (CombiningArguments{{4}, 8}));
  EXPECT_EQ(arguments("tree:strips=8"), (CombiningArguments{{}, 8}));
  EXPECT_EQ(arguments("chain:strips=256"), (CombiningArguments{{}, 256}));
  EXPECT_EQ(arguments("radix-k:4x3x2"), (CombiningArguments{{4, 3, 2}, 0}));
}

TEST(ParseCombining, SaysInOneLineWhatIsWrong) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "'' is not one of fan-in, "},
      {"glue", "'glue' is not one of fan-in, "},
      {"fan-in:2", "'fan-in:2': fan-in takes nothing after its name, not '2'"},
      {"fan-in:", "fan-in takes nothing after its name, not ''"},
      {"chain:4", "chain takes strips=S after its name, not '4'"},
      {"chain:strips=0", "strips is '0', but must be a number in [1, 256]"},
      {"chain:strips=2,strips=2", "strips are given twice"},
      {"tree:1", "'tree:1': a factor is '1', but must be a number in [2, 1024]"},
      {"tree:2x2", "tree takes at most 1 factor"},
      {"tree:2,3", "tree takes at most 1 factor"},
      {"tree:", "a factor is ''"},
      {"tree:4,", "tree takes at most 1 factor"},
      {"radix-k:2x", "a factor is ''"},
      {"radix-k:2x-3", "a factor is '-3'"},
      {"radix-k:2x99999999999", "a factor is '99999999999'"},
      {"radix-k:strips=2", "a factor is 'strips=2'"},
      {"radix-k:2x2x2x2x2x2x2x2x2x2x2x2x2x2x2x2x2", "radix-k takes at most 16 factors"},
  };
  for (const auto& [text, part] : cases) {
    const Result<CombiningChoice> choice = ParseCombining(text);
    ASSERT_FALSE(choice.ok()) << text;
    EXPECT_EQ(choice.status().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(choice.status().message().find(part), std::string::npos) << choice.status().message();
    EXPECT_EQ(choice.status().message().find('\n'), std::string::npos);
  }
}

TEST(Chain, NobodyWaitsForAWholeImage) {
  // p - 1 hops of the first strip, then one strip a round: both arms together never take longer than one of all ranks.
  for (Rank ranks = 2; ranks <= 20; ++ranks) {
    for (Rank root = 0; root < ranks; ++root) {
      const Schedule schedule = MakeChain({ranks, root, kFrame}, 5);
      EXPECT_EQ(schedule.steps.size(), 5 * (ranks - 1));
      EXPECT_LE(schedule.steps.back().round + 1, ranks - 1 + 4);
    }
  }
}

TEST(Swap, DividesTheWorkEvenly) {
  // Whatever the factors, a rank receives (q - 1) / q of a picture before the root collects.
  for (const std::vector<std::uint32_t>& factors : std::vector<std::vector<std::uint32_t>>{{12}, {4, 3}, {2, 2, 3}, {3, 2, 2}}) {
    std::map<Rank, std::uint64_t> received;
    const Schedule schedule = MakeSwap({12, 0, {0, 12000}}, factors);
    std::uint64_t collected = 0;
    for (const Step& step : schedule.steps) {
      if (step.round == schedule.steps.back().round) {
        collected += step.pixels.end - step.pixels.begin;
      } else {
        received[step.to] += step.pixels.end - step.pixels.begin;
      }
    }
    EXPECT_EQ(collected, 11000U);
    std::uint64_t each = 0;
    for (std::uint64_t held = 12000; const std::uint32_t factor : factors) {
      held /= factor;
      each += held * (factor - 1);
    }
    EXPECT_EQ(received.size(), 12U);
    for (const auto& [rank, pixels] : received) EXPECT_EQ(pixels, each);
  }
}

TEST(Swap, DefaultFactorsFoldFewRanks) {
  for (Rank ranks = 1; ranks <= 2000; ++ranks) {
    std::uint64_t product = 1;
    for (const std::uint32_t factor : DefaultFactors(ranks)) {
      EXPECT_TRUE(factor >= 2 && factor <= 8);
      product *= factor;
    }
    EXPECT_LE(product, ranks);
    EXPECT_GE(10 * product, 9 * std::uint64_t{ranks});
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

// ---- a schedule made by hand

// Four ranks halve the frame twice (recursive halving), then collect at rank 1.
Schedule RecursiveHalving() {
  const PixelRange low = {0, 500}, high = {500, 1000}, q0 = {0, 250}, q1 = {250, 500}, q2 = {500, 750}, q3 = {750, 1000};
  return {4,
          {1},
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
  const Schedule strips = {3, {0}, {{0, 2, 1, {0, 300}}, {1, 1, 0, {0, 300}}, {1, 2, 1, {300, 1000}}, {2, 1, 0, {300, 1000}}}};
  EXPECT_EQ(CheckSchedule(strips, kFrame), Status::Ok());
  // Fragments of different history leave in one step.
  const Schedule pieces = {2, {0}, {{0, 0, 1, {0, 10}}, {1, 1, 0, {0, 10}}, {2, 1, 0, {10, 1000}}}};
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
  expect({kMaxRanks + 1, {0}, {}}, "schedule.ranks is 65537");
  expect({2, {2}, {{0, 1, 0, kFrame}}}, "schedule.roots has 2");
  expect({2, {0}, {{0, 2, 0, kFrame}}}, "steps[0]: goes from rank 2 to 0");
  expect({2, {0}, {{0, 0, 0, kFrame}}}, "two different ranks");
  expect({3, {0}, {{1, 2, 1, kFrame}, {0, 1, 0, kFrame}}}, "steps[1]: is of round 0, but follows round 1");
  expect({2, {0}, {{0, 1, 0, {0, 1001}}}}, "moves pixels [0, 1001)");
  expect({2, {0}, {{0, 1, 0, {5, 5}}}}, "moves pixels [5, 5)");
  expect({3, {0}, {{0, 2, 0, kFrame}}}, "not adjacent");
  expect({2, {0}, {}}, "root 0 does not end with ranks [0, 2)");
  expect({2, {0}, {{0, 1, 0, {0, 999}}}}, "does not end");
  expect({2, {1}, {{0, 1, 0, kFrame}}}, "does not end");  // at the wrong rank
  expect({3, {0}, {{0, 1, 0, kFrame}, {1, 1, 0, kFrame}}}, "steps[1]: rank 1 sends pixels that it does not hold");
  expect({3, {0}, {{0, 1, 0, {0, 10}}, {1, 1, 0, {5, 20}}}}, "does not hold");
  expect({3, {0}, {{0, 1, 0, kFrame}, {0, 2, 0, kFrame}}}, "rank 0 touches the same pixels twice in round 0");
  expect({3, {0}, {{0, 2, 1, {0, 10}}, {0, 1, 0, {9, 20}}}}, "rank 1 touches the same pixels twice in round 0");
  Schedule twice = RecursiveHalving();
  twice.steps.push_back({5, 0, 1, {0, 250}});
  expect(twice, "does not hold");
}

TEST(CheckSchedule, AGroupWithoutImagesNeedsNoSteps) {
  EXPECT_TRUE(CheckSchedule({0, {0}, {}}, kFrame).ok());
  EXPECT_FALSE(CheckSchedule({0, {0}, {{0, 0, 1, kFrame}}}, kFrame).ok());
}

// Unless the schedule is still a good one: what the root does not send away it may combine with what it collects.
TEST(CheckSchedule, NoticesALostStep) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    const Schedule good = MakeSchedule(std::string(entry.name), {13, 5, kFrame});
    for (std::size_t lost = 0; lost < good.steps.size(); ++lost) {
      Schedule bad = good;
      if (good.steps[lost].from == good.roots.front()) continue;
      bad.steps.erase(bad.steps.begin() + std::ptrdiff_t(lost));
      EXPECT_FALSE(CheckSchedule(bad, kFrame).ok()) << entry.name << " without step " << lost;
    }
  }
}

}  // namespace
}  // namespace slabstream
