// gzip and zlib: the same bytes within another frame.
#include <algorithm>
#include <string_view>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"
#include "data/codecs/inflater.h"

namespace slabstream {
namespace {

SharedCodec InflateCodec(std::string_view name, DeflateFrame frame) {
  return std::make_shared<ChunkCodec>([=](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    // Deflate makes at most 258 bytes of 2 bits. One more than allowed tells that there are more.
    constexpr std::uint64_t kDeflateRatio = 1032;
    const std::uint64_t limit = packed.size() > most / kDeflateRatio ? most : packed.size() * kDeflateRatio;
    UnwrittenVector<std::byte> bytes(limit + 1);
    std::span<const std::byte> in = packed.span();
    std::span<std::byte> out = bytes;
    Inflater inflater(frame);
    do {
      inflater.Begin();
      const StreamState step = inflater.Advance(in, out);
      if (out.empty()) return TooManyBytes(name, limit + 1, limit);
      if (step != StreamState::kEnded) return DamagedBytes(name);
    } while (frame == DeflateFrame::kGzip && !in.empty());  // another member
    if (!in.empty()) return DamagedBytes(name);
    bytes.resize(bytes.size() - out.size());
    return Bytes(std::move(bytes));
  });
}

}  // namespace

SharedCodec GzipCodec() { return InflateCodec("gzip", DeflateFrame::kGzip); }
SharedCodec ZlibCodec() { return InflateCodec("zlib", DeflateFrame::kZlib); }

}  // namespace slabstream
