// A volume's data values as samples of one type of file: what writers write. Converted a block at a time, so that writing takes no memory
// for a second copy of the volume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "common/base/status.h"
#include "common/volume/volume.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

// Called after each block with the bytes of samples that are written, and all there are.
using WriteProgress = std::function<void(std::int64_t done, std::int64_t all)>;

class FileSamples {
 public:
  // The volume and its exact samples, if any (else null), must outlive what is made. Without `type`: the type that the samples were read
  // from if that is known to hold the data values, else the smallest integer type that holds them, else float32, or float64 of exact
  // samples. With it InvalidArgument, naming the value and the voxel: the type does not hold a data value (floats hold rounded ones), or is
  // float16. InvalidArgument: the grid is rectilinear.
  static Result<FileSamples> Of(const Volume& volume, const ExactSamples* exact, std::optional<SampleType> type,
                                WriteProgress progress = {});

  const VolumeGeometry& geometry() const { return volume_->description.geometry; }
  SampleType type() const { return type_; }
  std::int64_t bytes() const { return geometry().bounds().voxel_count() * std::int64_t(BytesPerSample(type_)); }

  // Calls `sink` with all samples, x fastest, little endian, in blocks of at most kBlockBytes.
  void ForEachBlock(const std::function<void(std::span<const std::byte>)>& sink) const;
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

 private:
  FileSamples(const Volume& volume, const ExactSamples* exact, SampleType type, WriteProgress progress)
      : volume_(&volume), exact_(exact), type_(type), progress_(std::move(progress)) {}

  const Volume* volume_;
  const ExactSamples* exact_;
  SampleType type_;
  WriteProgress progress_;
};

}  // namespace slabstream
