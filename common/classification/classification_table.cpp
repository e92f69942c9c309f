#include "common/classification/classification_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream {
namespace {

struct StoredRange {
  double low = 0, high = 0;
};

// The stored samples of a range of data values that was rounded to floats. Integers are recovered by rounding, float samples within the
// error of a float.
StoredRange StoredFromData(const VolumeDescription& description, ValueRange range) {
  const auto& [scale, offset] = description.mapping;
  if (scale == 0) return {};
  const auto [low, high] =
      std::minmax({(double(range.min) - offset) / scale, (double(range.max) - offset) / scale});  // scale may be negative
  if (description.type == ScalarType::kFloat32) return {low, high};
  const double largest = description.type == ScalarType::kUint8 ? 255 : 65535;
  return {std::clamp(std::round(low), 0.0, largest), std::clamp(std::round(high), 0.0, largest)};
}

}  // namespace

ClassificationTable Classify(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range) {
  ClassificationTable table;
  table.opacity_distance = transfer.opacity_distance;

  StoredRange stored = StoredFromData(description, range);
  int bins = kMaxBins;
  if (description.type == ScalarType::kUint8) {
    // The same table for every 8-bit volume of any range.
    stored = {0, 255};
    bins = 256;
  } else if (description.type == ScalarType::kUint16) {
    bins = int(std::min(stored.high - stored.low + 1, double(kMaxBins)));
  }

  // Distance of neighbouring bin centres: 1 where each stored value has a bin.
  const double width = (stored.high - stored.low) / (bins - 1);
  if (!(width > 0) || !std::isfinite(width)) bins = 1;  // one value, or a range that no double holds
  table.stored_origin = stored.low;
  table.bin_from_stored_scale = bins == 1 ? 1 : 1 / width;

  table.opacity.reserve(std::size_t(bins));
  table.color.reserve(std::size_t(bins));
  for (int bin = 0; bin < bins; ++bin) {
    const double value = description.mapping.FromStored(bin == 0 ? stored.low : stored.low + bin * width);
    table.opacity.push_back(float(transfer.Opacity(value)));
    table.color.push_back(transfer.Color(value));
  }
  table.max_opacity = *std::max_element(table.opacity.begin(), table.opacity.end());
  return table;
}

float StoredIsovalue(double value, const ValueMapping& mapping) {
  if (mapping.scale == 0) return std::numeric_limits<float>::infinity();  // every sample has the same value
  const double stored = (value - mapping.offset) / mapping.scale;
  constexpr double kMost = std::numeric_limits<float>::max();
  if (!(std::abs(stored) <= kMost)) return float(std::copysign(std::numeric_limits<double>::infinity(), stored));
  return float(stored - std::abs(stored) * 0x1p-20);
}

float MaxOpacity(const ClassificationTable& table, const VolumeDescription& description, ValueRange values) {
  if (!(values.min <= values.max)) return 0;
  StoredRange stored = StoredFromData(description, values);
  if (description.type == ScalarType::kFloat32 && description.mapping != ValueMapping{}) {
    // Mapped to data values, the ends were rounded to floats.
    const double slack = std::max(std::abs(stored.low), std::abs(stored.high)) * 0x1p-22;
    stored = {stored.low - slack, stored.high + slack};
  }
  const auto first = table.opacity.begin() + table.BinOf(stored.low), last = table.opacity.begin() + table.BinOf(stored.high);
  return *std::max_element(first, last + 1);
}

}  // namespace slabstream
