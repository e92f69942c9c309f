// The slabs plane: voxels, from the coordinator (ROUTER) to workers (DEALER), pulled chunk by chunk.
//
// The samples of a box (x fastest) are cut into chunks of kChunkBytes; the last one is shorter. A worker requests chunks one by one and
// never has more bytes outstanding than its credit. Each request is the credit for its answer, so bytes in flight are bounded at both ends,
// and a lost message is requested again. The coordinator keeps no state about it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/base/status.h"
#include "common/wire/control_messages.h"
#include "common/wire/ids.h"

namespace slabstream {

inline constexpr std::uint32_t kChunkBytes = 1U << 20;  // multiple of every sample size

inline std::uint32_t ChunkCount(const Box& box, ScalarType type) {
  const std::uint64_t bytes = std::uint64_t(box.voxel_count()) * BytesPerSample(type);
  return std::uint32_t((bytes + kChunkBytes - 1) / kChunkBytes);
}
// Of samples in chunk `chunk`, below ChunkCount.
inline std::uint32_t BytesOfChunk(const Box& box, ScalarType type, std::uint32_t chunk) {
  const std::uint64_t total = std::uint64_t(box.voxel_count()) * BytesPerSample(type);
  return std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - std::uint64_t{chunk} * kChunkBytes));
}

struct ChunkRequest {
  Epoch epoch = 0;
  WorkerId worker = 0;
  DatasetId dataset = 0;
  Box box;                  // not empty
  std::uint32_t chunk = 0;  // [0, ChunkCount)
  friend bool operator==(const ChunkRequest&, const ChunkRequest&) = default;
};

struct Chunk {  // payload: the packed samples
  Epoch epoch = 0;
  DatasetId dataset = 0;
  Box box;
  std::uint32_t chunk = 0;
  Codec codec = Codec::kRaw;        // kZstd: plain zstd of the samples, bytes not grouped
  std::uint32_t raw_bytes = 0;      // after unpacking, [1, kChunkBytes]
  std::uint32_t encoded_bytes = 0;  // length of the payload frame
  std::uint64_t digest = 0;         // XXH3-64 of the unpacked bytes
  friend bool operator==(const Chunk&, const Chunk&) = default;
};

struct ChunkRefused {
  Epoch epoch = 0;
  DatasetId dataset = 0;
  Box box;
  std::uint32_t chunk = 0;
  Status status;  // not ok: no such dataset, box outside the volume
  friend bool operator==(const ChunkRefused&, const ChunkRefused&) = default;
};

}  // namespace slabstream
