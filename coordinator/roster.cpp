#include "coordinator/roster.h"

#include <algorithm>

namespace slabstream {

std::vector<WorkerId> LiveRoster::ReplacedBy(const Register& message, PeerToken from) const {
  std::vector<WorkerId> replaced;
  for (const Member& member : members_) {
    const bool same_place = member.peer == from || member.description.images_endpoint == message.images_endpoint;
    if (same_place && member.description.incarnation != message.incarnation) replaced.push_back(member.id);
  }
  return replaced;
}

WorkerId LiveRoster::Admit(const Register& message, PeerToken from, Time now) {
  const auto known =
      std::find_if(members_.begin(), members_.end(), [&](const Member& m) { return m.description.incarnation == message.incarnation; });
  if (known != members_.end()) {
    known->peer = from;
    known->description = message;
    known->last_heard = now;
    return known->id;
  }
  members_.push_back({.id = ++last_id_, .peer = from, .description = message, .last_heard = now});
  auto slot = std::find_if(slots_.begin(), slots_.end(), [](const Slot& s) { return s.worker == 0; });
  if (slot == slots_.end()) slot = slots_.insert(slot, Slot{});
  slot->worker = last_id_;
  ++version_;
  return last_id_;
}

LiveRoster::News LiveRoster::Hear(const Heartbeat& message, PeerToken from, Time now) {
  const auto member =
      std::find_if(members_.begin(), members_.end(), [&](const Member& m) { return m.description.incarnation == message.incarnation; });
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
}

void LiveRoster::GiveUpVacancies(Time now) {
  const auto expired = [&](const Slot& slot) { return slot.worker == 0 && now >= slot.vacant_since + vacancy_grace_; };
  if (std::erase_if(slots_, expired) > 0) ++version_;
}

void LiveRoster::Postpone(Duration duration) {
  for (Member& member : members_) member.last_heard += duration;
}

const Member* LiveRoster::Find(WorkerId worker) const {
  const auto member = std::find_if(members_.begin(), members_.end(), [worker](const Member& m) { return m.id == worker; });
  return member == members_.end() ? nullptr : &*member;
}

std::vector<WorkerId> LiveRoster::At(PeerToken peer) const {
  std::vector<WorkerId> workers;
  for (const Member& member : members_) {
    if (member.peer == peer) workers.push_back(member.id);
  }
  return workers;
}

std::vector<WorkerId> LiveRoster::Silent(Time now) const {
  std::vector<WorkerId> workers;
  for (const Member& member : members_) {
    if (now >= member.last_heard + timeout_) workers.push_back(member.id);
  }
  return workers;
}

std::uint32_t LiveRoster::SlotOf(WorkerId worker) const {
  const auto slot = std::find_if(slots_.begin(), slots_.end(), [worker](const Slot& s) { return s.worker == worker; });
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
  const auto used = [&](WorkerId worker) {
    return std::find(refilled.slots.begin(), refilled.slots.end(), worker) != refilled.slots.end();
  };
  for (WorkerId& worker : refilled.slots) {
    if (Find(worker) == nullptr) worker = 0;
  }
  for (std::size_t i = 0; i < std::min(slots_.size(), refilled.slots.size()); ++i) {
    if (refilled.slots[i] == 0 && !used(slots_[i].worker)) refilled.slots[i] = slots_[i].worker;
  }
  for (const Member& member : members_) {
    const auto vacant = std::find(refilled.slots.begin(), refilled.slots.end(), WorkerId{0});
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
