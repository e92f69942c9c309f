// Threads: when a thread begins with what it is handed, in virtual time. One that was at work a moment ago is quick; one that sleeps must
// be woken, on a core that may sleep, too, and finds its data out of the caches (WakeUps).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "simulator/model/machine_model.h"
#include "simulator/model/timeline.h"

namespace slabstream {

class Threads {
 public:
  using Id = std::size_t;
  // The threads: the client's; the coordinator's, and its planner's; each worker's: the one that owns its sockets, and those of its lanes.
  static constexpr Id kClient = 0, kCoordinator = 1, kPlanner = 2;
  static Id Machine(std::uint32_t worker) { return 3 + 4 * Id{worker}; }
  static Id Of(std::uint32_t worker, Lane lane) { return Machine(worker) + 1 + Id(lane); }

  explicit Threads(const WakeUps& costs) : costs_(costs), active_until_(Machine(0)), woken_(Machine(0)) {}
  void AddWorker() {
    active_until_.resize(active_until_.size() + 4);
    woken_.resize(active_until_.size());
  }

  // When the thread begins with what it is handed at `now`; it is at work then.
  double Begin(Id thread, double now) {
    Waking& woken = woken_[thread];
    const bool asleep = now - active_until_[thread] >= costs_.doze;
    double begin = now + (asleep ? costs_.asleep : costs_.awake);
    if (asleep) {
      woken = {now, begin};
    } else if (now >= woken.from && now < woken.until) {
      begin = std::max(begin, woken.until);  // what comes while it is woken does not overtake what woke it
    }
    Active(thread, begin);
    return begin;
  }
  // It is at work until then.
  void Active(Id thread, double until) { active_until_[thread] = until > active_until_[thread] ? until : active_until_[thread]; }
  void AllActive(double until) {
    for (Id thread = 0; thread < active_until_.size(); ++thread) Active(thread, until);
  }

 private:
  const WakeUps costs_;
  std::vector<double> active_until_;
  struct Waking {
    double from = 0, until = 0;
  };
  std::vector<Waking> woken_;  // when each thread was last woken
};

}  // namespace slabstream
