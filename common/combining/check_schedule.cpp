// CheckSchedule: runs a schedule on rank intervals instead of images.

#include <fmt/format.h>

#include <iterator>
#include <map>
#include <optional>
#include <vector>

#include "common/combining/schedule.h"

namespace slabstream {
namespace {

// What a rank holds: disjoint fragments of the frame, each with the interval of ranks that it has combined. By first pixel.
struct Fragment {
  std::uint64_t end = 0;
  RankInterval ranks;
};

class Holdings {
 public:
  void Put(PixelRange pixels, RankInterval ranks) { fragments_[pixels.begin] = {pixels.end, ranks}; }

  // Takes out the fragments that lie in `pixels`, cutting those at its ends.
  std::map<std::uint64_t, Fragment> Take(PixelRange pixels) {
    CutAt(pixels.begin);
    CutAt(pixels.end);
    std::map<std::uint64_t, Fragment> taken;
    const auto end = fragments_.lower_bound(pixels.end);
    for (auto it = fragments_.lower_bound(pixels.begin); it != end; it = fragments_.erase(it)) taken.insert(*it);
    return taken;
  }

  // Combines a fragment into what is held; where nothing is held it is taken as it is. False if two intervals meet that are not adjacent.
  bool Combine(PixelRange pixels, RankInterval ranks) {
    std::uint64_t next = pixels.begin;  // pixels before it are done
    for (const auto& [begin, held] : Take(pixels)) {
      if (begin > next) Put({next, begin}, ranks);
      if (held.ranks.end == ranks.begin) {
        Put({begin, held.end}, {held.ranks.begin, ranks.end});
      } else if (ranks.end == held.ranks.begin) {
        Put({begin, held.end}, {ranks.begin, held.ranks.end});
      } else {
        return false;
      }
      next = held.end;
    }
    if (next < pixels.end) Put({next, pixels.end}, ranks);
    return true;
  }

  // True if exactly the pixels of `pixels` are held, all with the interval `ranks`.
  bool IsWhole(PixelRange pixels, RankInterval ranks) const {
    std::uint64_t next = pixels.begin;
    for (const auto& [begin, held] : fragments_) {
      if (begin != next || held.ranks != ranks) return false;
      next = held.end;
    }
    return next == pixels.end;
  }

 private:
  void CutAt(std::uint64_t pixel) {
    auto it = fragments_.lower_bound(pixel);
    if (it == fragments_.begin()) return;
    Fragment& before = std::prev(it)->second;
    if (before.end <= pixel) return;
    fragments_[pixel] = before;
    before.end = pixel;
  }

  std::map<std::uint64_t, Fragment> fragments_;
};

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

bool Covers(const std::map<std::uint64_t, Fragment>& fragments, PixelRange pixels) {
  std::uint64_t next = pixels.begin;
  for (const auto& [begin, fragment] : fragments) {
    if (begin != next) return false;
    next = fragment.end;
  }
  return next == pixels.end;
}

Status Wrong(std::size_t step, const std::string& message) {
  return Status::InvalidArgument(fmt::format("schedule.steps[{}]: {}", step, message));
}

}  // namespace

Status CheckSchedule(const Schedule& schedule, PixelRange pixels) {
  if (schedule.ranks == 0) {
    return schedule.steps.empty() ? Status::Ok() : Status::InvalidArgument("schedule.steps is not empty, but there are no ranks");
  }
  if (schedule.ranks > kMaxRanks)
    return Status::InvalidArgument(fmt::format("schedule.ranks is {}, but at most {} are allowed", schedule.ranks, kMaxRanks));
  if (schedule.root >= schedule.ranks) {
    return Status::InvalidArgument(fmt::format("schedule.root is {}, but must be below {}", schedule.root, schedule.ranks));
  }
  if (pixels.begin >= pixels.end) return Status::InvalidArgument("schedule: the frame has no pixels");

  std::vector<Holdings> holdings(schedule.ranks);
  for (Rank rank = 0; rank < schedule.ranks; ++rank) holdings[rank].Put(pixels, {rank, rank + 1});
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
    const auto moved = holdings[step.from].Take(step.pixels);
    if (!Covers(moved, step.pixels)) return Wrong(i, fmt::format("rank {} sends pixels that it does not hold", step.from));
    for (const auto& [begin, fragment] : moved) {
      if (!holdings[step.to].Combine({begin, fragment.end}, fragment.ranks)) {
        return Wrong(i, fmt::format("ranks [{}, {}) meet an interval at rank {} that is not adjacent", fragment.ranks.begin,
                                    fragment.ranks.end, step.to));
      }
    }
  }
  if (!holdings[schedule.root].IsWhole(pixels, {0, schedule.ranks})) {
    return Status::InvalidArgument(
        fmt::format("schedule: root {} does not end with ranks [0, {}) of every pixel", schedule.root, schedule.ranks));
  }
  return Status::Ok();
}

}  // namespace slabstream
