#include "common/planning/frame_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace slabstream {
namespace {

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

void FrameNoise::Learn(std::span<const double> deviations, double frames) {
  if (deviations.empty()) return;
  // A frame in which all boxes take longer says nothing of their differences.
  const double common = Median({deviations.begin(), deviations.end()});
  std::vector<double> apart;
  for (const double deviation : deviations) apart.push_back(std::abs(deviation - common));
  constexpr double kPerMedian = 1.4826;  // of the normal distribution
  const double sample = kPerMedian * Median(std::move(apart));
  const double weight = std::max(kLeastWeight, 1.0 / ++frames_);
  square_ += weight * (sample * sample / (1 + 1 / frames) - square_);  // the mean of n frames scatters, too
}

std::optional<double> FrameNoise::deviation() const { return frames_ == 0 ? std::nullopt : std::optional(std::sqrt(square_)); }

}  // namespace slabstream
