// EventQueue: virtual time, in seconds. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "common/base/time.h"

namespace slabstream {

class EventQueue {
 public:
  // Most events are only numbers below 2^27, told to `on_number`: there may be millions.
  explicit EventQueue(std::function<void(std::uint32_t)> on_number) : on_number_(std::move(on_number)) {}

  double now() const { return now_; }
  void TellAt(double when, std::uint32_t number) { Push({std::max(when, now_), ++planned_, 0, number}); }
  void At(double when, std::function<void()> what) {
    if (unused_.empty()) {
      unused_.push_back(std::uint32_t(actions_.size()));
      actions_.emplace_back();
    }
    const std::uint32_t action = unused_.back();
    unused_.pop_back();
    actions_[action] = std::move(what);
    Push({std::max(when, now_), ++planned_, 1, action});
  }
  void After(Duration delay, std::function<void()> what) { At(now_ + std::chrono::duration<double>(delay).count(), std::move(what)); }

  bool empty() const { return events_.empty(); }
  double next() const { return events_.front().when; }
  void RunNext() {
    const Event event = Pop();
    now_ = event.when;
    if (event.calls == 0) return on_number_(event.number);
    unused_.push_back(event.number);
    std::exchange(actions_[event.number], nullptr)();
  }
  // Something outside of the queue happens, not before now and not after the next event.
  void AdvanceTo(double now) { now_ = now; }

 private:
  struct Event {
    double when = 0;
    std::uint64_t order : 36 = 0;  // in which they were planned
    std::uint64_t calls : 1 = 0;   // `number` is a place in actions_
    std::uint64_t number : 27 = 0;
    friend bool operator<(const Event& a, const Event& b) { return a.when != b.when ? a.when < b.when : a.order < b.order; }
  };

  // A heap in which each event comes before its kChildren children: these are neighbours in memory, and there are half as many levels as
  // with two.
  static constexpr std::size_t kChildren = 4;
  void Push(const Event& event) {
    std::size_t place = events_.size();
    events_.push_back(event);
    for (; place > 0 && event < events_[(place - 1) / kChildren]; place = (place - 1) / kChildren) {
      events_[place] = events_[(place - 1) / kChildren];
    }
    events_[place] = event;
  }
  Event Pop() {
    const Event first = events_.front(), last = events_.back();
    events_.pop_back();
    std::size_t place = 0;
    for (std::size_t child = 1; child < events_.size(); child = kChildren * place + 1) {
      const auto children = events_.begin() + std::ptrdiff_t(child);
      const auto least = std::min_element(children, children + std::ptrdiff_t(std::min(kChildren, events_.size() - child)));
      if (!(*least < last)) break;
      events_[place] = *least;
      place = std::size_t(least - events_.begin());
    }
    if (!events_.empty()) events_[place] = last;
    return first;
  }

  const std::function<void(std::uint32_t)> on_number_;
  double now_ = 0;
  std::uint64_t planned_ = 0;
  std::vector<Event> events_;
  std::vector<std::function<void()>> actions_;
  std::vector<std::uint32_t> unused_;  // places in actions_
};

}  // namespace slabstream
