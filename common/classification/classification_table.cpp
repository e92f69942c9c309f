#include "common/classification/classification_table.h"

#include <algorithm>
#include <cmath>

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

// The stored samples that bins are spread over: those of `range` between which the function changes, and one bin more on both sides for
// what is outside. `whole` holds all integers that occur.
StoredRange DistinguishedSamples(const StoredRange& whole, const NodeRange& nodes, const VolumeDescription& description) {
  const auto& [scale, offset] = description.mapping;
  if (scale == 0 || !(nodes.first <= nodes.last)) return whole;
  constexpr double kBeyond = 1e39;  // all floats
  const auto stored = [&](double value) { return std::clamp((value - offset) / scale, -kBeyond, kBeyond); };
  const auto [first, last] = std::minmax({stored(nodes.first), stored(nodes.last)});
  StoredRange of;
  if (description.type != ScalarType::kFloat32) {
    of = {std::floor(first) - 1, std::ceil(last) + 1};
  } else {
    // Single precision tells no values apart that lie nearer to each other.
    const double least_bin = std::max({std::abs(first) * 0x1p-20, std::abs(last) * 0x1p-20, double(std::numeric_limits<float>::min())});
    const double bin = std::max((last - first) / (kMaxBins - 3), least_bin);
    of = {first - bin, last + bin};
  }
  of = {std::clamp(of.low, whole.low, whole.high), std::clamp(of.high, whole.low, whole.high)};
  // Kernels subtract the origin in single precision, which must not round it.
  if (description.type == ScalarType::kFloat32 && of.low > whole.low) of.low = double(float(of.low));
  return of;
}

}  // namespace

NodeRange NodesOf(const TransferFunction& transfer) {
  NodeRange nodes;
  const auto add = [&nodes](const auto& points) {
    if (points.empty()) return;
    nodes.first = std::min(nodes.first, points.front().value);
    nodes.last = std::max(nodes.last, points.back().value);
  };
  add(transfer.colors);
  add(transfer.opacities);
  add(transfer.isosurfaces);
  return nodes;
}

ClassificationTable Classify(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range) {
  ClassificationTable table;
  table.opacity_distance = transfer.opacity_distance;

  const StoredRange whole = StoredFromData(description, range);
  const NodeRange nodes = NodesOf(transfer);
  StoredRange stored = DistinguishedSamples(whole, nodes, description);
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
  constexpr double kLeastShare = 0x1p-60;
  const double all = whole.high - whole.low, told_apart = bins == 1 ? all : stored.high - stored.low;
  table.stored_extent = all > 0 && std::isfinite(all) ? std::max(told_apart, kLeastShare * all) : 1;

  const bool each_has_a_bin = description.type != ScalarType::kFloat32 && table.bin_from_stored_scale == 1;
  const double half = 0.5 * width * std::abs(description.mapping.scale);
  table.opacity.reserve(std::size_t(bins));
  table.color.reserve(std::size_t(bins));
  table.value.reserve(std::size_t(bins));
  for (int bin = 0; bin < bins; ++bin) {
    double value = description.mapping.FromStored(bin == 0 ? stored.low : stored.low + bin * width);
    // The function's ends stand for the bins round them, so that a background at the foot of a ramp stays empty.
    for (const double end : {nodes.first, nodes.last}) {
      if (bins > 1 && !each_has_a_bin && std::abs(value - end) < half) value = end;
    }
    table.value.push_back(value);
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

BinRange BinsOf(const ClassificationTable& table, const VolumeDescription& description, ValueRange values) {
  if (!(values.min <= values.max)) return {};
  StoredRange stored = StoredFromData(description, values);
  if (description.type == ScalarType::kFloat32 && description.mapping != ValueMapping{}) {
    // Mapped to data values, the ends were rounded to floats.
    const double slack = std::max(std::abs(stored.low), std::abs(stored.high)) * 0x1p-22;
    stored = {stored.low - slack, stored.high + slack};
  }
  return {table.BinOf(stored.low), table.BinOf(stored.high)};
}

float MaxOpacity(const ClassificationTable& table, const VolumeDescription& description, ValueRange values) {
  const BinRange bins = BinsOf(table, description, values);
  if (bins.first > bins.last) return 0;
  return *std::max_element(table.opacity.begin() + bins.first, table.opacity.begin() + bins.last + 1);
}

}  // namespace slabstream
