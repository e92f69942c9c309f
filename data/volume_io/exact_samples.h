// Exact samples: those of a file in the type that they have there. Kept samples (data/open/read_volume.h) of more than 16 bits may be
// rounded to float32, which is enough for pictures, but makes one of two labels above 2^24. What writes volumes, tells values or tells
// labels apart takes exact samples: of a volume in memory (LevelInMemory::exact), or of a source (BoxRoom::exact).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "common/memory/aligned_buffer.h"
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

// Samples of 32 or 64 bits as uint16, if all are whole numbers within a stretch of 65536. They are aligned.
std::optional<KeptSamples> ShiftedToUint16(SampleType type, std::span<const std::byte> samples);

// Aligned samples of `type` in this machine's byte order, as they are kept. Types of the same size are converted in place, and `bytes`
// taken over; others need the memory of the kept samples on top. `bytes` of types that may be rounded stay as they are.
KeptSamples KeepBeside(SampleType type, AlignedVector<std::byte>& bytes);

// `sample` need not be aligned.
ExactValue ExactValueOf(const ExactType& of, const std::byte* sample);

// How far samples of float64 reach, of which float32 holds those up to 3.4e38.
struct FloatReach {
  std::size_t count = 0, beyond = 0;
  double greatest = 0;  // magnitude

  void Add(std::span<const double> samples);
};

// What is said of a volume of this type, of which float32 rounds some values. `labels`: its whole numbers, if somebody has them. `reach`:
// of its floats.
std::string RoundingText(SampleType type, const ExactSamples* labels = nullptr, const FloatReach& reach = {});

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
