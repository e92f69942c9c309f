#include "client/report/frame_spans.h"

#include <algorithm>
#include <limits>
#include <map>

namespace slabstream {
namespace {

// When a worker computed for the frame, by its own clock.
struct Work {
  std::int64_t begin_ns = std::numeric_limits<std::int64_t>::max(), end_ns = std::numeric_limits<std::int64_t>::min();
};

}  // namespace

std::vector<StageSpan> StageSpans(const FrameStatistics& statistics) {
  std::map<std::uint32_t, Work> works;
  for (const RankReport& report : statistics.reports) {
    for (const Span& span : report.spans) {
      if (span.stage == Stage::kFetch) continue;
      Work& work = works[report.worker];
      work.begin_ns = std::min(work.begin_ns, span.begin_ns);
      work.end_ns = std::max(work.end_ns, span.end_ns);
    }
  }
  std::vector<StageSpan> spans;
  for (const RankReport& report : statistics.reports) {
    const auto work = works.find(report.worker);
    const bool same_clock =
        work == works.end() || (work->second.begin_ns >= statistics.begin_ns && work->second.end_ns <= statistics.end_ns);
    const std::int64_t shift = same_clock ? 0 : statistics.begin_ns - work->second.begin_ns;
    for (const Span& span : report.spans) {
      spans.push_back({report.worker, report.group, report.rank, report.box, span.stage, span.begin_ns + shift, span.end_ns + shift});
    }
  }
  return spans;
}

}  // namespace slabstream
