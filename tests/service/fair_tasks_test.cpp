// Fair tasks: those of one owner run in order, and never those of another one wait for them.
#include "coordinator/service/fair_tasks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <semaphore>
#include <vector>

namespace slabstream {
namespace {

TEST(FairTasks, ALongTaskHoldsUpItsOwnerAlone) {
  std::binary_semaphore long_may_end{0};
  std::counting_semaphore<> ended{0};
  std::mutex mutex;
  std::vector<int> order;
  const auto note = [&](int number) {
    {
      const std::lock_guard lock(mutex);
      order.push_back(number);
    }
    ended.release();
  };
  FairTasks tasks(2);
  tasks.Post(1, [&] {
    long_may_end.acquire();
    note(1);
  });
  tasks.Post(1, [&] { note(2); });
  for (int number = 3; number < 6; ++number) tasks.Post(2, [&, number] { note(number); });
  for (int i = 0; i < 3; ++i) ended.acquire();
  long_may_end.release();
  for (int i = 0; i < 2; ++i) ended.acquire();
  EXPECT_EQ(order, (std::vector<int>{3, 4, 5, 1, 2}));
}

TEST(FairTasks, WithOneThreadOwnersTakeTurns) {
  std::binary_semaphore all_posted{0};
  std::counting_semaphore<> ended{0};
  std::vector<int> order;  // of the one thread
  FairTasks tasks(1);
  tasks.Post(9, [&] { all_posted.acquire(); });
  for (int i = 0; i < 100; ++i) {
    tasks.Post(1, [&] {
      order.push_back(1);
      ended.release();
    });
  }
  tasks.Post(2, [&] {
    order.push_back(2);
    ended.release();
  });
  all_posted.release();
  for (int i = 0; i < 101; ++i) ended.acquire();
  EXPECT_LE(std::find(order.begin(), order.end(), 2) - order.begin(), 1) << "it waits for the turn at hand";
}

TEST(FairTasks, SomeOfOneOwnerMayRunAtATime) {
  std::counting_semaphore<> begun{0}, may_end{0}, ended{0};
  FairTasks tasks(3, 2);
  const auto task = [&] {
    begun.release();
    may_end.acquire();
    ended.release();
  };
  for (int i = 0; i < 4; ++i) tasks.Post(1, task);
  for (int i = 0; i < 2; ++i) begun.acquire();
  tasks.Post(2, task);
  begun.acquire();  // the third thread is left for another owner
  EXPECT_FALSE(begun.try_acquire());
  may_end.release(5);
  for (int i = 0; i < 5; ++i) ended.acquire();
}

TEST(FairTasks, EveryTaskRunsOnce) {
  constexpr int kTasks = 2000;
  std::atomic<int> runs = 0;
  std::counting_semaphore<> ended{0};
  FairTasks tasks(4);
  for (int i = 0; i < kTasks; ++i) {
    tasks.Post(FairTasks::Owner(i % 7), [&] {
      ++runs;
      ended.release();
    });
  }
  for (int i = 0; i < kTasks; ++i) ended.acquire();
  EXPECT_EQ(runs, kTasks);
}

}  // namespace
}  // namespace slabstream
