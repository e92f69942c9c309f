// EventQueue: virtual time, in seconds. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <deque>
#include <functional>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/base/time.h"

namespace slabstream {

class EventQueue {
 public:
  // Most events are only numbers below 2^27, told to `on_number`: there may be millions.
  explicit EventQueue(std::function<void(std::uint32_t)> on_number) : on_number_(std::move(on_number)) {}

  double now() const { return now_; }
  void TellAt(double when, std::uint32_t number) { events_.push(Plan(when, false, number)); }
  // The same for an event of a stream. Events of one stream mostly come in the order of their times, so only the first needs a place in the
  // heap. `on_number` must call NextOf with the stream of the event that it is told, before it plans or runs another one. A stream's number
  // is an index: they count from 0.
  void TellAt(double when, std::uint32_t number, std::uint32_t stream) {
    if (stream >= streams_.size()) streams_.resize(stream + 1);
    Stream& of = streams_[stream];
    const Event event = Plan(when, false, number);
    if (of.in_heap > 0 && event > of.last) return of.waiting.push_back(of.last = event);
    if (of.in_heap++ == 0) of.last = event;
    events_.push(event);
  }
  void NextOf(std::uint32_t stream) {
    Stream& of = streams_[stream];
    if (of.waiting.empty()) return void(--of.in_heap);
    events_.push(of.waiting.front());
    of.waiting.pop_front();
  }
  void At(double when, std::function<void()> what) {
    const std::uint32_t action = ++last_action_ & kMostNumber;
    actions_[action] = std::move(what);
    events_.push(Plan(when, true, action));
  }
  void After(Duration delay, std::function<void()> what) { At(now_ + std::chrono::duration<double>(delay).count(), std::move(what)); }

  bool empty() const { return events_.empty(); }
  double next() const { return TimeOf(events_.top()); }
  void RunNext() {
    const Event event = events_.top();
    events_.pop();
    now_ = TimeOf(event);
    const auto number = std::uint32_t(event) & kMostNumber;
    if ((event & (Event{1} << 27U)) == 0) return on_number_(number);
    actions_.extract(number).mapped()();
  }
  // Something outside of the queue happens, not before now and not after the next event.
  void AdvanceTo(double now) { now_ = now; }

 private:
  // One number, so that comparing takes no branch: the bits of the time, which is not negative; the order in which the events were planned
  // (36 bits); whether `number` names one of actions_; and `number` (27 bits).
  __extension__ using Event = unsigned __int128;
  Event Plan(double when, bool calls, std::uint32_t number) {
    const std::uint64_t low = ++planned_ << 28U | std::uint64_t{calls} << 27U | number;
    return Event{std::bit_cast<std::uint64_t>(std::max(now_, when))} << 64U | low;
  }
  static double TimeOf(const Event& event) { return std::bit_cast<double>(std::uint64_t(event >> 64U)); }

  struct Stream {
    Event last = 0;             // the latest one that is not behind others in time
    std::uint32_t in_heap = 0;  // none that waits comes before all of these
    std::deque<Event> waiting;  // in order of time
  };
  static constexpr std::uint32_t kMostNumber = (std::uint32_t{1} << 27U) - 1;

  const std::function<void(std::uint32_t)> on_number_;
  double now_ = 0;
  std::uint64_t planned_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::vector<Stream> streams_;
  std::uint32_t last_action_ = 0;
  std::unordered_map<std::uint32_t, std::function<void()>> actions_;  // actions that wait
};

}  // namespace slabstream
