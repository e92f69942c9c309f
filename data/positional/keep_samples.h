// From samples as a file has them to those that are kept, wherever either lie in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/math/vec.h"
#include "common/volume/volume.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

// Samples of a box in memory. They need not be aligned.
template <class Byte>
struct PlacedSamples {
  Byte* first = nullptr;
  std::array<std::int64_t, 3> steps{};  // bytes from a sample to the next one along each axis; may be negative
};

// How samples of a type are kept whose values nobody has seen: int8 and int16 shifted into the unsigned type; integers of more bits
// and float64 as float32.
struct KeptSampleType {
  ScalarType type = ScalarType::kUint8;
  double shift = 0;  // value in the file = kept sample + shift
};
KeptSampleType KeptSampleTypeOf(SampleType type);

// Converts the samples of a box of `size` voxels. `swapped`: those of the file are in the other byte order than this
// machine's.
void KeepSamples(SampleType type, bool swapped, const Index3& size, const PlacedSamples<const std::byte>& from,
                 const PlacedSamples<std::byte>& to);

}  // namespace slabstream
