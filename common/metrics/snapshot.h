// Snapshot: what a thread knows, for another one that asks now and then. The thread that knows does nothing for it until it is asked.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "common/base/time.h"

namespace slabstream {

template <class T>
class Snapshot {
 public:
  // The thread that asks. `wake` makes the other one look at wanted() soon. If that one is held up, the last value is returned after
  // kPatience; if the last one is new, it is returned at once, so that many questions are no load.
  T Get(const std::function<void()>& wake) {
    std::unique_lock lock(mutex_);
    if (taken_ && MonotonicNow() - *taken_ < kFresh) return value_;
    wanted_ = true;
    wake();
    changed_.wait_for(lock, kPatience, [this] { return !wanted_; });
    return value_;
  }

  // The thread that knows: whether to call Set.
  bool wanted() const { return wanted_; }
  void Set(T value) {
    const std::lock_guard lock(mutex_);
    value_ = std::move(value);
    taken_ = MonotonicNow();
    wanted_ = false;
    changed_.notify_all();
  }

 private:
  static constexpr Duration kFresh = std::chrono::milliseconds(50), kPatience = std::chrono::milliseconds(500);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::atomic<bool> wanted_ = false;
  T value_{};
  std::optional<Time> taken_;  // none: not yet
};

}  // namespace slabstream
