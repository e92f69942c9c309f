#include "common/threads/background_tasks.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <memory>
#include <system_error>
#include <thread>
#include <vector>

#include "tests/support/no_more_threads.h"

namespace slabstream {
namespace {

TEST(BackgroundTasks, OneThreadRunsThemInOrder) {
  std::vector<int> order;
  std::latch done(1);
  BackgroundTasks tasks(1);
  for (int i = 0; i < 100; ++i) {
    tasks.Post([&order, i] { order.push_back(i); });
  }
  tasks.Post([&done] { done.count_down(); });
  done.wait();
  ASSERT_EQ(order.size(), 100U);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(order[std::size_t(i)], i);
}

// Each waits for all others: they would never end one after the other.
TEST(BackgroundTasks, RunSideBySideOnAsManyThreadsAsAllowed) {
  std::latch together(4), done(4);
  BackgroundTasks tasks(4);
  for (int i = 0; i < 4; ++i) {
    tasks.Post([&] {
      together.arrive_and_wait();
      done.count_down();
    });
  }
  done.wait();
}

TEST(BackgroundTasks, RunOneAfterTheOtherIfThereCanBeNoFurtherThread) {
  std::latch begun(1), go_on(1), done(2);
  BackgroundTasks tasks(4);
  {
    const NoMoreThreads now;
    EXPECT_THROW(std::thread([] {}), std::system_error);
    tasks.Post([&] {
      begun.count_down();
      go_on.wait();
      done.count_down();
    });
    begun.wait();
    tasks.Post([&] { done.count_down(); });
  }
  go_on.count_down();
  done.wait();
}

TEST(BackgroundTasks, AreNotWaitedForAndDroppedIfTheyHaveNotBegun) {
  struct Shared {
    std::latch begun{1}, go_on{1}, done{1};
    std::atomic<bool> second = false;
  };
  const auto shared = std::make_shared<Shared>();
  {
    BackgroundTasks tasks(1);
    tasks.Post([shared] {
      shared->begun.count_down();
      shared->go_on.wait();
      shared->done.count_down();
    });
    tasks.Post([shared] { shared->second = true; });
    shared->begun.wait();
    EXPECT_TRUE(BackgroundTasks::AnyRunning());
  }
  shared->go_on.count_down();
  shared->done.wait();
  EXPECT_FALSE(shared->second);
}

}  // namespace
}  // namespace slabstream
