// EventQueue: virtual time, in seconds. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include "common/base/time.h"

namespace slabstream {

class EventQueue {
 public:
  double now() const { return now_; }
  void At(double when, std::function<void()> what) {
    if (unused_.empty()) {
      unused_.push_back(std::uint32_t(actions_.size()));
      actions_.emplace_back();
    }
    const std::uint32_t action = unused_.back();
    unused_.pop_back();
    actions_[action] = std::move(what);
    events_.push({std::max(when, now_), ++planned_, action});
  }
  void After(Duration delay, std::function<void()> what) { At(now_ + std::chrono::duration<double>(delay).count(), std::move(what)); }

  bool empty() const { return events_.empty(); }
  double next() const { return events_.top().when; }
  void RunNext() {
    const Event event = events_.top();
    events_.pop();
    now_ = event.when;
    unused_.push_back(event.action);
    std::exchange(actions_[event.action], nullptr)();
  }
  // Something outside of the queue happens, not before now and not after the next event.
  void AdvanceTo(double now) { now_ = now; }

 private:
  struct Event {  // small, since the queue moves it often
    double when = 0;
    std::uint64_t number : 36 = 0;  // in the order in which they were planned
    std::uint64_t action : 28 = 0;
    friend bool operator<(const Event& a, const Event& b) { return a.when != b.when ? a.when > b.when : a.number > b.number; }
  };

  double now_ = 0;
  std::uint64_t planned_ = 0;
  std::priority_queue<Event> events_;
  std::vector<std::function<void()>> actions_;
  std::vector<std::uint32_t> unused_;  // places in actions_
};

}  // namespace slabstream
