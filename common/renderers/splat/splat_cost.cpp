#include "common/renderers/splat/splat_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "common/calibration/calibration.h"
#include "common/renderers/splat/splat_work.h"

namespace slabstream::splat {
double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary) {
  constexpr double kMostOpacity = 0.999;  // 1 would be infinite
  const ClassificationTable table = Classify(transfer, summary.description, summary.range);
  const auto histogram_bin = [&](std::size_t bin) {
    const double stored = table.stored_origin + double(bin) / table.bin_from_stored_scale;
    return std::size_t(HistogramBin(summary.range, summary.description.mapping.FromStored(stored)));
  };
  std::array<int, kHistogramBins> sharing{};  // bins of the table, by bin of the histogram
  for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) ++sharing[histogram_bin(bin)];
  std::vector<std::pair<double, double>> shown;  // opacity and number of voxels
  double voxels = 0;
  for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) {
    if (table.opacity[bin] <= 0) continue;
    shown.emplace_back(table.opacity[bin], double(summary.histogram[histogram_bin(bin)]) / sharing[histogram_bin(bin)]);
    voxels += shown.back().second;
  }
  std::ranges::sort(shown);
  double below = 0;
  for (const auto& [opacity, count] : shown) {
    below += count;
    if (below >= voxels / 2) return -std::log1p(-std::min(opacity, kMostOpacity)) / table.opacity_distance;
  }
  return 0;
}

AnalyticCost SplatCost(const OccupancyGrid& drawn, const Vec3& spacing, double extinction) {
  return [work = SplatWork(drawn, spacing, extinction)](const Box& box, const CostView& view) {
    const double scale = std::clamp(view.pixels_per_voxel, kMinGridPixelsPerVoxel, kMaxGridPixelsPerVoxel);
    // Counts are for one pixel a voxel. The number of rows and the length of segments both grow with the scale.
    const auto seconds_along = [&](Axis axis) {
      const SplatCounts counts = work.Count(box, axis);
      if (counts.rows == 0) return 0.0;
      namespace cost = calibration::splat;
      return cost::kBox + cost::kSlice * counts.slices +
             scale * (cost::kRow * counts.rows + scale * cost::kSegment * counts.segments + cost::kRun * counts.runs) +
             cost::kOctet * counts.octets;
    };
    if (view.along != Axis::kZ) return seconds_along(view.along);
    return (seconds_along(Axis::kX) + seconds_along(Axis::kY)) / 2;  // lines along z are not known
  };
}

}  // namespace slabstream::splat
