// Codecs of chunks: how the bytes of a chunk are packed in its store. A chain is applied from its first codec to its last one when a chunk
// is written; decoding goes the other way.
//
// Pure. Any thread. Decoders take no more memory than `most`, whatever the bytes say, and check that before they take it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"

namespace slabstream {

class ChunkCodec {
 public:
  ChunkCodec() = default;
  virtual ~ChunkCodec() = default;
  ChunkCodec(const ChunkCodec&) = delete;
  ChunkCodec& operator=(const ChunkCodec&) = delete;

  // DataLoss: the bytes are damaged. ResourceExhausted: they say that they hold more than `most`.
  virtual Result<Bytes> Decode(Bytes packed, std::uint64_t most) const = 0;

  // The most bytes of which `bytes` decoded ones are made, if what packs them packs well. Codecs add checksums and headers.
  virtual std::uint64_t MostEncoded(std::uint64_t bytes) const { return bytes + 4096; }
};

using CodecChain = std::vector<std::shared_ptr<const ChunkCodec>>;  // in the order in which a writer applies them

// The same of a chain.
std::uint64_t MostEncoded(const CodecChain& chain, std::uint64_t bytes);

// Exactly `bytes` decoded bytes. DataLoss: damaged, or another number of bytes.
Result<Bytes> DecodeChain(const CodecChain& chain, Bytes packed, std::uint64_t bytes);

}  // namespace slabstream
