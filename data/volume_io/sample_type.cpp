#include "data/volume_io/sample_type.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "data/volume_io/exact_samples.h"

namespace slabstream {
namespace {

// In the order of SampleType.
constexpr std::array<std::string_view, 11> kTypeNames = {"int8",  "uint8",  "int16",   "uint16",  "int32",  "uint32",
                                                         "int64", "uint64", "float32", "float64", "float16"};
constexpr std::array<std::size_t, 11> kBytes = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 2};

template <class T>
std::span<T> SamplesOf(AlignedVector<std::byte>& bytes) {
  return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
}

// Adding half of the type's range to a two's complement integer, modulo that range, turns its sign bit around.
template <class Signed, class Unsigned>
KeptSamples ShiftSign(AlignedVector<std::byte> bytes, ScalarType type) {
  constexpr auto kSignBit = Unsigned(Unsigned{1} << (8 * sizeof(Unsigned) - 1));
  for (Unsigned& sample : SamplesOf<Unsigned>(bytes)) sample = Unsigned(sample ^ kSignBit);
  return {type, double(std::numeric_limits<Signed>::min()), true, std::move(bytes)};
}

template <class T>
bool ExactAsFloat(T value) {
  const auto rounded = float(value);
  if constexpr (!std::is_integral_v<T>) {
    return double(rounded) == value || std::isnan(value);
  } else {
    // Rounding up may lead out of the integer's range, where converting back is undefined.
    return rounded < std::ldexp(1.0F, std::numeric_limits<T>::digits) && T(rounded) == value;
  }
}

template <class T>
bool IsInteger(T value) {
  if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value) && std::trunc(value) == value;
  } else {
    return true;
  }
}

// As uint16 if all are integers within a stretch of 65536.
template <class T>
std::optional<KeptSamples> Shifted(std::span<const T> samples) {
  using Wide = std::conditional_t<std::is_same_v<T, float>, double, T>;  // sums of floats are not exact
  constexpr Wide kSpan = 65535;
  Wide low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::lowest();
  for (const Wide sample : samples) {
    if (!IsInteger(sample)) return std::nullopt;
    low = std::min(low, sample);
    high = std::max(high, sample);
  }
  // Compare without subtracting, which could overflow.
  if (low < std::numeric_limits<T>::max() - kSpan && high > low + kSpan) return std::nullopt;
  const Wide shift = low >= 0 && high <= kSpan ? Wide{0} : low;
  // shift + sample is computed as double.
  const bool exact = std::is_floating_point_v<T> || std::max(std::abs(double(low)), std::abs(double(high))) < 0x1p53;
  KeptSamples kept{ScalarType::kUint16, double(shift), exact, {}};
  kept.bytes.resize(samples.size() * sizeof(std::uint16_t));
  const std::span<std::uint16_t> out = SamplesOf<std::uint16_t>(kept.bytes);
  for (std::size_t i = 0; i < samples.size(); ++i) out[i] = std::uint16_t(samples[i] - shift);
  return kept;
}

// Narrows samples of 32 and 64 bits: to uint16 if they fit, else to float.
template <class T>
KeptSamples Narrow(AlignedVector<std::byte>& bytes) {
  const std::span<const T> samples = SamplesOf<T>(bytes);
  if (std::optional<KeptSamples> shifted = Shifted(samples)) return *std::move(shifted);
  KeptSamples kept{.type = ScalarType::kFloat32};
  kept.bytes.resize(samples.size() * sizeof(float));
  const std::span<float> out = SamplesOf<float>(kept.bytes);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    out[i] = float(samples[i]);
    kept.exact = kept.exact && ExactAsFloat(samples[i]);
  }
  return kept;
}

KeptSamples Widen(AlignedVector<std::byte> bytes) {
  const std::span<Half> halves = SamplesOf<Half>(bytes);
  KeptSamples kept{.type = ScalarType::kFloat32};
  kept.bytes.resize(halves.size() * sizeof(float));
  std::ranges::copy(halves, SamplesOf<float>(kept.bytes).begin());
  return kept;
}

}  // namespace

std::string_view ToString(SampleType type) { return kTypeNames[std::size_t(type)]; }
std::string SampleTypeNames() { return fmt::format("{}", fmt::join(kTypeNames, ", ")); }
std::size_t BytesPerSample(SampleType type) { return kBytes[std::size_t(type)]; }

std::optional<SampleType> SampleTypeNamed(std::string_view name) {
  const auto found = std::ranges::find(kTypeNames, name);
  return found == kTypeNames.end() ? std::nullopt : std::optional(SampleType(found - kTypeNames.begin()));
}

std::string ValuesOf(SampleType type) {
  return VisitSampleType(type, []<class T>(const T*) {
    using Limits = std::numeric_limits<T>;
    if constexpr (!std::is_integral_v<T>) {
      return fmt::format("numbers up to {:.6g}", double(Limits::max()));
    } else {
      return fmt::format("whole numbers from {} to {}", Limits::min(), Limits::max());
    }
  });
}

void SwapByteOrder(SampleType type, std::span<std::byte> bytes) {
  VisitSampleType(type, [&]<class T>(const T*) {  // a size that the compiler knows
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(T)) std::ranges::reverse(bytes.subspan(i).template first<sizeof(T)>());
  });
}

bool AllFitFloat(SampleType type, std::span<const std::byte> samples) {
  return VisitSampleType(type, [&]<class T>(const T*) {
    return std::ranges::all_of(std::span(reinterpret_cast<const T*>(samples.data()), samples.size() / sizeof(T)), ExactAsFloat<T>);
  });
}

std::optional<KeptSamples> ShiftedToUint16(SampleType type, std::span<const std::byte> samples) {
  return VisitSampleType(type, [&]<class T>(const T*) -> std::optional<KeptSamples> {
    if constexpr (sizeof(T) < sizeof(float))
      return std::nullopt;
    else
      return Shifted(std::span(reinterpret_cast<const T*>(samples.data()), samples.size() / sizeof(T)));
  });
}

KeptSamples KeepBeside(SampleType type, AlignedVector<std::byte>& bytes) {
  switch (type) {
    case SampleType::kUint8: return {ScalarType::kUint8, 0, true, std::move(bytes)};
    case SampleType::kUint16: return {ScalarType::kUint16, 0, true, std::move(bytes)};
    case SampleType::kFloat32: return {ScalarType::kFloat32, 0, true, std::move(bytes)};
    case SampleType::kInt8: return ShiftSign<std::int8_t, std::uint8_t>(std::move(bytes), ScalarType::kUint8);
    case SampleType::kInt16: return ShiftSign<std::int16_t, std::uint16_t>(std::move(bytes), ScalarType::kUint16);
    case SampleType::kInt32: return Narrow<std::int32_t>(bytes);
    case SampleType::kUint32: return Narrow<std::uint32_t>(bytes);
    case SampleType::kInt64: return Narrow<std::int64_t>(bytes);
    case SampleType::kUint64: return Narrow<std::uint64_t>(bytes);
    case SampleType::kFloat16: return Widen(std::move(bytes));
    case SampleType::kFloat64: break;
  }
  return Narrow<double>(bytes);
}

}  // namespace slabstream
