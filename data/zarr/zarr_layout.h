// What the metadata of a Zarr array say of how it is stored: .zarray (version 2, https://zarr-specs.readthedocs.io/en/latest/v2) or
// zarr.json (version 3, https://zarr-specs.readthedocs.io/en/latest/v3/core).
//
// Pure. Every number is checked before anything is made of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/codecs/codec.h"
#include "data/metadata/json_fields.h"
#include "data/sources/chunked_array.h"

namespace slabstream::zarr {

inline constexpr std::uint64_t kMostShardChunks = std::uint64_t{1} << 20;

// A chunk of the store's is a shard, which holds chunks and an index of them.
struct Sharding {
  std::vector<std::uint64_t> chunks;   // chunks of a shard, along each axis of `shape`
  std::vector<std::uint64_t> strides;  // from a chunk to the next one along each axis, in the index
  CodecChain index_codecs;
  std::uint64_t index_bytes = 0;  // as stored
  bool index_at_end = true;

  std::uint64_t chunk_count() const {  // at most kMostShardChunks
    std::uint64_t count = 1;
    for (const std::uint64_t along : chunks) count *= along;
    return count;
  }
};

struct ZarrLayout {
  // Its axes are in the order in which a chunk stores them, the fastest last: axis i is the axis from[i] of the metadata.
  ArrayShape shape;
  std::vector<std::size_t> from;
  CodecChain codecs;  // the codecs of a chunk
  std::optional<Sharding> sharding;
  std::string key_prefix;  // "c/", or nothing
  char key_separator = '/';
  bool separator_stated = true;              // else it may be the other one: writers of nested folders were slow to say so
  std::vector<std::string> dimension_names;  // names of the axes of `shape`, "" where there is none; empty: there are none at all

  // The name of a chunk or shard within the array's folder. `index`: of it, along each axis of `shape`.
  std::string Key(std::span<const std::uint64_t> index, char separator) const;
};

// InvalidArgument, naming the field: it is missing, wrong, or something that is not supported.
Result<ZarrLayout> ParseLayout2(const metadata::Field& metadata);
Result<ZarrLayout> ParseLayout3(const metadata::Field& metadata);

}  // namespace slabstream::zarr
