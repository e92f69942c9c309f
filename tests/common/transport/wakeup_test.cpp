// What ends a wait for sockets.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>
#include <vector>

#include "common/transport/mailbox.h"
#include "common/transport/socket.h"
#include "tests/common/transport/conversation.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

TEST(Wakeup, EndsAWaitFromAnotherThread) {
  Mailbox<int> mailbox;
  std::thread poster([&] {
    for (int i = 0; i < 1000; ++i) mailbox.Post(i);
  });
  std::vector<int> values;
  while (values.size() < 1000) {
    Wait({}, &mailbox.wakeup(), kPatience);
    for (const int value : mailbox.TakeAll()) values.push_back(value);
  }
  poster.join();
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(values[static_cast<std::size_t>(i)], i);
}

TEST(Wakeup, NotificationsAreConsumedAndNotLost) {
  Wakeup wakeup;
  wakeup.Notify();
  wakeup.Notify();
  Wait({}, &wakeup, kPatience);  // returns at once: it was notified before
  const Time begin = MonotonicNow();
  Wait({}, &wakeup, milliseconds(5));
  EXPECT_GE(MonotonicNow() - begin, milliseconds(5)) << "both notifications were consumed by the first wait";
}

TEST(Wakeup, ASignalEndsAWait) {
  static Wakeup* notified = nullptr;
  Wakeup wakeup;
  notified = &wakeup;
  const auto before = std::signal(SIGUSR1, [](int) { notified->Notify(); });
  std::atomic<bool> done = false;
  const pthread_t waiter = pthread_self();
  std::thread sender([&] {
    while (!done) {
      pthread_kill(waiter, SIGUSR1);
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < 20; ++i) Wait({}, &wakeup, kPatience);
  done = true;
  sender.join();
  std::signal(SIGUSR1, before);
}

}  // namespace
}  // namespace slabstream
