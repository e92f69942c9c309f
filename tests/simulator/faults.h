// Faults: what goes wrong in one simulated world, and how often. All of it comes from the seed.
#pragma once

#include "common/base/time.h"
#include "tests/support/random.h"

namespace slabstream {

// So few lost messages must not cost a frame: it is handed out again.
inline constexpr double kRareLoss = 0.002;

struct Faults {
  double lose = 0;  // share of messages
  double duplicate = 0;
  double delay = 0;  // by up to max_delay
  Duration max_delay{};
  bool reorder = false;    // otherwise messages between two ends keep their order
  double fail_render = 0;  // share of renders, chunks, combines
  double damage_chunk = 0;
  double fail_combine = 0;
  double fail_load = 0;  // of datasets
  int worker_kills = 0;
  double silent_kill = 0;   // share of kills that no socket tells of
  double restart = 0;       // share of killed workers that are replaced
  int workers_joining = 0;  // while frames run
  int workers_leaving = 0;  // with notice
  int coordinator_restarts = 0;
  double cancel = 0;  // share of requests
  double vanish = 0;  // share of clients

  bool none() const { return !reorder && lose + duplicate + delay == 0 && failures() == 0; }
  // True if no box of a frame may be rendered twice: at most, workers leave with notice.
  bool gentle() const { return !reorder && lose + duplicate + delay == 0 && failures() == workers_leaving; }
  // True if every frame must be finished, as long as there is a worker.
  bool harmless() const {
    return lose <= kRareLoss && delay + fail_render + damage_chunk + fail_combine + fail_load + coordinator_restarts == 0;
  }
  // Beside messages.
  double failures() const {
    return fail_render + damage_chunk + fail_combine + fail_load + worker_kills + workers_joining + workers_leaving + coordinator_restarts +
           cancel + vanish;
  }
};

// A quarter of the worlds is free of faults; in some, workers leave with notice and nothing else happens; in nearly a quarter only workers
// come and go (which must cost no frame) and messages overtake each other; the others have any mixture.
inline Faults RandomFaults(Random& random) {
  Faults faults;
  const double kind = random.Real(0, 1);
  if (kind < 0.25) return faults;
  const auto one_of = [&](auto... values) {
    const double list[] = {double(values)...};
    return list[random.Integer<std::size_t>(0, sizeof...(values) - 1)];
  };
  if (kind < 0.3) {
    faults.workers_leaving = random.Integer(1, 6);
    faults.restart = one_of(0, 0.5, 1);
    return faults;
  }
  faults.duplicate = one_of(0, 0.02, 0.2);
  faults.reorder = random.Chance(0.5);
  faults.worker_kills = int(one_of(0, 1, 2, 5));
  faults.silent_kill = one_of(0, 0.5, 1);
  faults.restart = one_of(0, 0.5, 1);
  faults.workers_joining = int(one_of(0, 0, 1, 3));
  faults.workers_leaving = int(one_of(0, 0, 1, 3));
  faults.cancel = one_of(0, 0, 0.2);
  faults.vanish = one_of(0, 0, 0.3);
  faults.lose = one_of(0, kRareLoss);
  if (kind < 0.5) return faults;
  faults.lose = one_of(0, kRareLoss, 0.01, 0.04);
  faults.delay = one_of(0, 0, 0.02, 0.1);
  faults.max_delay = std::chrono::milliseconds(random.Integer(5, 3000));
  faults.fail_render = one_of(0, 0, 0, 0.03);
  faults.damage_chunk = one_of(0, 0, 0.05);
  faults.fail_combine = one_of(0, 0, 0, 0.02);
  faults.fail_load = one_of(0, 0, 0, 0.3);
  faults.coordinator_restarts = int(one_of(0, 0, 1, 2));
  return faults;
}

}  // namespace slabstream
