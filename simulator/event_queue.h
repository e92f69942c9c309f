// EventQueue: virtual time. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/time.h"

namespace slabstream {

// Instant: Time, or double for seconds.
template <class Instant>
class EventQueue {
 public:
  using Delay = decltype(Instant() - Instant());

  explicit EventQueue(Instant start) : now_(start) {}

  Instant now() const { return now_; }
  void At(Instant when, std::function<void()> what) { events_.push({std::max(when, now_), ++planned_, std::move(what)}); }
  void After(Delay delay, std::function<void()> what) { At(now_ + delay, std::move(what)); }

  bool empty() const { return events_.empty(); }
  Instant next() const { return events_.top().when; }
  void RunNext() {
    Event event = std::move(const_cast<Event&>(events_.top()));  // it is popped at once
    events_.pop();
    now_ = event.when;
    event.what();
  }
  // Something outside of the queue happens, not before now and not after the next event.
  void AdvanceTo(Instant now) { now_ = now; }

 private:
  struct Event {
    Instant when{};
    std::uint64_t number = 0;
    std::function<void()> what;
    friend bool operator<(const Event& a, const Event& b) { return std::tie(b.when, b.number) < std::tie(a.when, a.number); }
  };

  Instant now_;
  std::uint64_t planned_ = 0;
  std::priority_queue<Event> events_;
};

}  // namespace slabstream
