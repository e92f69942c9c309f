// The voxels plane: voxels and cells, from the coordinator (ROUTER) to workers (DEALER), pulled chunk by chunk.
//
// The samples of a box (x fastest) are cut into chunks of kChunkBytes; the last one is shorter. The samples of the volume come first, then
// those of each layer of the dataset, in the order of kLayers; each begins with a new chunk. A worker requests chunks one by one and never
// has more bytes outstanding than its credit. Each request is the credit for its answer, so bytes in flight are bounded at both ends,
// and a lost message is requested again. The coordinator keeps no state about it.
//
// The cells of a box (EncodeMesh, common/mesh/mesh_part.h) have chunks of their own, numbered from kFirstCellChunk on. How many there are
// is not known before one of them says it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <variant>

#include "common/base/check.h"
#include "common/volume/layers.h"
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

// Where the samples of a chunk belong: bytes [begin, begin + bytes) of the box's samples of one layer.
struct ChunkPart {
  Layer layer = Layer::kVolume;
  std::uint64_t begin = 0;
  std::uint32_t bytes = 0;
};

// Chunks of the samples.
inline std::uint32_t ChunkCount(const Box& box, const SampleTypes& types) {
  std::uint64_t count = 0;
  for (const Layer layer : kLayers) {
    if (const auto type = types.Of(layer)) {
      count += (std::uint64_t(box.voxel_count()) * BytesPerSample(*type) + kChunkBytes - 1) / kChunkBytes;
    }
  }
  return std::uint32_t(count);
}
// The part of the samples that is in a chunk below ChunkCount.
inline ChunkPart PartOfChunk(const Box& box, const SampleTypes& types, std::uint32_t chunk) {
  std::uint64_t before = std::uint64_t{chunk} * kChunkBytes;  // bytes before the chunk in this layer and those that follow
  for (const Layer layer : kLayers) {
    const auto type = types.Of(layer);
    if (!type) continue;
    const std::uint64_t total = std::uint64_t(box.voxel_count()) * BytesPerSample(*type);
    if (before < total) return {layer, before, std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - before))};
    before -= (total + kChunkBytes - 1) / kChunkBytes * kChunkBytes;
  }
  CHECK(false) << "chunk " << chunk << " of " << ChunkCount(box, types);
  return {};
}
inline std::uint32_t BytesOfChunk(const Box& box, const SampleTypes& types, std::uint32_t chunk) {
  return PartOfChunk(box, types, chunk).bytes;
}

using WorkerToVoxels = std::variant<ChunkRequest>;
using VoxelsToWorker = std::variant<Chunk, ChunkRefused>;

}  // namespace slabstream
