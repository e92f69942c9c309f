// Arrays whose chunks are pieces of one file: they are read by position, many at a time, and decoded by our own codecs. And arrays in
// memory.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "data/codecs/codec.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"

namespace slabstream {

// A chunk in the file.
struct FilePiece {
  std::uint64_t begin = 0, bytes = 0;
  CodecChain codecs = {};           // how it is packed
  std::uint64_t decoded_bytes = 0;  // what it decodes to
};

// Where the chunk with this index lies. nullopt: it was never written. DataLoss. On a decoding thread, since an index may have to be read.
using FindPiece = std::function<Result<std::optional<FilePiece>>(std::span<const std::uint64_t> index)>;

// `named`: the file and the array, for messages: "a.h5: dataset '/x'".
std::shared_ptr<ChunkedArray> MakeFileArray(const std::string& path, const std::string& named, ArrayShape shape, FindPiece find,
                                            const SourceContext& context);

// Samples that are not packed.
struct PlainSamples {
  std::optional<std::uint64_t> begin;  // where in the file they begin; nullopt: they were never written
  // From one index along the first axis to the next; 0: all samples lie in one piece.
  std::uint64_t record_bytes = 0;
  bool big_endian = false;
};

// Chunks are slices of at most this, or one row.
inline constexpr std::uint64_t kFileSliceBytes = std::uint64_t{1} << 20;

// `shape`: its size, type and fill are set.
std::shared_ptr<ChunkedArray> MakePlainArray(const std::string& path, const std::string& named, ArrayShape shape,
                                             const PlainSamples& samples, const SourceContext& context);

// `elements`: of the array's only chunk, in this machine's byte order.
std::shared_ptr<ChunkedArray> MakeHeldArray(ArrayShape shape, Bytes elements);

}  // namespace slabstream
