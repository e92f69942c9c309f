// CheckSchedule: runs a schedule on intervals of ranks instead of images and says what is wrong with it.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/combining/schedule_runner.h"

namespace slabstream {

// Pixels that a rank sends or receives in the current round: these must be disjoint, since the steps of a round have no order.
class RoundUse {
 public:
  explicit RoundUse(Rank ranks) : used_(ranks) {}

  bool Use(std::uint32_t round, Rank rank, PixelRange pixels) {
    PerRank& use = used_[rank];
    if (use.round != round) use = {round, {}};
    const auto after = use.ranges.lower_bound(pixels.begin);
    if (after != use.ranges.end() && after->first < pixels.end) return false;
    if (after != use.ranges.begin() && std::prev(after)->second > pixels.begin) return false;
    use.ranges[pixels.begin] = pixels.end;
    return true;
  }

 private:
  struct PerRank {
    std::optional<std::uint32_t> round;
    std::map<std::uint64_t, std::uint64_t> ranges;  // begin -> end
  };
  std::vector<PerRank> used_;
};

inline Status Wrong(std::size_t step, const std::string& message) {
  return Status::InvalidArgument(fmt::format("schedule.steps[{}]: {}", step, message));
}

// Checks that ranks are in range, rounds ascend, no rank touches pixels twice in a round, only adjacent intervals meet, nobody sends what
// it does not hold, and the roots end with [0, ranks) of every pixel of their shares of `pixels`, and nobody with any other.
// InvalidArgument otherwise.
inline Status CheckSchedule(const Schedule& schedule, PixelRange pixels) {
  if (schedule.ranks == 0) {
    return schedule.steps.empty() ? Status::Ok() : Status::InvalidArgument("schedule.steps is not empty, but there are no ranks");
  }
  if (schedule.ranks > kMaxRanks)
    return Status::InvalidArgument(fmt::format("schedule.ranks is {}, but at most {} are allowed", schedule.ranks, kMaxRanks));
  for (const Rank root : schedule.roots) {
    if (root >= schedule.ranks) {
      return Status::InvalidArgument(fmt::format("schedule.roots has {}, but must be below {}", root, schedule.ranks));
    }
  }
  if (pixels.begin >= pixels.end) return Status::InvalidArgument("schedule: the frame has no pixels");

  RoundUse round_use(schedule.ranks);

  for (std::size_t i = 0; i < schedule.steps.size(); ++i) {
    const Step& step = schedule.steps[i];
    if (step.from >= schedule.ranks || step.to >= schedule.ranks || step.from == step.to) {
      return Wrong(i,
                   fmt::format("goes from rank {} to {}, but must join two different ranks below {}", step.from, step.to, schedule.ranks));
    }
    if (i > 0 && step.round < schedule.steps[i - 1].round) {
      return Wrong(i, fmt::format("is of round {}, but follows round {}", step.round, schedule.steps[i - 1].round));
    }
    if (step.pixels.begin >= step.pixels.end || step.pixels.begin < pixels.begin || step.pixels.end > pixels.end) {
      return Wrong(i, fmt::format("moves pixels [{}, {}), but must move some of [{}, {})", step.pixels.begin, step.pixels.end, pixels.begin,
                                  pixels.end));
    }
    for (Rank rank : {step.from, step.to}) {
      if (!round_use.Use(step.round, rank, step.pixels)) {
        return Wrong(i, fmt::format("rank {} touches the same pixels twice in round {}", rank, step.round));
      }
    }
  }

  ScheduleRunner<RankInterval> runner(std::make_shared<const IndexedSchedule>(schedule), pixels, AllRanks(schedule.ranks));
  for (Rank rank = 0; rank < schedule.ranks; ++rank) runner.OnRendered(rank, {rank, rank + 1});
  while (const auto taken = runner.TakeNext()) {
    const Step& step = *taken->step;
    if (PixelCount(taken->parts) != PixelCount(step.pixels)) {
      return Wrong(taken->index, fmt::format("rank {} sends pixels that it does not hold", step.from));
    }
    for (const Fragment<RankInterval>& part : taken->parts) {
      if (!runner.held(step.to).Combine(part, Joined)) {
        return Wrong(taken->index, fmt::format("ranks [{}, {}) meet an interval at rank {} that is not adjacent", part.value.begin,
                                               part.value.end, step.to));
      }
    }
  }
  for (std::size_t share = 0; share < schedule.roots.size(); ++share) {
    const Rank root = schedule.roots[share];
    const PixelRange of_root = Share(pixels, share, schedule.roots.size());
    std::uint64_t whole = 0;
    for (const Fragment<RankInterval>& part : runner.held(root).Take(of_root)) {
      if (part.value == RankInterval{0, schedule.ranks}) whole += PixelCount(part.pixels);
    }
    if (whole != PixelCount(of_root)) {
      return Status::InvalidArgument(fmt::format("schedule: root {} does not end with ranks [0, {}) of every pixel", root, schedule.ranks));
    }
  }
  for (Rank rank = 0; rank < schedule.ranks; ++rank) {
    if (!runner.held(rank).list().empty()) return Status::InvalidArgument(fmt::format("schedule: rank {} ends with pixels", rank));
  }
  return Status::Ok();
}

}  // namespace slabstream
