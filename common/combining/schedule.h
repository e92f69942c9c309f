// Schedule: how the images of a group's ranks become one, as data. The code that runs it does not know which family made it.
//
// Ranks 0 ... ranks-1 hold one image each, in visibility order, nearest first. A step moves the pixels of `pixels` that `from` holds at
// that time to `to`; `from` no longer holds them. If `to` holds these pixels too, the two are combined: their rank intervals must be
// adjacent, and `to` then holds the union. Else `to` takes the pixels as they are. Steps of one round may run at the same time, so those of
// one rank have disjoint pixels; a rank takes its own steps in order of rounds.
//
// The result ends in shares: the pixels are divided into as many equal shares as there are roots, and at the end roots[i] holds [0, ranks)
// of share i. With one root that is the whole image. A group without images has ranks == 0 and no steps. Plans and messages name schedules
// (named_schedule.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/image/pixel_bounds.h"

namespace slabstream {

using Rank = std::uint32_t;
inline constexpr Rank kMaxRanks = 65536;
inline constexpr std::uint32_t kMaxSteps = std::uint32_t{1} << 20;  // steps of a schedule

// Half-open interval of ranks whose images have been combined.
struct RankInterval {
  Rank begin = 0, end = 0;
  friend constexpr bool operator==(const RankInterval&, const RankInterval&) = default;
};

// What two intervals combine to. None: they are not adjacent.
constexpr std::optional<RankInterval> Joined(const RankInterval& a, const RankInterval& b) {
  if (a.end == b.begin) return RankInterval{a.begin, b.end};
  if (b.end == a.begin) return RankInterval{b.begin, a.end};
  return std::nullopt;
}

struct Step {
  std::uint32_t round = 0;
  Rank from = 0, to = 0;
  PixelRange pixels;
  friend bool operator==(const Step&, const Step&) = default;
};

struct Schedule {
  Rank ranks = 1;
  std::vector<Rank> roots = {0};  // one at least; a rank may have several shares
  std::vector<Step> steps;        // by ascending round
  friend bool operator==(const Schedule&, const Schedule&) = default;
};

// Part `part` of `parts` equal ones, which tile `pixels` and may be empty.
constexpr PixelRange Share(const PixelRange& pixels, std::uint64_t part, std::uint64_t parts) {
  const std::uint64_t size = pixels.end - pixels.begin;
  return {pixels.begin + size * part / parts, pixels.begin + size * (part + 1) / parts};
}

// What a family makes a schedule for: of one root, and its share of the frame.
struct ScheduleRequest {
  Rank ranks = 1;
  Rank root = 0;                         // rank that holds the result
  PixelRange pixels;                     // pixels that end there
  std::uint32_t most_steps = kMaxSteps;  // limits the number of strips
};

// The families. Any number of ranks, any root; steps of no pixels are left out.

// Both ends send towards the root, strip after strip. Each rank combines what it receives with its own pixels and passes a strip on while
// the next one comes in (the paper's pipeline). `strips` >= 1.
Schedule MakeChain(const ScheduleRequest& request, std::uint32_t strips);

// A tree (k >= 2): k neighbouring intervals meet at one rank. The root stands for the interval that it lies in; in others the rank at the
// same place does, so that trees with different roots do not all use the same ranks. k = 2 is the paper's fan-in, k >= ranks the
// centralized scheme (Yagel and Machiraju, section 2.1, figures 3c and 3a). `strips` as above.
Schedule MakeTree(const ScheduleRequest& request, std::uint32_t k, std::uint32_t strips);

// Radix-k (Peterka et al. 2009): in round i ranks meet in groups of factors[i], and each takes one share of the group's pixels from all
// others; then the root collects all shares. All factors 2 is binary swap (recursive halving), one factor of `ranks` is direct send.
// Factors are used in order as far as ranks and kMaxSteps allow, and the last one is reduced to fit. If their product is less than
// `ranks`, neighbours first fold their images into one.
Schedule MakeSwap(const ScheduleRequest& request, std::span<const std::uint32_t> factors);

// The way of one share in a radix-k schedule whose shares stay where they are combined: a tree in which, in round i, groups of factors[i]
// meet at the member that stands in its group as the root does in its own.
Schedule MakeSwapTree(const ScheduleRequest& request, std::span<const std::uint32_t> factors);

// Factors of at most 8 whose product is the largest that is not above `ranks`.
std::vector<std::uint32_t> DefaultFactors(Rank ranks);

inline Schedule MakeFanIn(const ScheduleRequest& request) { return MakeTree(request, 2, 1); }
inline Schedule MakeCentralized(const ScheduleRequest& request) { return MakeTree(request, std::max<Rank>(request.ranks, 2), 1); }

}  // namespace slabstream
