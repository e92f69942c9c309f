#include "common/combining/named_schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <mutex>
#include <utility>

#include "common/base/check.h"
#include "common/base/lru_map.h"
#include "common/combining/schemes.h"

namespace slabstream {
namespace {

// The last schedules that were derived.
class RecentSchedules {
 public:
  SharedSchedule Find(const ScheduleName& name, PixelRange frame) {
    const std::lock_guard lock(mutex_);
    const SharedSchedule* const found = schedules_.Find({name, frame});
    return found == nullptr ? nullptr : *found;
  }

  void Keep(const ScheduleName& name, PixelRange frame, const SharedSchedule& schedule) {
    // Of a few steps it weighs as much as if these were more, so that there are at most so many.
    constexpr std::size_t kMostKept = 64;
    const std::lock_guard lock(mutex_);
    schedules_.Put({name, frame}, schedule, std::max<std::size_t>(schedule->steps().size(), kMaxSteps / kMostKept));
    schedules_.DropBeyond(kMaxSteps);
  }

 private:
  struct Key {
    ScheduleName name;
    PixelRange frame;
    friend bool operator==(const Key&, const Key&) = default;
  };
  std::mutex mutex_;
  LruMap<Key, SharedSchedule> schedules_;
};

// Before the scheme, each run is combined from the front at its first rank.
Schedule ScheduleOf(const ScheduleName& name, PixelRange frame) {
  const CombiningChoice scheme = ParseCombining(name.scheme).value();
  if (name.runs.empty()) return scheme.Make(name.ranks, name.roots, frame);
  const ScheduleName among = AmongRuns(name);
  Schedule whole = {name.ranks, name.roots, {}};
  std::uint32_t rounds = 0;
  for (std::size_t run = 0; run < name.runs.size(); ++run) {
    const Rank first = name.runs[run], end = EndOfRun(name, run);
    for (Rank rank = first + 1; rank < end; ++rank) whole.steps.push_back({rank - first - 1, rank, first, frame});
    rounds = std::max(rounds, end - first - 1);
  }
  for (const Step& step : scheme.Make(among.ranks, among.roots, frame, kMaxSteps - (name.ranks - among.ranks)).steps) {
    whole.steps.push_back({rounds + step.round, name.runs[step.from], name.runs[step.to], step.pixels});
  }
  std::ranges::stable_sort(whole.steps, {}, &Step::round);
  return whole;
}

Status CheckRuns(const ScheduleName& name) {
  if (name.runs.empty()) return Status::Ok();
  const bool ascend = std::ranges::adjacent_find(name.runs, std::greater_equal<>()) == name.runs.end();
  if (name.runs.front() != 0 || !ascend || name.runs.back() >= name.ranks) {
    return Status::InvalidArgument(fmt::format("schedule.runs must ascend from 0 and stay below {}", name.ranks));
  }
  for (const Rank root : name.roots) {
    if (!std::ranges::binary_search(name.runs, root)) {
      return Status::InvalidArgument(fmt::format("schedule.roots has {}, but must be the first ranks of runs", root));
    }
  }
  return Status::Ok();
}

}  // namespace

ScheduleName AmongRuns(const ScheduleName& name) {
  if (name.runs.empty()) return name;
  ScheduleName among = {name.scheme, Rank(name.runs.size()), {}, {}};
  for (const Rank root : name.roots) among.roots.push_back(Rank(std::ranges::lower_bound(name.runs, root) - name.runs.begin()));
  return among;
}

IndexedSchedule::IndexedSchedule(Schedule schedule) : schedule_(std::move(schedule)), first_of_rank_(schedule_.ranks + 1) {
  for (const Step& step : schedule_.steps) {
    CHECK(step.from < schedule_.ranks && step.to < schedule_.ranks && step.from != step.to) << "from " << step.from << " to " << step.to;
    ++first_of_rank_[step.from + 1];
    ++first_of_rank_[step.to + 1];
  }
  for (Rank rank = 0; rank < schedule_.ranks; ++rank) first_of_rank_[rank + 1] += first_of_rank_[rank];
  by_rank_.resize(first_of_rank_.back());
  std::vector<std::uint32_t> count(schedule_.ranks);
  const auto add = [&](Rank rank, std::uint32_t step) {
    by_rank_[first_of_rank_[rank] + count[rank]] = step;
    return count[rank]++;
  };
  places_.reserve(schedule_.steps.size());
  for (std::uint32_t i = 0; i < schedule_.steps.size(); ++i) {
    const Step& step = schedule_.steps[i];
    places_.push_back({.sender = add(step.from, i), .receiver = add(step.to, i)});
  }
}

Status CheckScheduleName(const ScheduleName& name) {
  if (name.ranks > kMaxRanks) {
    return Status::InvalidArgument(fmt::format("schedule.ranks is {}, but at most {} are allowed", name.ranks, kMaxRanks));
  }
  if (name.roots.empty() || name.roots.size() > kMaxShares) {
    return Status::InvalidArgument(fmt::format("schedule.roots are {}, but must be from 1 to {}", name.roots.size(), kMaxShares));
  }
  for (const Rank root : name.roots) {
    if (root < std::max<Rank>(name.ranks, 1)) continue;
    return Status::InvalidArgument(fmt::format("schedule.roots has {}, but must be below {}", root, std::max<Rank>(name.ranks, 1)));
  }
  if (name.roots.size() > 1 && name.roots.size() * name.ranks > kMaxSteps) {
    return Status::InvalidArgument(fmt::format("schedule.roots are {}, but at most {} are allowed for {} ranks", name.roots.size(),
                                               kMaxSteps / name.ranks, name.ranks));
  }
  if (Status status = CheckRuns(name); !status.ok()) return status;
  if (name.ranks == 0) return Status::Ok();
  const Result<CombiningChoice> scheme = ParseCombining(name.scheme);
  return scheme.ok() ? Status::Ok() : Status::InvalidArgument(fmt::format("schedule.scheme: {}", scheme.status().message()));
}

Result<SharedSchedule> DeriveSchedule(const ScheduleName& name, PixelRange frame) {
  static RecentSchedules recent;
  if (Status status = CheckScheduleName(name); !status.ok()) return status;
  if (name.ranks == 0) return std::make_shared<const IndexedSchedule>(Schedule{.ranks = 0, .roots = {0}, .steps = {}});
  if (SharedSchedule known = recent.Find(name, frame)) return known;
  auto schedule = std::make_shared<const IndexedSchedule>(ScheduleOf(name, frame));
  recent.Keep(name, frame, schedule);
  return SharedSchedule(std::move(schedule));
}

}  // namespace slabstream
