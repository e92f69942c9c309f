// Threads: when a thread begins with what it is handed, in virtual time. One that was at work a moment ago is quick; one that sleeps must
// be woken, on a core that may sleep, too, and finds its data out of the caches (WakeUps).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/simulation/machine_model.h"
#include "common/simulation/timeline.h"

namespace slabstream {

class Threads {
 public:
  using Id = std::size_t;
  // The threads: the client's; the coordinator's, and its planner's; each worker's: the one that owns its sockets, and those of its lanes.
  static constexpr Id kClient = 0, kCoordinator = 1, kPlanner = 2;
  static Id Machine(std::uint32_t worker) { return 3 + 4 * Id{worker}; }
  static Id Of(std::uint32_t worker, Lane lane) { return Machine(worker) + 1 + Id(lane); }

  // All have been at work until time 0.
  Threads(const WakeUps& costs, std::uint32_t workers) : costs_(costs), active_until_(Machine(workers)) {}

  // When the thread begins with what it is handed at `now`; it is at work then.
  double Begin(Id thread, double now) {
    const double begin = now + (now - active_until_[thread] < costs_.doze ? costs_.awake : costs_.asleep);
    Active(thread, begin);
    return begin;
  }
  // It is at work until then.
  void Active(Id thread, double until) { active_until_[thread] = until > active_until_[thread] ? until : active_until_[thread]; }

 private:
  const WakeUps costs_;
  std::vector<double> active_until_;
};

}  // namespace slabstream
