#include "common/combining/schedule_runner.h"

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/random_combining.h"

namespace slabstream {
namespace {

constexpr PixelRange kFrame = {0, 240};

SharedSchedule Derive(const ScheduleName& name) { return DeriveSchedule(name, kFrame).value(); }

// Runs a schedule on several workers with messages in any order, whole or in pieces, while combining takes its time.
class World {
 public:
  World(Random& random, const SharedSchedule& schedule, int workers) : random_(random), schedule_(schedule) {
    std::vector<std::vector<Rank>> ranks(static_cast<std::size_t>(workers));
    for (Rank rank = 0; rank < schedule->schedule().ranks; ++rank) {
      owner_.push_back(random.Integer<std::size_t>(0, ranks.size() - 1));
      ranks[owner_.back()].push_back(rank);
      events_.emplace_back([this, rank] { runner(rank).OnRendered(rank, {rank, rank + 1}); });
    }
    for (std::vector<Rank>& of_worker : ranks) runners_.emplace_back(schedule, kFrame, std::move(of_worker));
  }

  void Run() {
    while (!events_.empty()) {
      const auto next = events_.begin() + std::ptrdiff_t(random_.Integer<std::size_t>(0, events_.size() - 1));
      const std::function<void()> event = std::move(*next);
      events_.erase(next);
      event();
      for (auto& runner : runners_) Advance(runner);
    }
  }

  ScheduleRunner<RankInterval>& runner(Rank rank) { return runners_[owner_[rank]]; }

 private:
  using Runner = ScheduleRunner<RankInterval>;

  void Advance(Runner& runner) {
    while (auto taken = runner.TakeNext()) {
      const Step& step = *taken->step;
      if (taken->kind == StepOrder::Kind::kReceive) {
        ASSERT_FALSE(arrived_[taken->index].empty());
        for (const Fragment<RankInterval>& part : std::exchange(arrived_[taken->index], {})) Merge(runner, step.to, part);
        continue;
      }
      ASSERT_EQ(PixelCount(taken->parts), PixelCount(step.pixels));
      for (const Fragment<RankInterval>& part : taken->parts) {
        if (taken->kind == StepOrder::Kind::kMove) {
          Merge(runner, step.to, part);
        } else {
          events_.emplace_back([this, index = taken->index, part] {
            StepOrder& order = this->runner(schedule_->steps()[index].to).order();
            const std::optional<std::uint32_t> turn = order.Awaited(index);
            ASSERT_TRUE(turn);
            arrived_[index].push_back(part);
            order.OnArrived(*turn, PixelCount(part.pixels));
          });
        }
      }
    }
  }

  void Merge(Runner& runner, Rank rank, const Fragment<RankInterval>& part) {
    ASSERT_TRUE(runner.held(rank).Combine(part, Joined));
    if (random_.Chance(0.5)) return;
    runner.order().OnCombineStarted(rank);
    events_.emplace_back([&runner, rank] { runner.order().OnCombined(rank); });
  }

  Random& random_;
  SharedSchedule schedule_;
  std::vector<std::size_t> owner_;  // of each rank
  std::vector<Runner> runners_;
  std::vector<std::function<void()>> events_;
  std::map<std::uint32_t, std::vector<Fragment<RankInterval>>> arrived_;
};

TEST(ScheduleRunner, EveryScheduleEndsAtItsRootsWhateverTheOrderOfEvents) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int trial = 0; trial < 60; ++trial) {
      const auto ranks = random.Integer<Rank>(1, 14);
      ScheduleName name = {RandomArguments(scheme, random), ranks, std::vector<Rank>(random.Integer<std::size_t>(1, 5))};
      for (Rank& root : name.roots) root = random.Integer<Rank>(0, ranks - 1);
      if (trial % 2 == 1) {
        for (Rank rank = 0; rank < ranks; ++rank) {
          if (rank == 0 || random.Chance(0.4)) name.runs.push_back(rank);
        }
        for (Rank& root : name.roots) root = *std::prev(std::ranges::upper_bound(name.runs, root));
      }
      SCOPED_TRACE(name.scheme + ", " + std::to_string(ranks) + " ranks, trial " + std::to_string(trial));
      World world(random, Derive(name), random.Integer(1, 6));
      world.Run();
      if (HasFatalFailure()) return;
      for (Rank rank = 0; rank < ranks; ++rank) EXPECT_TRUE(world.runner(rank).order().Done(rank));
      for (std::size_t share = 0; share < name.roots.size(); ++share) {
        const PixelRange pixels = Share(kFrame, share, name.roots.size());
        EXPECT_EQ(world.runner(name.roots[share]).held(name.roots[share]).Within(pixels),
                  (Fragments<RankInterval>::List{{pixels, {0, ranks}}}));
      }
    }
  }
}

