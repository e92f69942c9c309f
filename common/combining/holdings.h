// Holdings: what one rank holds while a schedule runs, as intervals of ranks instead of pixels.
#pragma once

#include <cstdint>
#include <optional>

#include "common/combining/fragments.h"
#include "common/combining/schedule.h"

namespace slabstream {

using Holdings = Fragments<RankInterval>;

// What two intervals combine to. None: they are not adjacent.
inline std::optional<RankInterval> Joined(const RankInterval& a, const RankInterval& b) {
  if (a.end == b.begin) return RankInterval{a.begin, b.end};
  if (b.end == a.begin) return RankInterval{b.begin, a.end};
  return std::nullopt;
}

// True if exactly the pixels of `pixels` are held, all with the interval `ranks`.
inline bool IsWhole(const Holdings& holdings, PixelRange pixels, RankInterval ranks) {
  std::uint64_t next = pixels.begin;
  for (const auto& [begin, held] : holdings.fragments()) {
    if (begin != next || held.value != ranks) return false;
    next = held.end;
  }
  return next == pixels.end;
}

}  // namespace slabstream
