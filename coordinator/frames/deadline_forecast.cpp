#include "coordinator/frames/deadline_forecast.h"

#include <algorithm>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::int64_t kLateCosts = 4;  // times what was measured

// When a frame of this cost is ready that shares the service with the `others`, if none begins later.
template <class Costs>
Duration TimeAmong(Duration cost, const Costs& others) {
  Duration time = cost;
  for (const auto& other : others) time += std::min(cost, other.cost);
  return time;
}

}  // namespace

Duration DeadlineForecast::Shared(Time now) const {
  return clients_.empty() ? shared_ : shared_ + (now - counted_) / std::int64_t(clients_.size());
}

void DeadlineForecast::Count(Time now) {
  shared_ = Shared(now);
  counted_ = now;
}

void DeadlineForecast::Begin(FrameId id, const Frame& frame, Time now) {
  Count(now);
  ++clients_[frame.client];
  running_[id] = {frame, shared_};
}

void DeadlineForecast::End(FrameId id, Ended how, Time now) {
  const auto found = running_.find(id);
  CHECK(found != running_.end()) << "frame " << id;
  Count(now);
  const auto& [frame, begun] = found->second;
  Duration& free_since = idle_since_[frame.client];
  const Duration cost = shared_ - std::max(begun, free_since);
  if (how != Ended::kGivenUp && costs_.size() >= kMostKinds && !costs_.contains(frame.kind)) costs_.clear();
  if (how == Ended::kDone) {
    Costs& costs = costs_[frame.kind];
    costs = {.latest = cost, .before = costs.latest, .least = std::min(cost, costs.latest)};
  } else if (how == Ended::kLate) {
    const Duration guess = std::max(Expected(frame.kind), kLateCosts * cost);
    costs_[frame.kind] = {.latest = guess, .before = guess, .least = std::max(Least(frame.kind), cost)};
  }
  free_since = shared_;
  if (--clients_[frame.client] == 0) {
    clients_.erase(frame.client);
    idle_since_.erase(frame.client);
  }
  running_.erase(found);
}

Duration DeadlineForecast::Expected(FrameKind kind) const {
  const auto known = costs_.find(kind);
  return known == costs_.end() ? Duration::zero() : std::min(known->second.latest, known->second.before);
}

Duration DeadlineForecast::Least(FrameKind kind) const {
  const auto known = costs_.find(kind);
  return known == costs_.end() ? Duration::zero() : known->second.least;
}

std::vector<DeadlineForecast::Remaining> DeadlineForecast::Remainders(Time now, CostOf cost) const {
  const Duration shared = Shared(now);
  std::vector<Remaining> all;
  all.reserve(running_.size());
  for (const auto& [id, running] : running_) {
    const auto idle = idle_since_.find(running.frame.client);
    const Duration begun = idle == idle_since_.end() ? running.begun : std::max(running.begun, idle->second);
    all.push_back({&running.frame, std::max((this->*cost)(running.frame.kind) - (shared - begun), Duration::zero())});
  }
  return all;
}

Duration DeadlineForecast::Left(Time now) const {
  Duration left{};
  for (const Remaining& each : Remainders(now, &DeadlineForecast::Least)) left += each.cost;
  return left;
}

bool DeadlineForecast::MayBegin(const Frame& frame, Time now) const {
  const Duration cost = Expected(frame.kind);
  const bool alone = std::ranges::all_of(clients_, [&](const auto& each) { return each.first == frame.client; });
  if (alone || cost == Duration::zero()) return true;
  const std::vector<Remaining> running = Remainders(now, &DeadlineForecast::Expected);
  if (now + TimeAmong(cost, running) > frame.deadline) return false;
  return std::ranges::none_of(running, [&](const Remaining& each) {
    if (each.frame->client == frame.client || each.frame->used > frame.used) return false;
    const Duration without = TimeAmong(each.cost, running) - each.cost;  // it is one of them
    return now + without <= each.frame->deadline && now + without + std::min(cost, each.cost) > each.frame->deadline;
  });
}

}  // namespace slabstream
