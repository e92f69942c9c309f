// Building blocks of the families of schedules.
#pragma once

#include <cstdint>

#include "common/combining/schedule.h"

namespace slabstream {

// Part `part` of `parts` equal ones, which tile `pixels` and may be empty.
constexpr PixelRange Share(const PixelRange& pixels, std::uint64_t part, std::uint64_t parts) {
  const std::uint64_t size = pixels.end - pixels.begin;
  return {pixels.begin + size * part / parts, pixels.begin + size * (part + 1) / parts};
}

// Calls take(turn, from) so that member `to` of `count` neighbours takes something from each of the others, from the inside out: what it
// holds stays one interval. Turns count from 0, in step for every `to`: no member is asked twice in a turn.
template <class Take>
void ForEachInsideOut(std::uint32_t to, std::uint32_t count, Take&& take) {
  for (std::uint32_t distance = 1; distance < count; ++distance) {
    if (distance <= to) take(2 * (distance - 1), to - distance);
    if (to + distance < count) take(2 * (distance - 1) + 1, to + distance);
  }
}
constexpr std::uint32_t InsideOutTurns(std::uint32_t count) { return count < 2 ? 0 : 2 * (count - 1); }

// Splits each step of `schedule` into `strips` strips of its pixels, one round after the other; all steps move the same pixels. There are
// fewer strips if there are too few pixels, or if kMaxSteps allows no more.
Schedule InStrips(Schedule schedule, std::uint32_t strips);

}  // namespace slabstream
