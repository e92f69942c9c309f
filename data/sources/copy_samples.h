// Samples of an array in any order of its axes become those of a box of voxels: x fastest, of a type that volumes keep, or as they are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/math/vec.h"
#include "common/volume/volume.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

// How samples of a type are kept when nobody has seen all of them: int8 and int16 shifted into the unsigned type, wider integers and
// float64 as float32.
struct KeptType {
  ScalarType type = ScalarType::kUint8;
  double shift = 0;  // value in the array = kept sample + shift
};
KeptType KeptTypeOf(SampleType type);

// Bytes of a sample that CopySamples writes: as it is, if `exact`, or as KeptTypeOf(type) keeps it.
std::size_t CopiedBytes(SampleType type, bool exact);

// For each voxel v in [0, count): the sample of `to` at v.z * slice + v.y * row + v.x = the one at from[v.x * steps[0] + v.y * steps[1] +
// v.z * steps[2]]. Steps are in samples; they may be negative, and one of 0 repeats a sample. Neither pointer needs to be aligned. The two
// do not overlap.
void CopySamples(SampleType type, const std::byte* from, const std::array<std::int64_t, 3>& steps, const Index3& count, const BoxRoom& to);

}  // namespace slabstream
