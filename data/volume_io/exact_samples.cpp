#include "data/volume_io/exact_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace slabstream {

ExactValue ExactValueOf(const ExactType& of, const std::byte* sample) {
  return VisitSampleType(of.type, [&]<class T>(const T*) -> ExactValue {
    T stored;
    std::memcpy(&stored, sample, sizeof stored);
    const ExactValue value{of.mapping.FromStored(double(stored))};
    if constexpr (!std::is_integral_v<T>) return value;
    // Wider than 64 bits, since the nearest double may lie beyond all of them.
    if (of.mapping == ValueMapping{}) return {value.value, std::int64_t(Int128(stored) - Int128(value.value))};
    return value;
  });
}

ExactType BestType(const Volume& volume, const ExactSamples* exact) {
  if (exact != nullptr) return exact->of;
  const auto& [geometry, type, mapping] = volume.description;
  return {type == ScalarType::kUint8    ? SampleType::kUint8
          : type == ScalarType::kUint16 ? SampleType::kUint16
                                        : SampleType::kFloat32,
          mapping};
}

namespace {

constexpr double kMostFloat = std::numeric_limits<float>::max(), kLeastFloat = std::numeric_limits<float>::min();

// Samples that no float32 holds, and what makes them fit; "": it holds them all, but for their last digits.
std::string BeyondFloat(const FloatReach& reach) {
  const auto& [count, beyond, greatest] = reach;
  const int digits = greatest > 0 ? int(std::floor(std::log10(greatest))) : 0;
  if (beyond > 0) {
    return fmt::format("{} of {} values are beyond those of float32 (3.4e38) and are not shown: divide the values, by 1e{} for example",
                       beyond, count, digits);
  }
  if (greatest > 0 && greatest < kLeastFloat) {
    return fmt::format("the largest value, {:g}, is too small for float32 (1.2e-38): multiply the values, by 1e{} for example", greatest,
                       -digits);
  }
  return "";
}

}  // namespace

void FloatReach::Add(std::span<const double> samples) {
  count += samples.size();
  for (const double sample : samples) {
    const double magnitude = std::abs(sample);
    if (!std::isfinite(magnitude)) continue;
    if (magnitude > kMostFloat) ++beyond;
    greatest = std::max(greatest, magnitude);
  }
}

std::string RoundingText(SampleType type, const ExactSamples* labels, const FloatReach& reach) {
  return VisitSampleType(type, [&]<class T>(const T*) {
    if constexpr (!std::is_integral_v<T>) {
      if (std::string beyond = BeyondFloat(reach); !beyond.empty()) return beyond;
      return fmt::format("pictures show values of type {} rounded to float32, and none beyond 3.4e38; conversions are exact",
                         ToString(type));
    } else {
      std::string values = fmt::format("values of type {}", ToString(type));
      if (labels != nullptr) {
        const auto [least, greatest] =
            std::ranges::minmax(std::span(reinterpret_cast<const T*>(labels->bytes.data()), labels->bytes.size() / sizeof(T)));
        values = fmt::format("values from {} to {}", least, greatest);
      }
      return values +
             " are rounded to float32 for pictures, so that labels above 16777216 may look alike; values at points, layers and "
             "conversions are exact";
    }
  });
}

}  // namespace slabstream
