// EventQueue: virtual time. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/time.h"

namespace slabstream {

class EventQueue {
 public:
  Time now() const { return now_; }
  void At(Time when, std::function<void()> what) { events_.push({std::max(when, now_), ++planned_, std::move(what)}); }
  void After(Duration delay, std::function<void()> what) { At(now_ + delay, std::move(what)); }

  bool empty() const { return events_.empty(); }
  Time next() const { return events_.top().when; }
  void RunNext() {
    Event event = std::move(const_cast<Event&>(events_.top()));  // it is popped at once
    events_.pop();
    now_ = event.when;
    event.what();
  }

 private:
  struct Event {
    Time when;
    std::uint64_t number = 0;
    std::function<void()> what;
    friend bool operator<(const Event& a, const Event& b) { return std::tie(b.when, b.number) < std::tie(a.when, a.number); }
  };

  Time now_{std::chrono::seconds(1000)};
  std::uint64_t planned_ = 0;
  std::priority_queue<Event> events_;
};

// Wakes a machine when it wants to be woken: at most one event is planned that is not too late.
class Alarm {
 public:
  // `wake` is called at `when` or later; it looks at the machine's NextWake and sets the alarm again.
  void Set(EventQueue& queue, Time when, const std::function<void()>& wake) {
    if (when >= planned_) return;
    planned_ = when;
    queue.At(when, [this, when, wake] {
      if (planned_ != when) return;
      planned_ = Time::max();
      wake();
    });
  }

 private:
  Time planned_ = Time::max();
};

}  // namespace slabstream
