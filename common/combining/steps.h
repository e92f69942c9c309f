// What the families of schedules are made with.
#pragma once

#include <cstdint>

#include "common/combining/schedule.h"

namespace slabstream {

// Part `part` of `parts` equal ones, which tile `pixels` and may be empty.
constexpr PixelRange Share(const PixelRange& pixels, std::uint64_t part, std::uint64_t parts) {
  const std::uint64_t size = pixels.end - pixels.begin;
  return {pixels.begin + size * part / parts, pixels.begin + size * (part + 1) / parts};
}

// An order in which member `to` of `count` neighbours takes something from all others so that what it holds stays one interval: from the
// inside out. take(turn, from) for each; turns count from 0 and are the same for every `to`: no member is asked twice in a turn.
template <class Take>
void ForEachInsideOut(std::uint32_t to, std::uint32_t count, Take&& take) {
  for (std::uint32_t distance = 1; distance < count; ++distance) {
    if (distance <= to) take(2 * (distance - 1), to - distance);
    if (to + distance < count) take(2 * (distance - 1) + 1, to + distance);
  }
}
constexpr std::uint32_t InsideOutTurns(std::uint32_t count) { return count < 2 ? 0 : 2 * (count - 1); }

// Each step of `schedule`, which move the same pixels, once for each of `strips` strips of them, which follow each other by a round. There
// are fewer strips where the pixels or kMaxSteps are too few.
Schedule InStrips(Schedule schedule, std::uint32_t strips);

}  // namespace slabstream
