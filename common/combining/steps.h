// Building blocks of the families of schedules.
#pragma once

#include <cstdint>
#include <optional>

#include "common/combining/schedule.h"

namespace slabstream {

// Member `to` of `count` neighbours takes something from each of the others, from the inside out: what it holds stays one interval. Turns
// [0, InsideOutTurns(count)) are in step for every `to`: no member is asked twice in a turn. Returns the member that is asked, if one is.
constexpr std::uint32_t InsideOutTurns(std::uint32_t count) { return count < 2 ? 0 : 2 * (count - 1); }
constexpr std::optional<std::uint32_t> InsideOut(std::uint32_t turn, std::uint32_t to, std::uint32_t count) {
  const std::uint32_t distance = turn / 2 + 1;
  if (turn % 2 == 0) return distance <= to ? std::optional(to - distance) : std::nullopt;
  return to + distance < count ? std::optional(to + distance) : std::nullopt;
}
// Calls take(from) for each of them.
template <class Take>
void ForEachInsideOut(std::uint32_t to, std::uint32_t count, Take&& take) {
  for (std::uint32_t turn = 0; turn < InsideOutTurns(count); ++turn) {
    if (const std::optional<std::uint32_t> from = InsideOut(turn, to, count)) take(*from);
  }
}

// Splits each step of `schedule` into `strips` strips of its pixels, one round after the other; all steps move the same pixels. There are
// fewer strips if there are too few pixels, or if `most_steps` allows no more.
Schedule InStrips(Schedule schedule, std::uint32_t strips, std::uint32_t most_steps);

}  // namespace slabstream
