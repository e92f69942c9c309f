// The voxels plane: voxels and cells, from the coordinator (ROUTER) to workers (DEALER), pulled chunk by chunk.
//
// The samples of a box (x fastest) are cut into chunks of kChunkBytes; the last one is shorter. A worker requests chunks one by one and
// never has more bytes outstanding than its credit. Each request is the credit for its answer, so bytes in flight are bounded at both ends,
// and a lost message is requested again. The coordinator keeps no state about it.
//
// The cells of a box (EncodeMesh, common/mesh/mesh_part.h) have chunks of their own, numbered from kFirstCellChunk on. How many there are
// is not known before one of them says it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <variant>

#include "common/base/check.h"
#include "common/volume/sample_types.h"
#include "common/wire/ids.h"
#include "common/wire/voxels_structs.h"

namespace slabstream {

inline constexpr std::uint32_t kChunkBytes = 1U << 20;  // multiple of every sample size
inline constexpr std::uint32_t kFirstCellChunk = 1U << 31;
inline constexpr std::uint64_t kMaxCellBytes = std::uint64_t{1} << 40;

constexpr bool IsCellChunk(std::uint32_t chunk) { return chunk >= kFirstCellChunk; }
// Cells of a box that take so many bytes, in [1, kMaxCellBytes].
constexpr std::uint32_t CellChunkCount(std::uint64_t cell_bytes) { return std::uint32_t((cell_bytes + kChunkBytes - 1) / kChunkBytes); }
constexpr std::uint64_t BeginOfCellChunk(std::uint32_t chunk) { return std::uint64_t{chunk - kFirstCellChunk} * kChunkBytes; }
// Bytes of a chunk below kFirstCellChunk + CellChunkCount.
constexpr std::uint32_t BytesOfCellChunk(std::uint64_t cell_bytes, std::uint32_t chunk) {
  return std::uint32_t(std::min<std::uint64_t>(kChunkBytes, cell_bytes - BeginOfCellChunk(chunk)));
}

// Where the samples of a chunk belong: bytes [begin, begin + bytes) of the box's samples.
struct ChunkPart {
  std::uint64_t begin = 0;
  std::uint32_t bytes = 0;
};

inline std::uint64_t BytesOfBox(const Box& box, ScalarType type) { return std::uint64_t(box.voxel_count()) * BytesPerSample(type); }
// Chunks of the samples.
inline std::uint32_t ChunkCount(const Box& box, ScalarType type) {
  return std::uint32_t((BytesOfBox(box, type) + kChunkBytes - 1) / kChunkBytes);
}
// The part of the samples that is in a chunk below ChunkCount.
inline ChunkPart PartOfChunk(const Box& box, ScalarType type, std::uint32_t chunk) {
  const std::uint64_t begin = std::uint64_t{chunk} * kChunkBytes, total = BytesOfBox(box, type);
  CHECK(begin < total) << "chunk " << chunk << " of " << ChunkCount(box, type);
  return {begin, std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - begin))};
}

using WorkerToVoxels = std::variant<ChunkRequest>;
using VoxelsToWorker = std::variant<Chunk, ChunkRefused>;

}  // namespace slabstream
