// EventQueue: virtual time, in seconds. What is due next runs next; equal times run in the order in which they were planned.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <deque>
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
  void TellAt(double when, std::uint32_t number) { Push(Plan(when, false, number)); }
  // The same for events of a stream, which are mostly told in order of time, so that only the first of them needs a place in the heap.
  // Whoever is told the number of one calls NextOf before anything else happens. Streams are few: 0, 1, ...
  void TellAt(double when, std::uint32_t number, std::uint32_t stream) {
    if (stream >= streams_.size()) streams_.resize(stream + 1);
    Stream& of = streams_[stream];
    const Event event = Plan(when, false, number);
    if (of.in_heap > 0 && event > of.last) return of.waiting.push_back(of.last = event);
    if (of.in_heap++ == 0) of.last = event;
    Push(event);
  }
  void NextOf(std::uint32_t stream) {
    Stream& of = streams_[stream];
    if (of.waiting.empty()) return void(--of.in_heap);
    Push(of.waiting.front());
    of.waiting.pop_front();
  }
  void At(double when, std::function<void()> what) {
    if (unused_.empty()) {
      unused_.push_back(std::uint32_t(actions_.size()));
      actions_.emplace_back();
    }
    const std::uint32_t action = unused_.back();
    unused_.pop_back();
    actions_[action] = std::move(what);
    Push(Plan(when, true, action));
  }
  void After(Duration delay, std::function<void()> what) { At(now_ + std::chrono::duration<double>(delay).count(), std::move(what)); }

  bool empty() const { return events_.empty(); }
  double next() const { return TimeOf(events_.front()); }
  void RunNext() {
    const Event event = Pop();
    now_ = TimeOf(event);
    const auto number = std::uint32_t(event) & kMostNumber;
    if ((event & (Event{1} << 27U)) == 0) return on_number_(number);
    unused_.push_back(number);
    std::exchange(actions_[number], nullptr)();
  }
  // Something outside of the queue happens, not before now and not after the next event.
  void AdvanceTo(double now) { now_ = now; }

 private:
  // One number, so that comparing takes no branch: the bits of the time, which is not negative; the order in which the events were planned
  // (36 bits); whether `number` is a place in actions_; and `number` (27 bits).
  __extension__ using Event = unsigned __int128;
  Event Plan(double when, bool calls, std::uint32_t number) {
    const std::uint64_t low = ++planned_ << 28U | std::uint64_t{calls} << 27U | number;
    return Event{std::bit_cast<std::uint64_t>(std::max(when, now_))} << 64U | low;
  }
  static double TimeOf(const Event& event) { return std::bit_cast<double>(std::uint64_t(event >> 64U)); }

  struct Stream {
    Event last = 0;             // the latest one that is not behind others in time
    std::uint32_t in_heap = 0;  // none that waits comes before all of these
    std::deque<Event> waiting;  // in order of time
  };
  static constexpr std::uint32_t kMostNumber = (std::uint32_t{1} << 27U) - 1;

  // A heap in which each event comes before its kChildren children: these are neighbours in memory, and there are half as many levels as
  // with two.
  static constexpr std::size_t kChildren = 4;
  void Push(Event event) {
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
      std::size_t least = child;
      for (std::size_t i = child + 1; i < std::min(child + kChildren, events_.size()); ++i) least = events_[i] < events_[least] ? i : least;
      if (last <= events_[least]) break;
      events_[place] = events_[least];
      place = least;
    }
    if (!events_.empty()) events_[place] = last;
    return first;
  }

  const std::function<void(std::uint32_t)> on_number_;
  double now_ = 0;
  std::uint64_t planned_ = 0;
  std::vector<Event> events_;
  std::vector<Stream> streams_;
  std::vector<std::function<void()>> actions_;
  std::vector<std::uint32_t> unused_;  // places in actions_
};

}  // namespace slabstream
