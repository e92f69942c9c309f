#include "common/classification/automatic_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/classification/histogram_analysis.h"

namespace slabstream {
namespace {

// One stop of a side's curves: the share of the side's voxels that lie nearer to the background.
struct Stop {
  double quantile;
  double opacity;  // as a multiple of the median's
  Rgb above, below;
};
constexpr std::array<Stop, 5> kStops = {{
    {0.02, 0.05, {0.52F, 0.22F, 0.14F}, {0.12F, 0.22F, 0.48F}},
    {0.20, 0.35, {0.75F, 0.42F, 0.26F}, {0.18F, 0.40F, 0.68F}},
    {0.50, 1.00, {0.90F, 0.66F, 0.44F}, {0.36F, 0.61F, 0.84F}},
    {0.85, 3.00, {0.97F, 0.88F, 0.70F}, {0.66F, 0.85F, 0.95F}},
    {0.995, 6.00, {1.00F, 0.98F, 0.93F}, {0.92F, 0.98F, 1.00F}},
}};
constexpr double kMaxOpacity = 0.95;

// The opacity per voxel length at which a mean stretch of material (its share of the volume's side) lets 2 % of the light through.
double MedianOpacity(const VolumeSummary& summary, double share) {
  const double side = std::cbrt(double(summary.description.geometry.bounds().voxel_count()));
  const double stretch = std::max(share * side, 1.0);  // voxels
  return std::clamp(1 - std::pow(0.02, 1 / stretch), 0.1, 0.5);
}

}  // namespace

TransferFunction AutomaticTransfer(const VolumeSummary& summary) {
  const auto [above, below] = FindForeground(summary);
  const double median = MedianOpacity(summary, above.share + below.share);
  TransferFunction transfer;
  const auto add = [&](double value, double opacity, const Rgb& color) {
    transfer.opacities.push_back({value, std::min(opacity * median, kMaxOpacity)});
    transfer.colors.push_back({value, color});
  };
  if (below.share > 0) {
    for (auto stop = kStops.rbegin(); stop != kStops.rend(); ++stop) {
      add(Quantile(summary, below, 1 - stop->quantile), stop->opacity, stop->below);
    }
    add(BinBorder(summary.range, below.last + 1), 0, kStops.front().below);
  }
  if (above.share > 0) {
    add(BinBorder(summary.range, above.first), 0, kStops.front().above);
    for (const Stop& stop : kStops) add(Quantile(summary, above, stop.quantile), stop.opacity, stop.above);
  }
  if (transfer.opacities.empty()) {
    transfer.opacities = {{summary.range.min, 0.05}};
    transfer.colors = {{summary.range.min, kStops[2].above}};
  }
  return transfer;
}

}  // namespace slabstream
