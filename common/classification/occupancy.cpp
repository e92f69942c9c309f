#include <cmath>

#include "common/classification/histogram_analysis.h"
#include "common/classification/transfer_function.h"

namespace slabstream {
namespace {

// Counts voxels with an opacity above zero in a volume with so few different integers that each has its own bin.
std::uint64_t CountExactly(const VolumeSummary& summary, const TransferFunction& transfer, std::int64_t first_stored,
                           std::int64_t last_stored) {
  std::uint64_t visible = 0;
  for (std::int64_t stored = first_stored; stored <= last_stored; ++stored) {
    const double value = summary.description.mapping.FromStored(double(stored));
    if (transfer.Opacity(value) > 0) visible += summary.histogram[std::size_t(HistogramBin(summary.range, float(value)))];
  }
  return visible;
}

std::uint64_t CountByBins(const VolumeSummary& summary, const TransferFunction& transfer) {
  std::uint64_t visible = 0;
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    if (transfer.Opacity(BinValue(summary.range, bin)) > 0) visible += summary.histogram[std::size_t(bin)];
  }
  return visible;
}

}  // namespace

double EstimateOccupancy(const VolumeSummary& summary, const TransferFunction& transfer) {
  const auto total = double(summary.description.geometry.bounds().voxel_count());
  const auto& [scale, offset] = summary.description.mapping;
  if (summary.description.type != ScalarType::kFloat32 && scale != 0) {
    const auto [first, last] =
        std::minmax({std::round((summary.range.min - offset) / scale), std::round((summary.range.max - offset) / scale)});
    if (last - first < kHistogramBins) return double(CountExactly(summary, transfer, std::int64_t(first), std::int64_t(last))) / total;
  }
  return double(CountByBins(summary, transfer)) / total;
}

}  // namespace slabstream
