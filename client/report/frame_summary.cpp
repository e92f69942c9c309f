#include "client/report/frame_summary.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

namespace slabstream {
namespace {

using Interval = std::pair<std::int64_t, std::int64_t>;

// Length of the union, clipped to [begin, end).
std::int64_t CoveredNs(std::vector<Interval> intervals, std::int64_t begin, std::int64_t end) {
  std::sort(intervals.begin(), intervals.end());
  std::int64_t covered = 0, reached = begin;
  for (const auto& [from, to] : intervals) {
    const std::int64_t first = std::max(from, reached), last = std::min(to, end);
    if (last > first) {
      covered += last - first;
      reached = last;
    }
  }
  return covered;
}

}  // namespace

FrameSummary Summarize(const FrameStatistics& statistics) {
  FrameSummary summary;
  std::map<std::uint32_t, std::int64_t> render_ns;      // by worker
  std::map<std::uint32_t, std::vector<Interval>> busy;  // by worker
  for (const RankReport& report : statistics.reports) {
    AddTimes(summary.stage_ns, report.stage_ns);
    summary.voxel_bytes += report.voxel_bytes;
    summary.image_bytes += report.image_bytes;
    summary.stored_bytes += report.stored_bytes;
    summary.sent_bytes += report.sent_bytes;
    summary.finish_ns += PictureNs(report);
    render_ns[report.worker] += report.stage_ns[std::size_t(Stage::kRender)];
    for (const Span& span : report.spans) {
      // Waiting for voxels is not work.
      if (span.stage != Stage::kFetch) busy[report.worker].emplace_back(span.begin_ns, span.end_ns);
    }
  }

  const double workers = double(std::max<std::size_t>({1, statistics.workers, render_ns.size()}));
  std::int64_t most = 0, total = 0;
  for (const auto& [worker, ns] : render_ns) {
    most = std::max(most, ns);
    total += ns;
  }
  summary.render_ns = most;
  summary.combine_ns = summary.stage_ns[std::size_t(Stage::kCombine)] + summary.stage_ns[std::size_t(Stage::kEncode)] +
                       summary.stage_ns[std::size_t(Stage::kResolve)] - summary.finish_ns;
  if (total > 0) summary.imbalance = double(most) * workers / double(total);

  std::int64_t busy_ns = 0;
  for (auto& [worker, intervals] : busy) busy_ns += CoveredNs(std::move(intervals), statistics.begin_ns, statistics.end_ns);
  const double available = workers * double(statistics.end_ns - statistics.begin_ns);
  if (available > 0) summary.idle_share = std::clamp(1 - double(busy_ns) / available, 0.0, 1.0);
  return summary;
}

Json LevelsJson(const FrameStatistics& statistics) {
  Json levels = Json::array();
  for (const auto& [level, boxes, voxels] : statistics.levels) levels.push_back({{"level", level}, {"boxes", boxes}, {"voxels", voxels}});
  return levels;
}

Json BytesJson(const FrameSummary& summary) {
  return {{"voxels", summary.voxel_bytes}, {"stored", summary.stored_bytes}, {"sent", summary.sent_bytes}, {"images", summary.image_bytes}};
}

Json StagesJson(const FrameSummary& summary) {
  Json stages = Json::object();
  for (int stage = 0; stage < kStageCount; ++stage) {
    stages[std::string(ToString(Stage(stage)))] = Milliseconds(summary.stage_ns[std::size_t(stage)]);
  }
  return stages;
}

}  // namespace slabstream
