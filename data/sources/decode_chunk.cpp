#include "data/sources/decode_chunk.h"

#include <exception>
#include <utility>

namespace slabstream {
namespace {

Result<std::optional<StoredChunk>> Decode(const CodecChain& chain, Bytes packed, std::uint64_t bytes, const std::string& what) {
  try {
    const std::uint64_t stored_bytes = packed.size();
    Result<Bytes> decoded = DecodeChain(chain, std::move(packed), bytes);
    if (!decoded.ok()) return Status(decoded.status().code(), what + ": " + decoded.status().message());
    return std::optional(StoredChunk{*std::move(decoded), stored_bytes});
  } catch (const std::exception& error) {
    return Status::ResourceExhausted(what + ": cannot be decoded: " + error.what());
  }
}

}  // namespace

void DecodeOn(const SourceContext& context, CodecChain chain, Result<Bytes> answer, std::uint64_t bytes, std::string what,
              ChunkedArray::ChunkDone done) {
  if (!answer.ok()) {
    if (answer.status().code() == StatusCode::kNotFound) return done(std::optional<StoredChunk>());
    return done(answer.status());
  }
  // The task holds the context, which holds the task.
  context->PostDecode([context, chain = std::move(chain), packed = *std::move(answer), bytes, what = std::move(what),
                       done = std::move(done)]() mutable { done(Decode(chain, std::move(packed), bytes, what)); });
}

}  // namespace slabstream
