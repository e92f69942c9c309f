// EventQueue: virtual time, in seconds. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
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
    Push({std::max(when, now_), ++planned_, action});
  }
  void After(Duration delay, std::function<void()> what) { At(now_ + std::chrono::duration<double>(delay).count(), std::move(what)); }

  bool empty() const { return events_.empty(); }
  double next() const { return events_.front().when; }
  void RunNext() {
    const Event event = Pop();
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
    bool Before(const Event& other) const { return when != other.when ? when < other.when : number < other.number; }
  };

  // The events are a heap: the children of event i are 4 i + 1 to 4 i + 4. With four of them, half as many places far apart are touched as
  // with two.
  static constexpr std::size_t kChildren = 4;
  void Push(const Event& event) {
    std::size_t place = events_.size();
    events_.push_back(event);
    for (std::size_t parent; place > 0 && event.Before(events_[parent = (place - 1) / kChildren]); place = parent) {
      events_[place] = events_[parent];
    }
    events_[place] = event;
  }
  Event Pop() {
    const Event first = events_.front(), last = events_.back();
    events_.pop_back();
    std::size_t place = 0;
    for (std::size_t child = 1; child < events_.size(); child = kChildren * place + 1) {
      const std::size_t end = std::min(child + kChildren, events_.size());
      std::size_t least = child;
      for (++child; child < end; ++child) {
        if (events_[child].Before(events_[least])) least = child;
      }
      if (!events_[least].Before(last)) break;
      events_[place] = events_[least];
      place = least;
    }
    if (!events_.empty()) events_[place] = last;
    return first;
  }

  double now_ = 0;
  std::uint64_t planned_ = 0;
  std::vector<Event> events_;
  std::vector<std::function<void()>> actions_;
  std::vector<std::uint32_t> unused_;  // places in actions_
};

}  // namespace slabstream
