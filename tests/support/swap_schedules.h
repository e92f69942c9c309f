// Schedules that divide images: what an executor of schedules must be able to run beside the families of CombiningSchemes().
#pragma once

#include <cstdint>

#include "common/combining/schedule.h"

namespace slabstream {

inline PixelRange Share(const PixelRange& pixels, std::uint64_t part, std::uint64_t parts) {
  const std::uint64_t size = pixels.end - pixels.begin;
  return {pixels.begin + size * part / parts, pixels.begin + size * (part + 1) / parts};
}

// Recursive halving (binary swap): neighbours exchange halves of what they hold, then everybody sends their share to the root. `ranks` is a
// power of 2.
inline Schedule MakeRecursiveHalving(const ScheduleRequest& request) {
  Schedule schedule = {request.ranks, request.root, {}};
  std::vector<PixelRange> held(request.ranks, request.pixels);
  std::uint32_t round = 0;
  for (Rank distance = 1; distance < request.ranks; distance *= 2, ++round) {
    for (Rank rank = 0; rank < request.ranks; ++rank) {
      const Rank other = rank ^ distance;
      const bool keeps_lower = rank < other;
      const PixelRange sent = Share(held[rank], keeps_lower ? 1 : 0, 2);
      schedule.steps.push_back({round, rank, other, sent});
    }
    for (Rank rank = 0; rank < request.ranks; ++rank) held[rank] = Share(held[rank], rank < (rank ^ distance) ? 0 : 1, 2);
  }
  for (Rank rank = 0; rank < request.ranks; ++rank) {
    if (rank != request.root) schedule.steps.push_back({round, rank, request.root, held[rank]});
  }
  return schedule;
}

// Direct send: rank r gathers share r of the picture, from the inside out so that intervals stay adjacent; then everybody sends to the
// root.
inline Schedule MakeDirectSend(const ScheduleRequest& request) {
  Schedule schedule = {request.ranks, request.root, {}};
  std::uint32_t round = 0;
  for (Rank distance = 1; distance < request.ranks; ++distance) {
    for (const bool before : {true, false}) {
      for (Rank to = 0; to < request.ranks; ++to) {
        if (before ? to < distance : to + distance >= request.ranks) continue;
        schedule.steps.push_back({round, before ? to - distance : to + distance, to, Share(request.pixels, to, request.ranks)});
      }
      ++round;
    }
  }
  for (Rank rank = 0; rank < request.ranks; ++rank) {
    if (rank != request.root) schedule.steps.push_back({round, rank, request.root, Share(request.pixels, rank, request.ranks)});
  }
  return schedule;
}

// A chain in strips, from the last rank to the first, each strip one round behind the one before it; then the root gets the result if it is
// not rank 0.
inline Schedule MakeStripChain(const ScheduleRequest& request, std::uint64_t strips) {
  Schedule schedule = {request.ranks, request.root, {}};
  for (std::uint32_t round = 0; round < request.ranks + strips; ++round) {
    for (std::uint64_t strip = 0; strip < strips && strip <= round; ++strip) {
      const std::uint64_t hop = round - strip;
      if (hop + 1 >= request.ranks) continue;
      const Rank from = request.ranks - 1 - Rank(hop);
      schedule.steps.push_back({round, from, from - 1, Share(request.pixels, strip, strips)});
    }
  }
  if (request.root != 0) schedule.steps.push_back({request.ranks + std::uint32_t(strips), 0, request.root, request.pixels});
  return schedule;
}

}  // namespace slabstream
