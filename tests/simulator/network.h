// FaultyNetwork: moves messages between the ends of a simulated world, and loses, delays, duplicates and reorders them.
#pragma once

#include <functional>
#include <map>
#include <utility>

#include "simulator/event_queue.h"
#include "tests/simulator/faults.h"

namespace slabstream {

class FaultyNetwork {
 public:
  using Link = std::pair<int, int>;  // from, to: any numbers that name ends

  FaultyNetwork(EventQueue<Time>& queue, Random& random, const Faults& faults, Duration latency)
      : queue_(queue), random_(random), faults_(faults), latency_(latency) {}

  // Calls `deliver` never, once or twice, later.
  void Send(const Link& link, const std::function<void()>& deliver) {
    if (!calm_ && random_.Chance(faults_.lose)) return;
    const int copies = !calm_ && random_.Chance(faults_.duplicate) ? 2 : 1;
    for (int i = 0; i < copies; ++i) queue_.At(Arrival(link), deliver);
  }

  void CalmDown() { calm_ = true; }  // no more faults

 private:
  Time Arrival(const Link& link) {
    Duration delay = latency_ + Duration(random_.Integer<std::int64_t>(0, latency_.count()));
    if (!calm_ && random_.Chance(faults_.delay)) delay += Duration(random_.Integer<std::int64_t>(0, faults_.max_delay.count()));
    Time arrival = queue_.now() + delay;
    if (faults_.reorder) return arrival;
    Time& last = last_arrival_[link];
    last = std::max(last, arrival);
    return last;
  }

  EventQueue<Time>& queue_;
  Random& random_;
  const Faults& faults_;
  const Duration latency_;
  std::map<Link, Time> last_arrival_;
  bool calm_ = false;
};

}  // namespace slabstream
