#include "common/parallel/task_arena.h"

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

std::set<std::thread::id> ThreadsOfALoop() {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  ParallelFor(0, 10000, [&](int) {
    const std::lock_guard lock(mutex);
    threads.insert(std::this_thread::get_id());
  });
  return threads;
}

TEST(TaskArena, OfOneThreadRunsLoopsOnTheCallingOne) {
  TaskArena arena(1);
  EXPECT_EQ(arena.threads(), 1);
  EXPECT_EQ(arena.Run([] { return ThreadsHere(); }), 1);
  EXPECT_EQ(arena.Run(ThreadsOfALoop), std::set{std::this_thread::get_id()});
}

TEST(TaskArena, LimitsTheThreadsOfLoops) {
  for (const int threads : {2, 3}) {
    TaskArena arena(threads);
    EXPECT_EQ(arena.Run([] { return ThreadsHere(); }), threads);
    EXPECT_LE(int(arena.Run(ThreadsOfALoop).size()), threads);
  }
}

TEST(TaskArena, ChangesItsThreads) {
  TaskArena arena(3);
  arena.Run([] { ParallelFor(0, 100, [](int) {}); });
  arena.Resize(1);
  EXPECT_EQ(arena.threads(), 1);
  EXPECT_EQ(arena.Run(ThreadsOfALoop).size(), 1U);
  arena.Resize(2);
  EXPECT_EQ(arena.Run([] { return ThreadsHere(); }), 2);
}

TEST(TaskArena, ReturnsAndThrowsWhatTheWorkDoes) {
  TaskArena arena(2);
  EXPECT_EQ(*arena.Run([] { return std::make_unique<int>(7); }), 7);
  int calls = 0;
  arena.Run([&] { ++calls; });
  EXPECT_EQ(calls, 1);
  EXPECT_THROW(arena.Run([] { throw std::runtime_error("of the work"); }), std::runtime_error);
  EXPECT_THROW(arena.Run([] { return ParallelFor(0, 9, [](int) { throw std::logic_error("of a loop"); }); }), std::logic_error);
}

TEST(TaskArena, MayBeUsedInAnother) {
  TaskArena outer(3), inner(1);
  const int threads = outer.Run([&] {
    const int within = inner.Run([] { return ThreadsHere(); });
    EXPECT_EQ(ThreadsHere(), 3);
    return within;
  });
  EXPECT_EQ(threads, 1);
}

TEST(ThreadLimit, LeavesTheCallingThreadAlone) {
  const ThreadLimit one(1);
  TaskArena arena(4);
  EXPECT_EQ(arena.Run(ThreadsOfALoop), std::set{std::this_thread::get_id()});
}

TEST(DefaultThreads, AreAtLeastOne) { EXPECT_GE(DefaultThreads(), 1); }

}  // namespace
}  // namespace slabstream
