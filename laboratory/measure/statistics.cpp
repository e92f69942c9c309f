#include "laboratory/measure/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/base/check.h"

namespace slabstream {

double MedianCoverage(int count, int k) {
  CHECK(k >= 1 && k <= (count + 1) / 2) << "order " << k << " of " << count;
  double below = 0;  // P(Binomial(count, 1/2) < k)
  for (int i = 0; i < k; ++i) {
    below += std::exp(std::lgamma(count + 1.0) - std::lgamma(i + 1.0) - std::lgamma(count - i + 1.0) - count * std::log(2.0));
  }
  return std::max(0.0, 1 - 2 * below);
}

namespace {

bool HasTwoModes(const std::vector<double>& sorted, double median) {
  for (std::size_t upper = 2; upper + 2 <= sorted.size(); ++upper) {
    const double gap = sorted[upper] - sorted[upper - 1];
    const double widest = std::max(sorted[upper - 1] - sorted.front(), sorted.back() - sorted[upper]);
    if (gap > 0.1 * std::abs(median) && gap > 2 * widest) return true;
  }
  return false;
}

}  // namespace

Estimate MedianOf(std::vector<double> values, double confidence) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const int count = int(values.size());
  Estimate estimate{.median = (values[std::size_t(count - 1) / 2] + values[std::size_t(count) / 2]) / 2, .count = count};
  int k = 1;
  while (k + 1 <= (count + 1) / 2 && MedianCoverage(count, k + 1) >= confidence) ++k;
  estimate.low = values[std::size_t(k - 1)];
  estimate.high = values[std::size_t(count - k)];
  estimate.coverage = estimate.low == estimate.high ? 1 : MedianCoverage(count, k);
  estimate.two_modes = HasTwoModes(values, estimate.median);
  return estimate;
}

double Quantile(std::vector<double> values, double q) {
  CHECK(!values.empty() && q >= 0 && q <= 1) << q;
  const auto rank = std::max(0.0, std::ceil(q * double(values.size())) - 1);
  const auto found = values.begin() + std::ptrdiff_t(rank);
  std::nth_element(values.begin(), found, values.end());
  return *found;
}

}  // namespace slabstream
