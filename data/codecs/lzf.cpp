#include <lzf.h>

#include <algorithm>
#include <cerrno>
#include <limits>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

Result<Bytes> DecodeLzf(const Bytes& packed, std::uint64_t most) {
  // Three bytes stand for at most 264.
  constexpr std::uint64_t kLzfRatio = 88, kMostBytes = std::numeric_limits<unsigned>::max();
  const std::span<const std::byte> in = packed.span();
  if (in.empty()) return packed;  // the library reads the first byte
  if (in.size() > kMostBytes) return DamagedBytes("lzf");
  const std::uint64_t limit = std::min({most, kLzfRatio * in.size(), kMostBytes});
  UnwrittenVector<std::byte> out(limit);
  const unsigned bytes = lzf_decompress(in.data(), unsigned(in.size()), out.data(), unsigned(limit));
  if (bytes == 0) return errno == E2BIG ? TooManyBytes("lzf", limit + 1, limit) : DamagedBytes("lzf");
  out.resize(bytes);
  return Bytes(std::move(out));
}

}  // namespace

SharedCodec LzfCodec() { return std::make_shared<ChunkCodec>(DecodeLzf); }

}  // namespace slabstream
