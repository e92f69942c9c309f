// Faults: what goes wrong in one simulated world, and how often. All of it comes from the seed.
#pragma once

#include "common/base/time.h"
#include "tests/support/random.h"

namespace slabstream {

// So few lost messages must not cost a frame: it is handed out again.
inline constexpr double kRareLoss = 0.001;

struct Faults {
  // ---- messages, until the world heals
  double lose = 0;  // share of messages
  double duplicate = 0;
  double delay = 0;  // by up to max_delay
  Duration max_delay{};
  bool reorder = false;  // otherwise messages between two ends keep their order
  int cuts = 0;          // for a while nothing passes from one end to another; the other way nothing changes
  // ---- work
  double fail_render = 0;  // share of renders, chunks, combines
  double damage_chunk = 0;
  double fail_combine = 0;
  double fail_load = 0;  // share of loads of datasets
  double slow = 0;       // share of workers that take `slowness` times as long, until the world heals
  double slowness = 1;
  double without_memory = 0;  // share of workers that have no memory for large frames, until the world heals
  // ---- processes
  int worker_kills = 0;
  int preemptions = 0;      // half of the workers at once
  double silent_kill = 0;   // share of kills that no socket tells of
  double restart = 0;       // share of killed workers that are replaced
  int workers_joining = 0;  // while frames run
  int workers_leaving = 0;  // with notice
  int coordinator_restarts = 0;
  int worker_pauses = 0, coordinator_pauses = 0;
  int suspensions = 0;  // everybody pauses
  int clock_jumps = 0;  // jumps of the coordinator's clock, forward
  double cancel = 0;    // share of requests
  double vanish = 0;    // share of clients
  // ---- stores, of volumes that are read in parts, until the world heals
  double slow_read = 0;   // share of reads that take seconds
  double lost_read = 0;   // share of reads that never end
  double fail_read = 0;   // share of reads that fail; another one may not
  double bad_blocks = 0;  // share of blocks that are damaged, for whoever reads them
  // ---- files
  int file_changes = 0;  // changes of the volume's file
  int data_orders = 0;   // orders of a client that is an admin
  // ---- hostile peers (hostile_peer.h)
  int hostile_clients = 0;
  int strangers = 0;        // have a connection for workers, and are none
  int hostile_workers = 0;  // are workers

  bool none() const { return !reorder && cuts == 0 && lose + duplicate + delay == 0 && failures() == 0; }
  // True if every frame must be finished, as long as there is a worker and the deadline is kept.
  bool harmless() const {
    return lose <= kRareLoss && delay + fail_render + damage_chunk + fail_combine + fail_load + slow + without_memory + reads() +
                                        coordinator_restarts + cuts + hostile_workers ==
                                    0;
  }
  // True if nothing but stores misbehaves.
  bool only_stores() const { return reads() > 0 && reads() == failures() && !reorder && cuts == 0 && lose + duplicate + delay == 0; }
  double reads() const { return slow_read + lost_read + fail_read + bad_blocks; }
  // True if no box of a frame may be rendered twice: at most, workers leave with notice.
  bool gentle() const { return !reorder && cuts == 0 && lose + duplicate + delay == 0 && failures() == workers_leaving; }
  bool only_stops_time() const { return stops() > 0 && stops() == failures() && !reorder && cuts == 0 && lose + duplicate + delay == 0; }
  double stops() const { return worker_pauses + coordinator_pauses + suspensions + clock_jumps; }
  // Beside messages.
  double failures() const {
    return fail_render + damage_chunk + fail_combine + fail_load + slow + without_memory + reads() + worker_kills + preemptions +
           workers_joining + workers_leaving + coordinator_restarts + stops() + cancel + vanish + file_changes + data_orders +
           hostile_clients + strangers + hostile_workers;
  }
};

// Some worlds are free of faults. In some, workers leave with notice and nothing else happens. In others there is only one kind of what
// must cost no frame: workers that come and go and messages that overtake each other; processes and clocks that stop and go on; peers that
// keep to no protocol. In some, only stores misbehave. The others have any mixture.
inline Faults RandomFaults(Random& random) {
  Faults faults;
  const double kind = random.Real(0, 1);
  if (kind < 0.15) return faults;
  const bool mixture = kind >= 0.6;
  const auto one_of = [&](auto... values) {
    const double list[] = {double(values)...};
    return list[random.Integer<std::size_t>(0, sizeof...(values) - 1)];
  };
  if (kind < 0.2) {
    faults.workers_leaving = random.Integer(1, 6);
    faults.restart = one_of(0, 0.5, 1);
    return faults;
  }
  if (kind < 0.25 || mixture) {
    faults.slow_read = one_of(0, 0.02, 0.2);
    faults.lost_read = one_of(0, 0, 0.02);
    faults.fail_read = one_of(0, 0.01, 0.1);
    faults.bad_blocks = one_of(0, 0, 0.01, 0.1);
    if (!mixture) return faults;
  }
  if (kind < 0.35 || mixture) {
    faults.duplicate = one_of(0, 0.02, 0.2);
    faults.reorder = random.Chance(0.5);
    faults.worker_kills = int(one_of(0, 1, 2, 5));
    faults.preemptions = int(one_of(0, 0, 1));
    faults.silent_kill = one_of(0, 0.5, 1);
    faults.restart = one_of(0, 0.5, 1);
    faults.workers_joining = int(one_of(0, 0, 1, 3));
    faults.workers_leaving = int(one_of(0, 0, 1, 3));
    faults.cancel = one_of(0, 0, 0.2);
    faults.vanish = one_of(0, 0, 0.3);
    faults.file_changes = int(one_of(0, 0, 1, 4));
    faults.data_orders = int(one_of(0, 0, 4));
    faults.lose = one_of(0, kRareLoss);
  }
  if ((kind >= 0.35 && kind < 0.48) || mixture) {
    faults.worker_pauses = int(one_of(0, 1, 3));
    faults.coordinator_pauses = int(one_of(0, 0, 1, 2));
    faults.suspensions = int(one_of(0, 0, 1));
    faults.clock_jumps = int(one_of(0, 0, 1, 2));
  }
  if ((kind >= 0.48 && kind < 0.6) || mixture) {
    faults.hostile_clients = int(one_of(0, 1, 2));
    faults.strangers = int(one_of(0, 1, 2));
  }
  if (!mixture) return faults;
  faults.hostile_workers = int(one_of(0, 0, 1, 2));
  faults.lose = one_of(0, kRareLoss, 0.01, 0.04);
  faults.delay = one_of(0, 0, 0.02, 0.1);
  faults.max_delay = std::chrono::milliseconds(random.Integer(5, 3000));
  faults.cuts = int(one_of(0, 0, 1, 2, 4));
  faults.fail_render = one_of(0, 0, 0, 0.03);
  faults.damage_chunk = one_of(0, 0, 0.05);
  faults.fail_combine = one_of(0, 0, 0, 0.02);
  faults.fail_load = one_of(0, 0, 0, 0.3);
  faults.slow = one_of(0, 0, 0.2, 0.5);
  faults.slowness = one_of(10, 100, 1000);
  faults.without_memory = one_of(0, 0, 0.3, 1);
  faults.coordinator_restarts = int(one_of(0, 0, 1, 2));
  return faults;
}

}  // namespace slabstream
