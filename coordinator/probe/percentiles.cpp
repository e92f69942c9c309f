#include "coordinator/probe/percentiles.h"

#include <numeric>

namespace slabstream {

double PercentileOf(const VolumeSummary& summary, double percent) {
  const auto total = double(std::accumulate(summary.histogram.begin(), summary.histogram.end(), std::uint64_t{0}));
  const double wanted = total * percent / 100, width = (double(summary.range.max) - double(summary.range.min)) / kHistogramBins;
  double below = 0;
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    const auto count = double(summary.histogram.at(std::size_t(bin)));
    if (count > 0 && below + count >= wanted) return double(summary.range.min) + width * (bin + (wanted - below) / count);
    below += count;
  }
  return double(summary.range.min);
}

}  // namespace slabstream