// As many images travel as there are runs; those of a run are combined first.
TEST(DeriveSchedule, CombinesRunsBeforeTheScheme) {
  const ScheduleName name = {"fan-in", 7, {3}, {0, 3, 5}};
  const std::vector<Step>& steps = Derive(name)->steps();
  std::vector<std::pair<Rank, Rank>> moves;
  for (const Step& step : steps) moves.emplace_back(step.from, step.to);
  EXPECT_EQ(moves, (std::vector<std::pair<Rank, Rank>>{{1, 0}, {4, 3}, {6, 5}, {2, 0}, {0, 3}, {5, 3}}));
  EXPECT_EQ(AmongRuns(name), (ScheduleName{"fan-in", 3, {1}}));
  // However many ranks and runs there are, messages can name the steps.
  ScheduleName large = {"chain:strips=256", kMaxRanks, {0}, {}};
  for (Rank first = 0; first < kMaxRanks; first += 16) large.runs.push_back(first);
  EXPECT_LE(DeriveSchedule(large, {0, 1 << 24}).value()->steps().size(), kMaxSteps);
}

TEST(ScheduleRunner, ARankThatIsNotRenderedWaitsAndOneThatIsCombiningDoesNotSend) {
  ScheduleRunner<RankInterval> runner(Derive({"fan-in", 4, {0}}), kFrame, {2});
  const std::uint32_t receives = 1;  // from rank 3
  ASSERT_TRUE(runner.order().Awaited(receives));
  runner.order().OnArrived(runner.order().Awaited(receives).value(), 240);
  EXPECT_FALSE(runner.TakeNext());
  runner.OnRendered(2, {2, 3});
  EXPECT_EQ(runner.TakeNext()->kind, StepOrder::Kind::kReceive);
  runner.order().OnCombineStarted(2);
  EXPECT_FALSE(runner.TakeNext()) << "what it is to send is being combined";
  runner.order().OnCombined(2);
  EXPECT_EQ(runner.TakeNext()->kind, StepOrder::Kind::kSend);
}

TEST(ScheduleRunner, ARankThatIsCombiningReceives) {
  ScheduleRunner<RankInterval> runner(Derive({"centralized", 3, {0}}), kFrame, {0});
  ASSERT_TRUE(runner.order().Awaited(0));
  runner.order().OnArrived(runner.order().Awaited(0).value(), 240);
  EXPECT_FALSE(runner.TakeNext());
  runner.OnRendered(0, {0, 1});
  EXPECT_TRUE(runner.TakeNext());
  EXPECT_FALSE(runner.order().Awaited(0));
  runner.order().OnCombineStarted(0);
  runner.order().OnArrived(runner.order().Awaited(1).value(), 240);
  EXPECT_TRUE(runner.TakeNext());
  runner.order().OnCombineStarted(0);
  runner.order().OnCombined(0);
  EXPECT_FALSE(runner.order().Done(0));
  runner.order().OnCombined(0);
  EXPECT_TRUE(runner.order().Done(0));
}

// Others wait for what is sent.
TEST(ScheduleRunner, ARankSendsBeforeItReceives) {
  ScheduleRunner<RankInterval> runner(Derive({"direct-send", 3, {0, 1, 2}}), kFrame, {1});
  const std::vector<Step>& steps = runner.order().schedule().steps();
  for (std::uint32_t i = 0; i < steps.size(); ++i) {
    if (steps[i].to == 1) runner.order().OnArrived(runner.order().Awaited(i).value(), 80);
  }
  runner.OnRendered(1, {1, 2});
  std::vector<StepOrder::Kind> kinds;
  while (const auto taken = runner.TakeNext()) kinds.push_back(taken->kind);
  using enum StepOrder::Kind;
  EXPECT_EQ(kinds, (std::vector{kSend, kSend, kReceive, kReceive}));
}

