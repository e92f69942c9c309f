#include "simulator/frame_account.h"

#include <algorithm>

namespace slabstream {
namespace {

// The seconds of [begin, end) that the intervals cover.
double CoveredSeconds(std::vector<std::pair<double, double>> intervals, double begin, double end) {
  std::sort(intervals.begin(), intervals.end());
  double covered = 0, reached = begin;
  for (const auto& [from, to] : intervals) {
    const double first = std::max(from, reached), last = std::min(to, end);
    if (last <= first) continue;
    covered += last - first;
    reached = last;
  }
  return covered;
}

}  // namespace

void FrameAccount::Add(const LaneTask& task, double end) {
  if (task.work == Work::kRender) render_seconds_[task.worker] += end - task.begin;
  busy_[task.worker].emplace_back(task.begin, end);
}

void FrameAccount::Close(std::size_t slots, SimulatedFrame& result) const {
  double most = 0, total = 0, busy = 0;
  for (const double seconds : render_seconds_) {
    most = std::max(most, seconds);
    total += seconds;
  }
  for (const std::vector<std::pair<double, double>>& intervals : busy_) busy += CoveredSeconds(intervals, result.planned, result.done);
  const auto shares = double(std::max(slots, busy_.size()));
  if (total > 0) result.imbalance = most * shares / total;
  const double available = shares * (result.done - result.planned);
  if (available > 0) result.idle_share = std::clamp(1 - busy / available, 0.0, 1.0);
}

}  // namespace slabstream
