// A frame by two workers whose clocks may differ from the coordinator's.
#pragma once

#include "common/wire/client_messages.h"

namespace slabstream {

inline constexpr std::int64_t kMs = 1'000'000;

// A frame that was planned at `begin` by the coordinator's clock, and ready 30 ms later, by workers 4 and 5, whose clocks show that much
// more.
inline FrameStatistics FrameAt(std::int64_t begin, std::int64_t clock4 = 0, std::int64_t clock5 = 0) {
  FrameStatistics frame;
  frame.workers = 2;
  frame.groups = 1;
  frame.attempts = 1;
  frame.renderer = "splat";
  frame.queued_ns = 2 * kMs;
  frame.begin_ns = begin;
  frame.end_ns = begin + 30 * kMs;
  for (const std::uint32_t rank : {0U, 1U}) {
    RankReport report;
    report.worker = 4 + rank;
    report.rank = rank;
    report.box = 7 + rank;
    const std::int64_t first = begin + kMs + (rank == 0 ? clock4 : clock5);
    report.spans = {{Stage::kFetch, first - 3 * kMs, first},
                    {Stage::kRender, first, first + 8 * kMs},
                    {Stage::kCombine, first + 8 * kMs, first + 9 * kMs}};
    frame.reports.push_back(report);
  }
  return frame;
}

}  // namespace slabstream
