// The sample types that volume files hold, and how they become the three types that are kept (volume_reader.h says which becomes which).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/base/aligned_buffer.h"
#include "common/volume/volume.h"

namespace slabstream {

enum class SampleType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat32, kFloat64 };

std::string_view ToString(SampleType type);                        // "int16"
std::optional<SampleType> SampleTypeNamed(std::string_view name);  // the inverse
std::string SampleTypeNames();                                     // "int8, uint8, ..."
std::size_t BytesPerSample(SampleType type);
std::string ValuesOf(SampleType type);  // "whole numbers from 0 to 255"

// Calls `function` with a null pointer of the type's C++ type: const std::int8_t* ... const double*.
template <class Function>
decltype(auto) VisitSampleType(SampleType type, Function&& function) {
  switch (type) {
    case SampleType::kInt8: return function(static_cast<const std::int8_t*>(nullptr));
    case SampleType::kUint8: return function(static_cast<const std::uint8_t*>(nullptr));
    case SampleType::kInt16: return function(static_cast<const std::int16_t*>(nullptr));
    case SampleType::kUint16: return function(static_cast<const std::uint16_t*>(nullptr));
    case SampleType::kInt32: return function(static_cast<const std::int32_t*>(nullptr));
    case SampleType::kUint32: return function(static_cast<const std::uint32_t*>(nullptr));
    case SampleType::kInt64: return function(static_cast<const std::int64_t*>(nullptr));
    case SampleType::kUint64: return function(static_cast<const std::uint64_t*>(nullptr));
    case SampleType::kFloat32: return function(static_cast<const float*>(nullptr));
    case SampleType::kFloat64: break;
  }
  return function(static_cast<const double*>(nullptr));
}

// Turns samples between big and little endian, in place. `bytes` holds whole samples.
void SwapByteOrder(SampleType type, AlignedVector<std::byte>& bytes);

struct KeptSamples {
  ScalarType type = ScalarType::kUint8;
  double shift = 0;   // value in the file = stored sample + shift
  bool exact = true;  // every value of the file is kept exactly
  AlignedVector<std::byte> bytes;
};

// Takes over `bytes`: aligned samples of `type` in this machine's byte order. Types of the same size are converted in place; wider ones
// need the memory of the kept samples on top.
KeptSamples Keep(SampleType type, AlignedVector<std::byte> bytes);

// How samples of type T are kept by those who do not see all values first, so that the type alone decides: int8 and int16 are shifted into
// the unsigned type; integers of more bits and float64 become float32.
template <class T>
struct KeptByType {
  static constexpr bool kShifted = std::is_same_v<T, std::int8_t> || std::is_same_v<T, std::int16_t>;
  static constexpr bool kSame = kShifted || std::is_same_v<T, std::uint8_t> || std::is_same_v<T, std::uint16_t>;
  using Kept = std::conditional_t<!kSame, float, std::conditional_t<sizeof(T) == 1, std::uint8_t, std::uint16_t>>;

  static constexpr double kShift = kShifted ? double(std::numeric_limits<T>::min()) : 0;  // value in the file = kept sample + shift
  static constexpr Kept Keep(T sample) {
    if constexpr (kShifted) {
      // Adding half of the type's range, modulo that range, turns the sign bit around.
      return Kept(Kept(sample) ^ Kept(Kept{1} << (8 * sizeof(T) - 1)));
    } else {
      return Kept(sample);
    }
  }
};

struct KeptType {
  ScalarType type = ScalarType::kUint8;
  double shift = 0;  // value in the file = kept sample + shift
};
KeptType KeptTypeOf(SampleType type);

}  // namespace slabstream
