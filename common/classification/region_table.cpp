#include "common/classification/region_table.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/parallel/parallel.h"

namespace slabstream {

const float* RegionTable::At(float stored, float slope) const {
  const auto place = [](float number, int count) { return std::size_t(std::clamp(number + 0.5F, 0.0F, float(count - 1))); };
  const std::size_t value = place((stored - origin) * scale, kValues), steep = place(std::sqrt(slope * slope_scale), kSlopes);
  return &entries[4 * (value * kSlopes + steep)];
}

RegionTable MakeRegionTable(const TransferFunction& transfer, const ClassificationTable& table, const ValueMapping& mapping) {
  double least = kMaxScalar, greatest = -kMaxScalar, steepest = 0;
  for (const TransferRegion& region : transfer.regions) {
    const auto [low, high] = BoundsOf(region);
    least = std::min(least, low.value);
    greatest = std::max(greatest, high.value);
    steepest = std::max(steepest, high.slope);
  }
  constexpr int kSteepest = RegionTable::kSlopes - 2;  // its place
  const double stored_range = (table.size() - 1) / table.bin_from_stored_scale;
  RegionTable of{.origin = float(table.stored_origin),
                 .scale = stored_range > 0 ? float((RegionTable::kValues - 1) / stored_range) : 0,
                 .slope_scale = float(std::min(double(kSteepest) * kSteepest * std::abs(mapping.scale) / steepest, 1e37)),
                 .entries = {}};
  of.entries.resize(4 * std::size_t{RegionTable::kValues} * RegionTable::kSlopes);
  const RegionShapes shapes(transfer.regions);
  std::vector<double> slopes, factors;
  for (int place = 0; place < RegionTable::kSlopes; ++place) {
    const double share = double(place) / kSteepest;
    slopes.push_back(share * share * steepest);
    factors.push_back(transfer.gradient_opacities.empty() ? 1 : GradientOpacity(transfer.gradient_opacities, slopes.back()));
  }
  ParallelFor(0, RegionTable::kValues, [&](int row) {
    const double value = mapping.FromStored(table.stored_origin + stored_range * row / (RegionTable::kValues - 1));
    if (!(value >= least && value <= greatest)) return;
    float* entry = &of.entries[4 * std::size_t(row) * RegionTable::kSlopes];
    for (std::size_t place = 0; place < slopes.size(); ++place, entry += 4) {
      const auto [color, opacity] = shapes.At(value, slopes[place]);
      entry[0] = color.r;
      entry[1] = color.g;
      entry[2] = color.b;
      entry[3] = float(opacity * factors[place]);
    }
  });
  return of;
}

}  // namespace slabstream
