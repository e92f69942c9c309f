#include <blosc.h>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

Result<Bytes> DecodeBlosc(const Bytes& packed, std::uint64_t most) {
  const std::span<const std::byte> in = packed.span();
  std::size_t bytes = 0;
  if (in.size() < BLOSC_MIN_HEADER_LENGTH || blosc_cbuffer_validate(in.data(), in.size(), &bytes) < 0) return DamagedBytes("blosc");
  if (bytes > most) return TooManyBytes("blosc", bytes, most);
  UnwrittenVector<std::byte> out(bytes);
  // Chunks are decoded on threads of their own already.
  const int decoded = blosc_decompress_ctx(in.data(), out.data(), out.size(), 1);
  if (decoded < 0 || std::size_t(decoded) != bytes) return DamagedBytes("blosc");
  return Bytes(std::move(out));
}

}  // namespace

SharedCodec BloscCodec() { return std::make_shared<ChunkCodec>(DecodeBlosc); }

}  // namespace slabstream
