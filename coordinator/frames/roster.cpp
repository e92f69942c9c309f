#include "coordinator/frames/roster.h"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "common/wire/digest.h"
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

constexpr std::uint32_t kMostRestored = 4096;  // slots that are kept for workers of an earlier coordinator

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
    return known->id;
  }
  members_.push_back({.id = ++last_id_, .peer = from, .description = message, .last_heard = now});
  SlotFor(message, now).worker = last_id_;
  ++version_;
  return last_id_;
}

// Its former one, else the first vacant one, else one more.
LiveRoster::Slot& LiveRoster::SlotFor(const Register& message, Time now) {
  const std::uint32_t slots = std::min(message.place.slots, kMostRestored);
  if (!first_admitted_) {
    first_admitted_ = now;
    if (slots > 1) awaits_until_ = now + return_wait_;
  }
  // Later, a slot that is missing was given up.
  if (now < *first_admitted_ + vacancy_grace_ && slots_.size() < slots) slots_.resize(slots, Slot{.worker = 0, .vacant_since = now});
  const std::uint32_t former = message.place.slot;
  if (former < std::min<std::size_t>(slots, slots_.size()) && slots_[former].worker == 0) return slots_[former];
  const auto vacant = std::ranges::find(slots_, WorkerId{0}, &Slot::worker);
  return vacant == slots_.end() ? slots_.emplace_back() : *vacant;
}

bool LiveRoster::AwaitsReturn() const {
  return awaits_until_ && std::ranges::any_of(slots_, [](const Slot& slot) { return slot.worker == 0; });
}

LiveRoster::News LiveRoster::Hear(const Heartbeat& message, PeerToken from, Time now) {
  const auto member = std::ranges::find(members_, message.incarnation, IncarnationOf);
  if (member == members_.end()) return {};
  if (member->id != message.worker) return {.stale = true};
  // Counters never fall within one life, so an old heartbeat that arrives late is no progress.
  const bool progressed = message.fetched_bytes > member->fetched_bytes || message.rendered_ranks > member->rendered_ranks;
  const bool moved = std::exchange(member->peer, from) != from;
  member->last_heard = now;
  member->cached_bytes = message.cached_bytes;
  member->fetched_bytes = std::max(member->fetched_bytes, message.fetched_bytes);
  member->rendered_ranks = std::max(member->rendered_ranks, message.rendered_ranks);
  member->web = message.web;
  if (message.leaving && !member->leaving) {
    member->leaving = true;
    Vacate(member->id, now);
  }
  return {.known = true, .moved = moved, .progressed = progressed};
}

void LiveRoster::Touch(WorkerId worker, Time now) {
  for (Member& member : members_) {
    if (member.id == worker) member.last_heard = now;
  }
}

void LiveRoster::Vacate(WorkerId worker, Time now) {
  const auto slot = std::ranges::find(slots_, worker, &Slot::worker);
  if (slot == slots_.end()) return;
  *slot = {.worker = 0, .vacant_since = now};
  ++version_;
}

void LiveRoster::Remove(WorkerId worker, Time now, Loss loss) {
  const auto member = std::ranges::find(members_, worker, &Member::id);
  if (member == members_.end()) return;
  removed_.push_back({worker, member->peer, now});
  while (removed_.size() > kMaxPeers || (removed_.size() > kMaxRemoved && IsLate(removed_.front(), now))) removed_.pop_front();
  members_.erase(member);
  Vacate(worker, now);
  if (!members_.empty()) return;
  empty_since_ = now;
  last_gave_notice_ = loss == Loss::kLeft;
}

std::vector<WorkerId> LiveRoster::Gone(Time now) const {
  std::vector<WorkerId> gone;
  for (const Removed& removed : removed_) {
    if (!IsLate(removed, now)) gone.push_back(removed.worker);
  }
  return gone;
}

