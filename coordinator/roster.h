// LiveRoster: the present workers, the slot that each one owns, and when each was last heard. Pure: time is an argument.
//
// A worker is an incarnation (one registration of one process: what it held before is gone). It keeps its id while it stays, on whatever
// connection it speaks; a new incarnation is a new worker. Slots outlive workers: the slot of a lost worker stays vacant for a grace
// period, so that a replacement takes over its boxes and nobody else's voxels move; then it is given up, and the slots after it move down.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/planning/frame_plan.h"
#include "common/wire/control_messages.h"
#include "coordinator/peer_token.h"

namespace slabstream {

struct Member {
  WorkerId id = 0;
  PeerToken peer = 0;    // the connection that it spoke on last
  Register description;  // as it registered
  Time last_heard;
  std::uint64_t cached_bytes = 0, fetched_bytes = 0;
  std::uint32_t rendered_ranks = 0;
};

class LiveRoster {
 public:
  LiveRoster(Duration worker_timeout, Duration vacancy_grace) : timeout_(worker_timeout), vacancy_grace_(vacancy_grace) {}

  // Members that this Register proves dead: same connection or same image endpoint, other incarnation. Remove them before Admit, so that
  // the new worker gets their slot.
  std::vector<WorkerId> ReplacedBy(const Register& message, PeerToken from) const;
  // Adds a worker, or finds the one that it is already: Registers repeat until the Welcome arrives.
  WorkerId Admit(const Register& message, PeerToken from, Time now);

  struct News {
    bool known = false;
    bool stale = false;       // not known, but its incarnation is a member under another id: an old message, no reason to retire anybody
    bool progressed = false;  // it has received voxels or rendered ranks since its last heartbeat
  };
  News Hear(const Heartbeat& message, PeerToken from, Time now);
  void Touch(WorkerId worker, Time now);  // any other message of a member; unknown ids are ignored

  void Remove(WorkerId worker, Time now);  // its slot becomes vacant
  void GiveUpVacancies(Time now);          // drops slots that have been vacant for the grace period
  void Postpone(Duration duration);        // all silences begin later, since the listener itself was asleep

  const Member* Find(WorkerId worker) const;  // null: not a member
  std::vector<WorkerId> At(PeerToken peer) const;
  std::vector<WorkerId> Silent(Time now) const;  // not heard for the timeout
  // Removed within the last two timeouts, at most kMaxPeers of them: whoever has not heard of it by then registers anew.
  std::vector<WorkerId> Gone(Time now) const;
  const std::vector<Member>& members() const { return members_; }
  bool empty() const { return members_.empty(); }
  Time empty_since() const { return empty_since_; }  // Time::min(): there never was a worker
  std::uint32_t SlotOf(WorkerId worker) const;       // of a member

  Roster slots() const;                               // 0 where a slot is vacant
  std::uint64_t version() const { return version_; }  // changes whenever slots() does
  // Fills the slots of an earlier plan: workers that are still here keep theirs; the others' go to workers without a slot in it, the
  // present owner of the same slot first. The rest are vacant.
  Roster Refill(const Roster& planned) const;

  Time NextWake() const;  // the next silence or end of a grace period; Time::max(): none

 private:
  struct Slot {
    WorkerId worker = 0;
    Time vacant_since;
  };
  Duration timeout_, vacancy_grace_;
  std::vector<Member> members_;  // by ascending id
  struct Removed {
    WorkerId worker = 0;
    Time at;
  };
  bool IsLate(const Removed& removed, Time now) const { return now >= removed.at + 2 * timeout_; }

  std::vector<Slot> slots_;
  std::vector<Removed> removed_;  // lately
  WorkerId last_id_ = 0;
  std::uint64_t version_ = 0;
  Time empty_since_ = Time::min();
};

}  // namespace slabstream
