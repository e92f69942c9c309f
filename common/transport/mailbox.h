// Mailbox<T>: how other threads hand values to the thread that owns the sockets. Post from any thread; the owner waits on wakeup() and
// takes all.
#pragma once

#include <mutex>
#include <utility>
#include <vector>

#include "common/transport/socket.h"

namespace slabstream {

template <class T>
class Mailbox {
 public:
  void Post(T value) {
    {
      const std::lock_guard lock(mutex_);
      values_.push_back(std::move(value));
    }
    wakeup_.Notify();
  }

  // Everything posted since the last call, in order.
  std::vector<T> TakeAll() {
    const std::lock_guard lock(mutex_);
    return std::exchange(values_, {});
  }

  Wakeup& wakeup() { return wakeup_; }

 private:
  std::mutex mutex_;
  std::vector<T> values_;  // guarded by mutex_
  Wakeup wakeup_;
};

}  // namespace slabstream
