// FaultyNetwork: when messages between the ends of a simulated world arrive. It loses, delays, duplicates and reorders them. A link may be
// cut for a while, in one direction: its messages are lost, or held back until the link is there again.
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <utility>

#include "simulator/conditions.h"
#include "tests/simulator/faults.h"
#include "tests/simulator/tally.h"

namespace slabstream {

class FaultyNetwork {
 public:
  using Link = std::pair<int, int>;  // from, to: any numbers that name ends

  FaultyNetwork(Random& random, const Faults& faults, Duration latency, Tally& tally)
      : random_(random), faults_(faults), latency_(latency), tally_(tally) {}

  // When a message that leaves now arrives.
  Arrivals Send(const Link& link, double now) {
    Arrivals arrivals;
    if (!calm_ && random_.Chance(faults_.lose)) {
      tally_.Add(Count::kLostMessages);
      return arrivals;
    }
    const auto cut = cuts_.find(link);
    const bool is_cut = !calm_ && cut != cuts_.end() && now < cut->second.until;
    if (is_cut) tally_.Add(cut->second.loses ? Count::kMessagesLostByCuts : Count::kMessagesHeldByCuts);
    if (is_cut && cut->second.loses) return arrivals;
    arrivals.count = !calm_ && random_.Chance(faults_.duplicate) ? 2 : 1;
    if (arrivals.count == 2) tally_.Add(Count::kDoubledMessages);
    for (int i = 0; i < arrivals.count; ++i) arrivals.times[i] = Arrival(link, is_cut ? cut->second.until : now);
    return arrivals;
  }

  void Cut(const Link& link, double until, bool loses) { cuts_[link] = {until, loses}; }
  void CalmDown() { calm_ = true; }  // no more faults

 private:
  struct Gap {
    double until = 0;
    bool loses = false;
  };

  double Arrival(const Link& link, double leaves) {
    Duration delay = latency_ + Duration(random_.Integer<std::int64_t>(0, latency_.count()));
    if (!calm_ && random_.Chance(faults_.delay)) {
      delay += Duration(random_.Integer<std::int64_t>(0, faults_.max_delay.count()));
      tally_.Add(Count::kDelayedMessages);
    }
    const double arrival = leaves + std::chrono::duration<double>(delay).count();
    if (faults_.reorder) return arrival;
    double& last = last_arrival_[link];
    last = std::max(last, arrival);
    return last;
  }

  Random& random_;
  const Faults& faults_;
  const Duration latency_;
  Tally& tally_;
  std::map<Link, double> last_arrival_;
  std::map<Link, Gap> cuts_;
  bool calm_ = false;
};

}  // namespace slabstream
