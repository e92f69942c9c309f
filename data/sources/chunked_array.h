// ChunkedArray: what a format knows of one array that is stored in chunks, such as one level of a pyramid. A format reads metadata, finds
// chunks and decodes them; ChunkedSource makes boxes of voxels of them, whatever the format.
//
// The array has any number of axes. Element order within a chunk: the last axis varies fastest ("C order"); what a format stores in another
// order it says as another order of axes. Chunks lie at multiples of `chunk`; those at the end reach beyond the array, or are cut off there
// (`cut_at_end`).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "data/stores/store.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

inline constexpr std::size_t kMaxArrayAxes = 8;
inline constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 30;  // bytes of a decoded chunk

struct ArrayShape {
  std::vector<std::uint64_t> size;  // elements along each axis, each at least 1; at most kMaxArrayAxes axes
  // Elements of a chunk along each axis, each at least 1; all of them together take at most kMostChunkBytes.
  std::vector<std::uint64_t> chunk;
  SampleType type = SampleType::kUint8;
  bool cut_at_end = false;
  std::vector<std::byte> fill = {};  // one element, in this machine's byte order: of chunks that are not there

  std::uint64_t chunk_bytes() const {  // bytes of a whole chunk, decoded
    std::uint64_t bytes = BytesPerSample(type);
    for (const std::uint64_t along : chunk) bytes *= along;
    return bytes;
  }
};

// A chunk as it was read.
struct StoredChunk {
  Bytes elements;                  // decoded, in this machine's byte order
  std::uint64_t stored_bytes = 0;  // bytes that the store gave for it
};

class ChunkedArray {
 public:
  ChunkedArray() = default;
  virtual ~ChunkedArray() = default;
  ChunkedArray(const ChunkedArray&) = delete;
  ChunkedArray& operator=(const ChunkedArray&) = delete;

  virtual const ArrayShape& shape() const = 0;

  // The name of the object that holds a chunk, of those that may be missing; "": of none.
  virtual std::string NameOf(std::span<const std::uint64_t> /*index*/) const { return ""; }

  // nullopt: the chunk is not there, so all its elements are `fill`.
  using ChunkDone = std::function<void(Result<std::optional<StoredChunk>>)>;
  // Calls `done` exactly once, on any thread, perhaps before this returns. What `done` does takes as long as decoding, so it is called on a
  // decoding thread (DecodeOn, decode_chunk.h), not on one of a store. `index`: of the chunk along each axis, inside the array. Any thread.
  // Unavailable: it cannot be read. DataLoss: it is damaged, or has another number of bytes. Both name store, object and cause. Cancelled:
  // as of Store::Read.
  virtual void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted wanted = {}) = 0;
};

}  // namespace slabstream
