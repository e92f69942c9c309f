#include "simulator/frame_account.h"

#include <algorithm>

namespace slabstream {
namespace {

// The seconds of [begin, end] in `intervals`, which lie apart.
double CoveredSeconds(const std::vector<std::pair<double, double>>& intervals, double begin, double end) {
  double covered = 0;
  for (const auto& [from, to] : intervals) covered += std::max(std::min(to, end) - std::max(from, begin), 0.0);
  return covered;
}

}  // namespace

void FrameAccount::Add(std::uint32_t worker, Lane lane, double begin, double end) {
  if (lane == Lane::kRender) render_seconds_[worker] += end - begin;
  std::vector<std::pair<double, double>>& busy = busy_[worker];
  for (; !busy.empty() && busy.back().second >= begin; busy.pop_back()) begin = std::min(begin, busy.back().first);
  busy.emplace_back(begin, end);
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
