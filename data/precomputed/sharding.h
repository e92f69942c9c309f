// Shards of precomputed volumes: many chunks in one file. A hash of a chunk's number says in which shard it lies and in which part of that
// (minishard). Source: https://github.com/google/neuroglancer/blob/master/src/datasource/precomputed/sharded.md
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "data/metadata/json_fields.h"
#include "data/stores/store.h"

namespace slabstream::precomputed {

struct Sharding {
  unsigned preshift_bits = 0, minishard_bits = 0, shard_bits = 0;  // at most 64, 32 and 64 - minishard_bits
  bool murmur = false;                                             // the hash is MurmurHash3_x86_128, else the number itself
  bool gzip_index = false, gzip_data = false;

  std::uint64_t index_bytes() const { return std::uint64_t{16} << minishard_bits; }  // at the beginning of a shard
};

// InvalidArgument: not `neuroglancer_uint64_sharded_v1`, or wrong; names the field.
Result<Sharding> ParseSharding(const metadata::Field& field);

// The number of a chunk: the bits of its place along x, y and z in turn, without those that are 0 in all of a grid of so many chunks
// (compressed Morton code).
std::uint64_t ChunkNumber(const std::array<std::uint64_t, 3>& place, const std::array<std::uint64_t, 3>& counts);

struct ShardPlace {
  std::string file;  // "0a.shard"
  std::uint64_t minishard = 0;
};
ShardPlace PlaceOf(const Sharding& sharding, std::uint64_t chunk);

// Where the index of a minishard lies in the file, by its 16 bytes of the index of the shard; no bytes: it has none. DataLoss.
Result<ByteRange> MinishardRange(const Sharding& sharding, const Bytes& entry);
// Where a chunk lies in the file, by the index of its minishard as it is stored. nullopt: it is not there. DataLoss; ResourceExhausted.
Result<std::optional<ByteRange>> ChunkRange(const Sharding& sharding, Bytes index, std::uint64_t chunk);

inline constexpr std::uint64_t kMostMinishardBytes = std::uint64_t{64} << 20;

}  // namespace slabstream::precomputed
