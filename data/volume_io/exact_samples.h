// Exact samples: those of a file in the type that they have there. Kept samples (volume_reader.h) of more than 16 bits may be rounded to
// float32, which is enough for pictures, but makes one of two labels above 2^24. What writes volumes, tells values or tells labels apart
// takes exact samples: of a volume in memory (LoadedVolume::exact), or of a source (BoxRoom::exact).
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/base/aligned_buffer.h"
#include "common/volume/exact_value.h"
#include "common/volume/volume.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

struct ExactType {
  SampleType type = SampleType::kUint8;
  ValueMapping mapping = {};  // from these samples to data values
};

struct ExactSamples {
  ExactType of;
  AlignedVector<std::byte> bytes;  // the samples of all voxels of the volume, x fastest
};

// Whether float32 rounds some of its values.
constexpr bool MayBeRounded(SampleType type) {
  return type == SampleType::kInt32 || type == SampleType::kUint32 || type == SampleType::kInt64 || type == SampleType::kUint64 ||
         type == SampleType::kFloat64;
}
// Whether these are whole numbers that may be rounded, of which the least difference counts: they may be labels.
constexpr bool MayRoundLabels(SampleType type) { return MayBeRounded(type) && type != SampleType::kFloat64; }

// Whether float32 holds all these samples, which are aligned.
bool AllFitFloat(SampleType type, std::span<const std::byte> samples);

// As Keep, but `bytes` of types that may be rounded stay as they are.
KeptSamples KeepBeside(SampleType type, AlignedVector<std::byte>& bytes);

// `sample` need not be aligned.
ExactValue ExactValueOf(const ExactType& of, const std::byte* sample);

// What is said of a volume of this type, of which float32 rounds some values. `all`: its samples, if somebody has them.
std::string RoundingText(SampleType type, const ExactSamples* all = nullptr);

// The type of the exact samples of a volume or, if there are none (null), of those of its block.
ExactType BestType(const Volume& volume, const ExactSamples* exact);
// Calls function(samples, mapping) with a pointer to these samples, in their C++ type, and the mapping from them to data values.
template <class Function>
decltype(auto) VisitBestSamples(const Volume& volume, const ExactSamples* exact, Function&& function) {
  if (exact != nullptr) {
    return VisitSampleType(exact->of.type,
                           [&]<class T>(const T*) { return function(reinterpret_cast<const T*>(exact->bytes.data()), exact->of.mapping); });
  }
  return VisitScalarType(volume.block.type,
                         [&]<class T>(const T*) { return function(volume.block.samples<T>(), volume.description.mapping); });
}

}  // namespace slabstream
