// Writes a volume as OME-Zarr, with levels, in a bounded amount of memory and on all cores.
//
// Regions are written depth first: a region of a level follows those of the level before that it is made of, whose voxels are then still in
// memory. So each voxel of the source is read once. Files appear whole (zarr_objects.h); the metadata that makes an image of the folder
// come last, and a file ".slabstream-conversion" says before that what is being written. A conversion that was stopped or killed goes on
// where it was: a region that is there is finished, and so is all that it was made of.
//
// The same source and layout give the same bytes, whatever the number of threads, the memory, and how often it was stopped.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "data/sources/volume_source.h"
#include "data/zarr_writer/ome_metadata.h"

namespace slabstream {

struct OmeZarrProgress {
  std::uint64_t done_bytes = 0, all_bytes = 0;  // bytes of the elements of all levels
  int level = 0;                                // the level of the region that was finished last
};

struct OmeZarrOptions {
  OmeZarrVersion version = OmeZarrVersion::k05;
  std::int32_t chunk_side = 64;   // voxels, [8, 512]
  std::int32_t shard_side = 256;  // voxels: a multiple of chunk_side, even, at most 4096. In version 0.4: what is written at a time
  // The source is read in this order. A shard is then a slab of as many slices as a chunk has, and shard_side says nothing.
  std::optional<SliceOrder> slices = {};
  std::int32_t coarsest_side = 0;                 // the last level is no longer than this along any axis, [8, 512]; 0: chunk_side
  int codec_level = 3;                            // zstd's level, [1, 19]
  std::uint64_t memory = std::uint64_t{1} << 30;  // bytes, beside what the source takes
  std::string source;                             // what the user calls it: another one does not go on with its conversion
  std::stop_token stop;
  std::function<void(const OmeZarrProgress&)> progress;  // called first, and after each region, on the calling thread
};

// Bytes of memory that WriteOmeZarr takes at least, beside what the source takes. More than that is used to read ahead. The options are
// right.
std::uint64_t LeastMemoryFor(const SourceInfo& source, const OmeZarrOptions& options);

// Level 0 is that of the source; the others are made here (PlanLevels, Reduce). `folder` is made; it may be there if it is empty or holds
// an unfinished conversion of the same source with the same layout. InvalidArgument: an option is out of range; the folder holds something
// else. ResourceExhausted: `memory` is too small; says how much is needed. Unavailable: a file cannot be written, a finished one cannot be
// read, or the source has changed meanwhile. DataLoss: a finished file is damaged. Cancelled: it was stopped. Errors of VolumeSource::Read.
Status WriteOmeZarr(VolumeSource& source, const std::string& folder, const OmeZarrOptions& options);

}  // namespace slabstream