TEST(ScheduleRunner, StepsOfTheSamePixelsKeepTheirOrderAndOthersDoNotWait) {
  ScheduleRunner<RankInterval> runner(Derive({"chain:strips=2", 3, {0}}), kFrame, {1});
  runner.OnRendered(1, {1, 2});
  const std::vector<Step>& steps = runner.order().schedule().steps();
  const auto index = [&](Rank to, std::uint64_t begin) {
    return std::uint32_t(std::ranges::find_if(steps, [&](const Step& s) { return s.to == to && s.pixels.begin == begin; }) - steps.begin());
  };
  EXPECT_FALSE(runner.TakeNext()) << "what is sent on waits for what comes in";
  runner.order().OnArrived(runner.order().Awaited(index(1, 120)).value(), 120);
  EXPECT_EQ(runner.TakeNext()->index, index(1, 120)) << "the second strip came first";
  EXPECT_EQ(runner.TakeNext()->index, index(0, 120));
  EXPECT_FALSE(runner.TakeNext());
}

TEST(ScheduleRunner, AReceiveComesAgainUntilAllPixelsAreThere) {
  ScheduleRunner<RankInterval> runner(Derive({"fan-in", 2, {0}}), kFrame, {0});
  runner.OnRendered(0, {0, 1});
  runner.order().OnArrived(runner.order().Awaited(0).value(), 100);
  EXPECT_TRUE(runner.TakeNext());
  EXPECT_FALSE(runner.TakeNext());
  EXPECT_TRUE(runner.order().Awaited(0));
  runner.order().OnArrived(runner.order().Awaited(0).value(), 140);
  EXPECT_TRUE(runner.TakeNext());
  EXPECT_FALSE(runner.order().Awaited(0));
}

TEST(DeriveSchedule, IsWhatTheSchemeMakes) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    const std::string scheme(entry.name);
    const SharedSchedule schedule = Derive({scheme, 13, {5}});
    EXPECT_EQ(schedule->schedule(), MakeSchedule(scheme, {13, 5, kFrame}));
    EXPECT_EQ(Derive({scheme, 13, {5}}), schedule) << "the last schedules are shared";
    for (Rank rank = 0; rank < 13; ++rank) {
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < schedule->steps().size(); ++i) {
        if (schedule->steps()[i].from == rank || schedule->steps()[i].to == rank) expected.push_back(i);
      }
      EXPECT_TRUE(std::ranges::equal(schedule->StepsOf(rank), expected));
    }
  }
  EXPECT_EQ(Derive({"", 0, {0}})->schedule(), (Schedule{0, {0}, {}}));
}

TEST(DeriveSchedule, SaysWhatIsWrongWithAName) {
  const auto message = [](const ScheduleName& name) { return DeriveSchedule(name, kFrame).status().message(); };
  EXPECT_EQ(message({"fan-in", 2, {2}}), "schedule.roots has 2, but must be below 2");
  EXPECT_EQ(message({"fan-in", 0, {1}}), "schedule.roots has 1, but must be below 1");
  EXPECT_EQ(message({"fan-in", 2, {}}), "schedule.roots are 0, but must be from 1 to 64");
  EXPECT_EQ(message({"fan-in", 30000, std::vector<Rank>(60)}), "schedule.roots are 60, but at most 34 are allowed for 30000 ranks");
  EXPECT_EQ(message({"fan-in", kMaxRanks + 1, {0}}), "schedule.ranks is 65537, but at most 65536 are allowed");
  EXPECT_EQ(message({"fan-in", 4, {0}, {0, 4}}), "schedule.runs must ascend from 0 and stay below 4");
  EXPECT_EQ(message({"fan-in", 4, {0}, {1, 2}}), "schedule.runs must ascend from 0 and stay below 4");
  EXPECT_EQ(message({"fan-in", 4, {0}, {0, 2, 2}}), "schedule.runs must ascend from 0 and stay below 4");
  EXPECT_EQ(message({"fan-in", 0, {0}, {0}}), "schedule.runs must ascend from 0 and stay below 0");
  EXPECT_EQ(message({"fan-in", 4, {1}, {0, 2}}), "schedule.roots has 1, but must be the first ranks of runs");
  EXPECT_NE(message({"glue", 2, {0}}).find("schedule.scheme: 'glue' is not one of"), std::string::npos);
  EXPECT_NE(message({"fan-in:2", 2, {0}}).find("takes nothing after its name"), std::string::npos);
}

}  // namespace
}  // namespace slabstream
