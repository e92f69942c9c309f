#include "data/volume_io/exact_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
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

std::string RoundingText(SampleType type, const ExactSamples* all) {
  return VisitSampleType(type, [&]<class T>(const T*) {
    if constexpr (!std::is_integral_v<T>) {
      return fmt::format("pictures show values of type {} rounded to float32; conversions are exact", ToString(type));
    } else {
      std::string values = fmt::format("values of type {}", ToString(type));
      if (all != nullptr) {
        const auto [least, greatest] =
            std::ranges::minmax(std::span(reinterpret_cast<const T*>(all->bytes.data()), all->bytes.size() / sizeof(T)));
        values = fmt::format("values from {} to {}", least, greatest);
      }
      return values +
             " are rounded to float32 for pictures, so that labels above 16777216 may look alike; values at points, layers and "
             "conversions are exact";
    }
  });
}

}  // namespace slabstream
