// Statistics of repeated measurements: median, confidence interval and quantiles. Pure.
#pragma once

#include <functional>
#include <vector>

namespace slabstream {

// The interval is that of order statistics: the k-th smallest and k-th largest value with the largest k whose interval covers the median of
// the distribution with at least the wanted confidence, for any distribution (David and Nagaraja, Order Statistics, 2003,
// section 7.1):
//   coverage(k) = 1 - 2 P(Binomial(count, 1/2) < k)
// Fewer than six values cannot reach 95 %: the interval then spans all of them and `coverage` gives its confidence. For one value, or equal
// values (something computed), the interval is the value.
struct Estimate {
  double median = 0, low = 0, high = 0;
  double coverage = 0;  // confidence of [low, high], in [0, 1]
  int count = 0;
  // The values fall into two heaps of at least two values: the gap between these is wider than a tenth of the median and twice each heap.
  bool two_modes = false;
};
Estimate MedianOf(std::vector<double> values, double confidence = 0.95);  // no values: all zero

// A number of each: `of` is a member of the elements, or a function of one.
template <class Elements, class Of>
std::vector<double> EachOf(const Elements& elements, Of&& of) {
  std::vector<double> numbers;
  for (const auto& element : elements) numbers.push_back(double(std::invoke(of, element)));
  return numbers;
}

// The q-quantile by nearest rank: the least value that at least a share q of the values do not exceed. At least one value, q in [0, 1].
double Quantile(std::vector<double> values, double q);

// Coverage of the interval between the k-th smallest and the k-th largest of `count` values, 1 <= k <= (count + 1) / 2.
double MedianCoverage(int count, int k);

}  // namespace slabstream
