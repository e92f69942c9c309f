#include "data/volume_io/exact_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
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
template <class T>
std::string BeyondFloat(std::span<const T> samples) {
  std::size_t beyond = 0;
  double greatest = 0;
  for (const T sample : samples) {
    const double magnitude = std::abs(double(sample));
    if (!std::isfinite(magnitude)) continue;
    if (magnitude > kMostFloat) ++beyond;
    greatest = std::max(greatest, magnitude);
  }
  const int digits = greatest > 0 ? int(std::floor(std::log10(greatest))) : 0;
  if (beyond > 0) {
    return fmt::format("{} of {} values are beyond those of float32 (3.4e38) and are not shown: divide the values, by 1e{} for example",
                       beyond, samples.size(), digits);
  }
  if (greatest > 0 && greatest < kLeastFloat) {
    return fmt::format("the largest value, {:g}, is too small for float32 (1.2e-38): multiply the values, by 1e{} for example", greatest,
                       -digits);
  }
  return "";
}

}  // namespace

std::string RoundingText(SampleType type, const ExactSamples* all) {
  return VisitSampleType(type, [&]<class T>(const T*) {
    const auto samples =
        all == nullptr ? std::span<const T>() : std::span(reinterpret_cast<const T*>(all->bytes.data()), all->bytes.size() / sizeof(T));
    if constexpr (!std::is_integral_v<T>) {
      if (std::string beyond = BeyondFloat(samples); !beyond.empty()) return beyond;
      return fmt::format("pictures show values of type {} rounded to float32, and none beyond 3.4e38; conversions are exact",
                         ToString(type));
    } else {
      std::string values = fmt::format("values of type {}", ToString(type));
      if (all != nullptr) {
        const auto [least, greatest] = std::ranges::minmax(samples);
        values = fmt::format("values from {} to {}", least, greatest);
      }
      return values +
             " are rounded to float32 for pictures, so that labels above 16777216 may look alike; values at points, layers and "
             "conversions are exact";
    }
  });
}

}  // namespace slabstream
