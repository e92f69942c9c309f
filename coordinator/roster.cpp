#include "coordinator/roster.h"

#include <algorithm>

#include "common/wire/limits.h"

namespace slabstream {
namespace {

template <class Predicate>
std::vector<WorkerId> IdsOf(const std::vector<Member>& members, Predicate&& wanted) {
  std::vector<WorkerId> ids;
  for (const Member& member : members) {
    if (wanted(member)) ids.push_back(member.id);
  }
  return ids;
}

Incarnation IncarnationOf(const Member& member) { return member.description.incarnation; }

}  // namespace

std::vector<WorkerId> LiveRoster::ReplacedBy(const Register& message, PeerToken from) const {
  return IdsOf(members_, [&](const Member& member) {
    const bool same_place = member.peer == from || member.description.images_endpoint == message.images_endpoint;
    return same_place && IncarnationOf(member) != message.incarnation;
  });
}

WorkerId LiveRoster::Admit(const Register& message, PeerToken from, Time now) {
  const auto known = std::ranges::find(members_, message.incarnation, IncarnationOf);
  if (known != members_.end()) {
    known->peer = from;
    known->description = message;
    known->last_heard = now;
    return known->id;
  }
  members_.push_back({.id = ++last_id_, .peer = from, .description = message, .last_heard = now});
  auto slot = std::ranges::find(slots_, WorkerId{0}, &Slot::worker);
  if (slot == slots_.end()) slot = slots_.insert(slot, Slot{});
  slot->worker = last_id_;
  ++version_;
  return last_id_;
}

LiveRoster::News LiveRoster::Hear(const Heartbeat& message, PeerToken from, Time now) {
  const auto member = std::ranges::find(members_, message.incarnation, IncarnationOf);
  if (member == members_.end()) return {};
  if (member->id != message.worker) return {.stale = true};
  // Counters never fall within one life, so an old heartbeat that arrives late is no progress.
  const bool progressed = message.fetched_bytes > member->fetched_bytes || message.rendered_ranks > member->rendered_ranks;
  member->peer = from;
  member->last_heard = now;
  member->cached_bytes = message.cached_bytes;
  member->fetched_bytes = std::max(member->fetched_bytes, message.fetched_bytes);
  member->rendered_ranks = std::max(member->rendered_ranks, message.rendered_ranks);
  return {.known = true, .progressed = progressed};
}

void LiveRoster::Touch(WorkerId worker, Time now) {
  for (Member& member : members_) {
    if (member.id == worker) member.last_heard = now;
  }
}

void LiveRoster::Remove(WorkerId worker, Time now) {
  if (std::erase_if(members_, [worker](const Member& m) { return m.id == worker; }) == 0) return;
  ++version_;
  for (Slot& slot : slots_) {
    if (slot.worker == worker) slot = {.worker = 0, .vacant_since = now};
  }
  if (members_.empty()) empty_since_ = now;
  std::erase_if(removed_, [&](const Removed& removed) { return IsLate(removed, now); });
  if (removed_.size() == kMaxPeers) removed_.erase(removed_.begin());
  removed_.push_back({worker, now});
}

std::vector<WorkerId> LiveRoster::Gone(Time now) const {
  std::vector<WorkerId> gone;
  for (const Removed& removed : removed_) {
    if (!IsLate(removed, now)) gone.push_back(removed.worker);
  }
  return gone;
}

void LiveRoster::GiveUpVacancies(Time now) {
  const auto expired = [&](const Slot& slot) { return slot.worker == 0 && now >= slot.vacant_since + vacancy_grace_; };
  if (std::erase_if(slots_, expired) > 0) ++version_;
}

void LiveRoster::Postpone(Duration duration) {
  for (Member& member : members_) member.last_heard += duration;
}

const Member* LiveRoster::Find(WorkerId worker) const {
  const auto member = std::ranges::find(members_, worker, &Member::id);
  return member == members_.end() ? nullptr : &*member;
}

std::vector<WorkerId> LiveRoster::At(PeerToken peer) const {
  return IdsOf(members_, [peer](const Member& member) { return member.peer == peer; });
}

std::vector<WorkerId> LiveRoster::Silent(Time now) const {
  return IdsOf(members_, [&](const Member& member) { return now >= member.last_heard + timeout_; });
}

std::uint32_t LiveRoster::SlotOf(WorkerId worker) const {
  const auto slot = std::ranges::find(slots_, worker, &Slot::worker);
  CHECK(worker != 0 && slot != slots_.end()) << "worker " << worker << " has no slot";
  return std::uint32_t(slot - slots_.begin());
}

Roster LiveRoster::slots() const {
  Roster roster;
  for (const Slot& slot : slots_) roster.slots.push_back(slot.worker);
  return roster;
}

Roster LiveRoster::Refill(const Roster& planned) const {
  Roster refilled = planned;
  const auto used = [&](WorkerId worker) { return std::ranges::find(refilled.slots, worker) != refilled.slots.end(); };
  for (WorkerId& worker : refilled.slots) {
    if (Find(worker) == nullptr) worker = 0;
  }
  for (std::size_t i = 0; i < std::min(slots_.size(), refilled.slots.size()); ++i) {
    if (refilled.slots[i] == 0 && !used(slots_[i].worker)) refilled.slots[i] = slots_[i].worker;
  }
  for (const Member& member : members_) {
    const auto vacant = std::ranges::find(refilled.slots, WorkerId{0});
    if (vacant != refilled.slots.end() && !used(member.id)) *vacant = member.id;
  }
  return refilled;
}

Time LiveRoster::NextWake() const {
  Time wake = Time::max();
  for (const Member& member : members_) wake = std::min(wake, member.last_heard + timeout_);
  for (const Slot& slot : slots_) {
    if (slot.worker == 0) wake = std::min(wake, slot.vacant_since + vacancy_grace_);
  }
  return wake;
}

}  // namespace slabstream
