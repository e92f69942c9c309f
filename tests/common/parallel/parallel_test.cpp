#include "common/parallel/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/parallel/task_arena.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// How often each of `count` numbers is met.
using Met = std::vector<std::atomic<int>>;

bool AllOnce(const Met& met) {
  return std::ranges::all_of(met, [](const std::atomic<int>& times) { return times == 1; });
}

TEST(ParallelFor, CallsForEachIndexOnce) {
  for (const std::size_t count : {1, 2, 3, 100, 10007}) {
    Met met(count);
    ParallelFor(0, count, [&](std::size_t index) { ++met[index]; });
    EXPECT_TRUE(AllOnce(met)) << count;
  }
}

TEST(ParallelFor, TakesIndexesOfAnySign) {
  std::atomic<int> sum = 0, calls = 0;
  ParallelFor(-7, 5, [&](int index) {
    sum += index;
    ++calls;
  });
  EXPECT_EQ(sum, -18);
  EXPECT_EQ(calls, 12);
}

TEST(ParallelFor, CallsNothingForAnEmptyRange) {
  const auto never = [](auto) { ADD_FAILURE(); };
  ParallelFor(0, 0, never);
  ParallelFor(3, 3, never);
  ParallelFor(3, -3, never);
  ParallelFor(std::size_t{5}, std::size_t{0}, never);
  ParallelForRanges(4, 1, 16, [](int, int) { ADD_FAILURE(); });
}

TEST(ParallelForRanges, RangesAreDisjointAndNotCutBelowTheGrain) {
  for (const std::int32_t grain : {1, 7, 64}) {
    for (const std::int32_t count : {1, 5, 63, 1000}) {
      auto met = Met(std::size_t(count));
      std::atomic<std::int32_t> least = std::numeric_limits<std::int32_t>::max();
      ParallelForRanges(10, 10 + count, grain, [&](std::int32_t begin, std::int32_t end) {
        ASSERT_LT(begin, end);
        for (std::int32_t i = begin; i < end; ++i) ++met[std::size_t(i - 10)];
        std::int32_t known = least;
        while (end - begin < known && !least.compare_exchange_weak(known, end - begin)) {
        }
      });
      EXPECT_TRUE(AllOnce(met)) << grain << ' ' << count;
      // A range of more than `grain` is cut in the middle.
      EXPECT_GE(least, std::min(count, (grain + 1) / 2)) << grain << ' ' << count;
    }
  }
}

TEST(ParallelFor, LoopsMayRunLoops) {
  constexpr int kSide = 40;
  Met met(std::size_t{kSide} * kSide);
  ParallelFor(0, kSide, [&](int row) { ParallelFor(0, kSide, [&](int column) { ++met[std::size_t(row * kSide + column)]; }); });
  EXPECT_TRUE(AllOnce(met));
}

TEST(ParallelFor, ThrowsWhatACallThrows) {
  std::atomic<int> running = 0;
  const auto loop = [&] {
    ParallelFor(0, 1000, [&](int index) {
      ++running;
      const std::string text = "index " + std::to_string(index);
      --running;
      if (index == 500) throw std::runtime_error(text);
    });
  };
  try {
    loop();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "index 500");
    EXPECT_EQ(running, 0);
  }
  EXPECT_THROW(ParallelFor(0, 4, [&](int) { loop(); }), std::runtime_error);
  Met met(100);  // later loops are not concerned
  ParallelFor(0, 100, [&](int index) { ++met[std::size_t(index)]; });
  EXPECT_TRUE(AllOnce(met));
}

TEST(OnEveryThread, CallsAsOftenAsTheArenaHasThreads) {
  for (const int threads : {1, 2, 5}) {
    TaskArena arena(threads);
    std::atomic<int> calls = 0;
    arena.Run([&] { OnEveryThread([&] { ++calls; }); });
    EXPECT_EQ(calls, threads);
  }
}

TEST(ParallelInOrder, UsesWhatWasMadeInOrder) {
  for (const int threads : {1, 2, 4}) {
    for (const std::int64_t count : {0, 1, 2, 300}) {
      for (const std::int64_t most : {1, 2, 5}) {
        TaskArena arena(threads);
        std::vector<std::int64_t> used;
        std::atomic<std::int64_t> alive = 0, most_alive = 0;
        const auto make = [&](std::int64_t number) {
          const std::int64_t now = ++alive;
          std::int64_t known = most_alive;
          while (now > known && !most_alive.compare_exchange_weak(known, now)) {
          }
          return std::to_string(number);
        };
        const auto use = [&](std::int64_t number, const std::string& made) {
          EXPECT_EQ(made, std::to_string(number));
          used.push_back(number);
          --alive;
        };
        arena.Run([&] { ParallelInOrder(count, most, make, use); });
        std::vector<std::int64_t> expected(std::size_t(count), 0);
        std::iota(expected.begin(), expected.end(), 0);
        EXPECT_EQ(used, expected);
        EXPECT_LE(most_alive, most);
      }
    }
  }
}

TEST(ParallelInOrder, ThrowsWhatACallThrows) {
  const auto make = [](std::int64_t number) { return number == 20 ? throw std::runtime_error("made") : number; };
  EXPECT_THROW(ParallelInOrder(100, 3, make, [](std::int64_t, std::int64_t) {}), std::runtime_error);
  const auto use = [](std::int64_t number, std::int64_t) {
    if (number == 20) throw std::logic_error("used");
  };
  EXPECT_THROW(ParallelInOrder(
                   100, 3, [](std::int64_t number) { return number; }, use),
               std::logic_error);
}

TEST(ParallelSort, Sorts) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {0, 1, 1000, 100000}) {
    std::vector<std::uint64_t> numbers(count);
    for (std::uint64_t& number : numbers) number = std::uint64_t(random.Integer<std::uint64_t>(0, 1 << 20)) << 32;
    std::vector<std::uint64_t> expected = numbers;
    std::ranges::sort(expected);
    ParallelSort(numbers);
    EXPECT_EQ(numbers, expected);
  }
}

}  // namespace
}  // namespace slabstream
