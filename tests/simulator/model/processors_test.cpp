#include "simulator/model/processors.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "tests/support/random.h"

namespace slabstream {
namespace {

std::map<std::uint64_t, double> RunAll(Processors& processors) {
  std::map<std::uint64_t, double> ends;
  while (processors.NextTime() < std::numeric_limits<double>::infinity()) {
    const Processors::Completion done = processors.Finish();
    ends[done.task] = done.time;
  }
  return ends;
}

TEST(Processors, TasksWithACoreOfTheirOwnDoNotMind) {
  Processors processors(2, 0);
  processors.Start(0, 1, 3, 0);
  processors.Start(0, 2, 1, 1);
  processors.Start(1, 3, 5, 1);
  EXPECT_EQ(RunAll(processors), (std::map<std::uint64_t, double>{{1, 3}, {2, 2}, {3, 6}}));
}

TEST(Processors, TasksShareTheCoresThatThereAre) {
  Processors processors(1, 0);
  processors.Start(0, 1, 2, 0);
  processors.Start(0, 2, 1, 1);  // from now on each at half speed: both have 1 s left
  const auto ends = RunAll(processors);
  EXPECT_DOUBLE_EQ(ends.at(1), 3);
  EXPECT_DOUBLE_EQ(ends.at(2), 3);
}

TEST(Processors, BusyNeighboursSlowDown) {
  Processors processors(4, 0.25);
  processors.Start(0, 1, 1, 0);
  processors.Start(0, 2, 4, 0);
  const auto ends = RunAll(processors);
  EXPECT_DOUBLE_EQ(ends.at(1), 1.25);
  EXPECT_DOUBLE_EQ(ends.at(2), 1.25 + 3);
}

TEST(Processors, ATaskThatIsEndedFreesItsCore) {
  Processors processors(1, 0);
  processors.Start(0, 1, 4, 0);
  processors.Start(0, 2, 2, 0);  // each at half speed
  processors.EndNow(0, 1, 1);
  EXPECT_EQ(RunAll(processors), (std::map<std::uint64_t, double>{{1, 1}, {2, 2.5}}));
}

// Whatever is started when: no core is idle while work waits, and none does more than a second's work a second.
TEST(Processors, WorkIsConserved) {
  Random random(9);
  SCOPED_TRACE(random.trace());
  for (int run = 0; run < 20; ++run) {
    const int cores = random.Integer(1, 4);
    Processors processors(cores, 0);
    double work = 0, end = 0;
    for (std::uint64_t task = 0; task < 20; ++task) {
      const double seconds = random.Real(0, 2);
      work += seconds;
      processors.Start(0, task, seconds, 0);
    }
    for (const auto& [task, time] : RunAll(processors)) end = std::max(end, time);
    EXPECT_GE(end, work / cores * (1 - 1e-12));
    EXPECT_LE(end, work / cores + 2);
  }
}

}  // namespace
}  // namespace slabstream
