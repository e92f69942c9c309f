#include "common/parallel/per_thread.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <thread>

#include "common/parallel/parallel.h"
#include "common/parallel/task_arena.h"

namespace slabstream {
namespace {

TEST(PerThread, AThreadMakesItsValueOnce) {
  PerThread<int> values;
  int made = 0;
  const auto make = [&] { return 10 * ++made; };
  EXPECT_EQ(values.Mine(make), 10);
  values.Mine(make) = 3;
  EXPECT_EQ(values.Mine(), 3);
  std::thread([&] { EXPECT_EQ(values.Mine(make), 20); }).join();
  std::multiset<int> all;
  values.ForEach([&](int value) { all.insert(value); });
  EXPECT_EQ(all, (std::multiset{3, 20}));
}

TEST(PerThread, ValuesBeginWithTheirDefault) {
  const PerThread<int> none;
  none.ForEach([](int) { ADD_FAILURE(); });
  PerThread<std::unique_ptr<int>> values;
  EXPECT_EQ(values.Mine(), nullptr);
  PerThread<double> numbers;
  EXPECT_EQ(numbers.Mine(), 0);
}

TEST(PerThread, SumsOfThreadsAreTheWholeSum) {
  TaskArena arena(4);
  PerThread<long> parts;
  arena.Run([&] { ParallelFor(0, 10000, [&](int index) { parts.Mine() += index; }); });
  long sum = 0;
  parts.ForEach([&](long part) { sum += part; });
  EXPECT_EQ(sum, 49995000);
}

TEST(PerThread, ObjectsDoNotShareValues) {
  PerThread<int> one, other;
  one.Mine() = 1;
  EXPECT_EQ(other.Mine(), 0);
}

}  // namespace
}  // namespace slabstream
