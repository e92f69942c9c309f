// Volumes to files. Any thread.
#pragma once

#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/volume/volume.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/file_samples.h"

namespace slabstream {

struct WriteOptions {
  std::optional<SampleType> type;  // of the samples in the file; none: see FileSamples
  WriteProgress progress;
  const ExactSamples* exact = nullptr;  // of the volume, which are written; null: there are none
};

// Writes the format that the ending names (formats.h; .mhd: with a .raw beside it). Files have no value mapping, but the data values
// themselves: samples that were read from int8 or int16 become that type again, others of a mapping by whole numbers the smallest integer
// type that holds them, and the rest float32. An older file is replaced only by a complete one (common/base/files.h). Takes a few MiB of
// memory. InvalidArgument: another ending, or a data value that does not fit options.type. Unavailable: cannot be written; the message says
// why.
Status WriteVolume(const Volume& volume, const std::string& path, const WriteOptions& options = {});

}  // namespace slabstream
