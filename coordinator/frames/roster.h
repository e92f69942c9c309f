// LiveRoster: the present workers, the slot that each one owns, and when each was last heard. Pure: time is an argument.
//
// A worker is an incarnation (one registration of one process: what it held before is gone). It keeps its id while it stays, on whatever
// connection it speaks; a new incarnation is a new worker. Slots outlive workers: the slot of a lost worker stays vacant for a grace
// period, so that a replacement takes over its boxes and nobody else's voxels move; then it is given up, and the slots after it move down.
// A worker that had a slot before, of an earlier coordinator too, gets the same one if it is vacant. So the first worker of an earlier
// coordinator brings the number of slots with it, and for return_wait the others are awaited.
// A worker that is leaving has no slot, but is a member until it is removed.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/base/time.h"
#include "common/base/web_traffic.h"
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
  bool leaving = false;
  std::vector<WebTraffic> web = {};  // as it said last
};

class LiveRoster {
 public:
  LiveRoster(Duration worker_timeout, Duration vacancy_grace, Duration return_wait)
      : timeout_(worker_timeout), vacancy_grace_(vacancy_grace), return_wait_(return_wait) {}

  // Members that this Register proves dead: same connection or same image endpoint, other incarnation. Remove them before Admit, so that
  // the new worker gets their slot.
  std::vector<WorkerId> ReplacedBy(const Register& message, PeerToken from) const;
  // Adds a worker, or finds the one that it is already: Registers repeat until the Welcome arrives. They are no sign of life: a worker that
  // hears nothing from here could repeat them for ever.
  WorkerId Admit(const Register& message, PeerToken from, Time now);

  struct News {
    bool known = false;
    bool stale = false;       // not known, but its incarnation is a member under another id: an old message, no reason to retire anybody
    bool moved = false;       // it speaks on another connection than before: what was under way on that one may be lost
    bool progressed = false;  // it has received voxels or rendered ranks since its last heartbeat
  };
  News Hear(const Heartbeat& message, PeerToken from, Time now);
  void Touch(WorkerId worker, Time now);  // any other message of a member; unknown ids are ignored

  enum class Loss { kLeft, kSilent, kGone };  // it said so; it is heard no more; its connection ended, as when a process dies
  void Remove(WorkerId worker, Time now, Loss loss = Loss::kSilent);  // its slot becomes vacant
  // Drops slots that have been vacant for the grace period, and waits no longer than return_wait.
  void GiveUpVacancies(Time now);
  // The listener itself was asleep until now: silences and vacancies begin later by as much. After more than a moment the wait for a first
  // worker begins anew.
  void Postpone(Duration duration, Time now);

  const Member* Find(WorkerId worker) const;               // null: not a member
  std::optional<PeerToken> PeerOf(WorkerId worker) const;  // the connection of a member, or of one of the last that were removed
  std::vector<WorkerId> At(PeerToken peer) const;
  std::vector<WorkerId> Silent(Time now) const;  // not heard for the timeout
  // Removed within the last two timeouts, at most kMaxPeers of them: whoever has not heard of it by then registers anew.
  std::vector<WorkerId> Gone(Time now) const;
  const std::vector<Member>& members() const { return members_; }
  PictureSenders SendersOfPictures() const;  // all members with keys
  std::vector<WorkerId> Leaving() const;
  std::size_t staying() const;  // members that are not leaving
  bool empty() const { return members_.empty(); }
  Time empty_since() const { return empty_since_; }            // from then on one may come; Time::min(): there never was a worker
  bool last_gave_notice() const { return last_gave_notice_; }  // the one since whose removal it is empty
  SlotPlace PlaceOf(WorkerId worker) const;                    // a member's slot

  Roster slots() const;                               // 0 where a slot is vacant
  std::uint64_t version() const { return version_; }  // changes whenever slots() does
  // Workers of an earlier coordinator are expected: a frame that began now would move voxels that they hold.
  bool AwaitsReturn() const;

  // Fills the slots of an earlier plan: workers that stay keep theirs; the others' go to workers without a slot in it, the present owner
  // of the same slot first. The rest are vacant. Names the workers that are leaving, too.
  Roster Refill(const Roster& planned) const;

  Time NextWake() const;  // the next silence or end of a grace period; Time::max(): none

 private:
  static constexpr std::size_t kMaxRemoved = 64;
  static constexpr Duration kMoment = std::chrono::seconds(1);  // workers that are not registered speak as often
  struct Slot {
    WorkerId worker = 0;
    Time vacant_since;
  };
  struct Removed {
    WorkerId worker = 0;
    PeerToken peer = 0;
    Time at;
  };
  // Whoever has not heard of it by now registers anew.
  bool IsLate(const Removed& removed, Time now) const { return now >= removed.at + 2 * timeout_; }
  void Vacate(WorkerId worker, Time now);
  Slot& SlotFor(const Register& message, Time now);

  Duration timeout_, vacancy_grace_, return_wait_;
  std::vector<Member> members_;  // by ascending id
  std::vector<Slot> slots_;
  std::deque<Removed> removed_;  // lately, and at least the last kMaxRemoved
  WorkerId last_id_ = 0;
  std::uint64_t version_ = 0;
  Time empty_since_ = Time::min();
  bool last_gave_notice_ = false;
  std::optional<Time> first_admitted_;
  std::optional<Time> awaits_until_;
};

}  // namespace slabstream
