// Codecs of chunks: how the bytes of a chunk are packed in its store. A chain is applied from its first codec to its last one when a chunk
// is written; decoding goes the other way.
//
// Pure. Any thread. Decoders take no more memory than `most`, whatever the bytes say, and check that before they take it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"

namespace slabstream {

class ChunkCodec {
 public:
  // What Decode does.
  using Decoder = std::function<Result<Bytes>(Bytes packed, std::uint64_t most)>;
  // `decoded_each`, `encoded_each`: bytes of an element decoded and as it is packed, of codecs that change its type.
  explicit ChunkCodec(Decoder decode, std::size_t decoded_each = 1, std::size_t encoded_each = 1)
      : decode_(std::move(decode)), decoded_each_(decoded_each), encoded_each_(encoded_each) {}

  // DataLoss: the bytes are damaged. ResourceExhausted: they say that they hold more than `most`.
  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const { return decode_(std::move(packed), most); }

  // The most bytes of which `bytes` decoded ones are made, if what packs them packs well. Codecs add checksums and headers.
  std::uint64_t MostEncoded(std::uint64_t bytes) const { return bytes / decoded_each_ * encoded_each_ + 4096; }

 private:
  const Decoder decode_;
  const std::size_t decoded_each_, encoded_each_;
};

using CodecChain = std::vector<std::shared_ptr<const ChunkCodec>>;  // in the order in which a writer applies them

// The same of a chain.
std::uint64_t MostEncoded(const CodecChain& chain, std::uint64_t bytes);

// Exactly `bytes` decoded bytes. DataLoss: damaged, or another number of bytes.
Result<Bytes> DecodeChain(const CodecChain& chain, Bytes packed, std::uint64_t bytes);

}  // namespace slabstream
