// The sample types that volume files hold, and how they become the three types that are kept (data/open/read_volume.h says which becomes
// which).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/memory/aligned_buffer.h"
#include "common/volume/volume.h"
#include "data/volume_io/half.h"

namespace slabstream {

enum class SampleType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat32, kFloat64, kFloat16 };

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
    case SampleType::kFloat16: return function(static_cast<const Half*>(nullptr));
    case SampleType::kFloat32: return function(static_cast<const float*>(nullptr));
    case SampleType::kFloat64: break;
  }
  return function(static_cast<const double*>(nullptr));
}

// Turns samples between big and little endian, in place. `bytes` holds whole samples.
void SwapByteOrder(SampleType type, std::span<std::byte> bytes);

struct KeptSamples {
  ScalarType type = ScalarType::kUint8;
  double shift = 0;   // value in the file = stored sample + shift
  bool exact = true;  // every value of the file is kept exactly
  AlignedVector<std::byte> bytes;
};

}  // namespace slabstream