void LiveRoster::GiveUpVacancies(Time now) {
  if (awaits_until_ && now >= *awaits_until_) awaits_until_.reset();
  const auto expired = [&](const Slot& slot) { return slot.worker == 0 && now >= slot.vacant_since + vacancy_grace_; };
  if (std::erase_if(slots_, expired) > 0) ++version_;
}

void LiveRoster::Postpone(Duration duration, Time now) {
  for (Member& member : members_) member.last_heard += duration;
  for (Slot& slot : slots_) {
    if (slot.worker == 0) slot.vacant_since += duration;
  }
  if (members_.empty() && duration > kMoment) empty_since_ = now;
  if (awaits_until_) *awaits_until_ += duration;
}

const Member* LiveRoster::Find(WorkerId worker) const {
  const auto member = std::ranges::find(members_, worker, &Member::id);
  return member == members_.end() ? nullptr : &*member;
}

std::optional<PeerToken> LiveRoster::PeerOf(WorkerId worker) const {
  if (const Member* member = Find(worker)) return member->peer;
  const auto removed = std::ranges::find(removed_, worker, &Removed::worker);
  return removed == removed_.end() ? std::nullopt : std::optional(removed->peer);
}

std::vector<WorkerId> LiveRoster::At(PeerToken peer) const {
  return IdsOf(members_, [peer](const Member& member) { return member.peer == peer; });
}

std::vector<WorkerId> LiveRoster::Silent(Time now) const {
  return IdsOf(members_, [&](const Member& member) { return now >= member.last_heard + timeout_; });
}

PictureSenders LiveRoster::SendersOfPictures() const {
  PictureSenders senders;
  std::string text;
  for (const Member& member : members_) {
    const std::string& key = member.description.images_key;
    if (key.empty() || senders.keys.size() == kMaxListed) continue;
    senders.keys.push_back(key);
    text += key;
  }
  senders.version = std::max<std::uint64_t>(1, Digest(std::as_bytes(std::span(text))));
  return senders;
}

std::vector<WorkerId> LiveRoster::Leaving() const {
  return IdsOf(members_, [](const Member& member) { return member.leaving; });
}

std::size_t LiveRoster::staying() const { return std::size_t(std::ranges::count(members_, false, &Member::leaving)); }

SlotPlace LiveRoster::PlaceOf(WorkerId worker) const {
  const auto slot = std::ranges::find(slots_, worker, &Slot::worker);
  if (worker == 0 || slot == slots_.end()) return {};
  return {.slot = std::uint32_t(slot - slots_.begin()), .slots = std::uint32_t(slots_.size())};
}

Roster LiveRoster::slots() const {
  Roster roster;
  for (const Slot& slot : slots_) roster.slots.push_back(slot.worker);
  return roster;
}

Roster LiveRoster::Refill(const Roster& planned) const {
  Roster refilled{.slots = planned.slots, .leaving = Leaving()};
  const auto stays = [&](WorkerId worker) {
    const Member* member = Find(worker);
    return member != nullptr && !member->leaving;
  };
  const auto used = [&](WorkerId worker) { return std::ranges::find(refilled.slots, worker) != refilled.slots.end(); };
  for (WorkerId& worker : refilled.slots) {
    if (!stays(worker)) worker = 0;
  }
  for (std::size_t i = 0; i < std::min(slots_.size(), refilled.slots.size()); ++i) {
    if (refilled.slots[i] == 0 && !used(slots_[i].worker)) refilled.slots[i] = slots_[i].worker;
  }
  for (const Member& member : members_) {
    const auto vacant = std::ranges::find(refilled.slots, WorkerId{0});
    if (vacant != refilled.slots.end() && !member.leaving && !used(member.id)) *vacant = member.id;
  }
  return refilled;
}

Time LiveRoster::NextWake() const {
  Time wake = awaits_until_.value_or(Time::max());
  for (const Member& member : members_) wake = std::min(wake, member.last_heard + timeout_);
  for (const Slot& slot : slots_) {
    if (slot.worker == 0) wake = std::min(wake, slot.vacant_since + vacancy_grace_);
  }
  return wake;
}

}  // namespace slabstream
