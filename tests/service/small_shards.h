// WriteSmallShards: a store that has many chunks of few voxels.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/base/check.h"
#include "common/volume/volume.h"
#include "data/zarr_writer/ome_zarr_writer.h"
#include "tests/data/sources/memory_source.h"

namespace slabstream {

// In place of what is at `path`: chunks of 16 voxels a side, in shards of 32.
inline void WriteSmallShards(const std::shared_ptr<const Volume>& volume, const std::string& path) {
  std::filesystem::remove_all(path);
  OmeZarrOptions options;
  options.chunk_side = 16;
  options.shard_side = 32;
  const Status written = WriteOmeZarr(*MakeMemorySource(volume, {.format = "NRRD", .file_type = "uint8"}), path, options);
  CHECK(written.ok()) << written.message();
}

}  // namespace slabstream
