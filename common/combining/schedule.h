// Schedule: how the images of a group's ranks become one, as data. The executor does not know which family made it.
//
// Ranks 0 ... ranks-1 hold one image each, in visibility order, nearest first. A step moves the pixels of `pixels` that `from` holds at
// that time to `to`. If `to` holds these pixels too, the two are combined: their rank intervals must be adjacent, and `to` then holds the
// union; if it does not, it takes them as they are. `from` no longer holds them. Steps of one round may run at the same time, so those of
// one rank concern disjoint pixels; a rank takes its own steps in order of rounds. At the end `root` holds [0, ranks) of all pixels. A
// group without images has ranks == 0 and no steps.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/image/run_image.h"

namespace slabstream {

using Rank = std::uint32_t;
inline constexpr Rank kMaxRanks = 65536;

// Half-open interval of ranks whose images have been combined.
struct RankInterval {
  Rank begin = 0, end = 0;
  friend constexpr bool operator==(const RankInterval&, const RankInterval&) = default;
};

struct Step {
  std::uint32_t round = 0;
  Rank from = 0, to = 0;
  PixelRange pixels;
  friend bool operator==(const Step&, const Step&) = default;
};

struct Schedule {
  Rank ranks = 1;
  Rank root = 0;
  std::vector<Step> steps;  // by ascending round
  friend bool operator==(const Schedule&, const Schedule&) = default;
};

struct ScheduleRequest {
  Rank ranks = 1;
  Rank root = 0;      // who holds the result
  PixelRange pixels;  // of the whole frame
};

struct CombiningEntry {
  std::string_view name;     // what --combine takes
  std::string_view purpose;  // one line for --help
  Schedule (*make)(const ScheduleRequest&);
};

// The only list.
const std::vector<CombiningEntry>& CombiningSchemes();
const CombiningEntry* FindCombiningScheme(std::string_view name);  // null: no such name

Schedule MakeFanIn(const ScheduleRequest& request);        // binary tree, log2(ranks) rounds (Yagel and Machiraju, section 2.1, figure 3c)
Schedule MakeCentralized(const ScheduleRequest& request);  // every rank to the root, in an order that keeps intervals adjacent (figure 3a)

// Runs the schedule on intervals and says what is wrong with it, if anything: ranks in range, rounds ascending, no rank touches pixels
// twice in a round, only adjacent intervals meet, nobody sends what it does not hold, and the root ends with [0, ranks) of every pixel of
// `pixels`.
Status CheckSchedule(const Schedule& schedule, PixelRange pixels);

}  // namespace slabstream
