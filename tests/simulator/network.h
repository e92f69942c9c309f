// FaultyNetwork: when messages between the ends of a simulated world arrive. It loses, delays, duplicates and reorders them.
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <utility>

#include "simulator/conditions.h"
#include "tests/simulator/faults.h"

namespace slabstream {

class FaultyNetwork {
 public:
  using Link = std::pair<int, int>;  // from, to: any numbers that name ends

  FaultyNetwork(Random& random, const Faults& faults, Duration latency) : random_(random), faults_(faults), latency_(latency) {}

  // Of a message that leaves now.
  Arrivals Send(const Link& link, double now) {
    Arrivals arrivals;
    if (!calm_ && random_.Chance(faults_.lose)) return arrivals;
    arrivals.count = !calm_ && random_.Chance(faults_.duplicate) ? 2 : 1;
    for (int i = 0; i < arrivals.count; ++i) arrivals.times[i] = Arrival(link, now);
    return arrivals;
  }

  void CalmDown() { calm_ = true; }  // no more faults

 private:
  double Arrival(const Link& link, double now) {
    Duration delay = latency_ + Duration(random_.Integer<std::int64_t>(0, latency_.count()));
    if (!calm_ && random_.Chance(faults_.delay)) delay += Duration(random_.Integer<std::int64_t>(0, faults_.max_delay.count()));
    const double arrival = now + std::chrono::duration<double>(delay).count();
    if (faults_.reorder) return arrival;
    double& last = last_arrival_[link];
    last = std::max(last, arrival);
    return last;
  }

  Random& random_;
  const Faults& faults_;
  const Duration latency_;
  std::map<Link, double> last_arrival_;
  bool calm_ = false;
};

}  // namespace slabstream
