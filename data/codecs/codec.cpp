#include "data/codecs/codec.h"

#include <fmt/format.h>

#include <utility>

namespace slabstream {

Result<Bytes> DecodeChain(const CodecChain& chain, Bytes packed, std::uint64_t bytes) {
  for (auto codec = chain.rbegin(); codec != chain.rend(); ++codec) {
    // Inner codecs may add checksums and headers to what they pack.
    constexpr std::uint64_t kOverhead = 4096;
    Result<Bytes> decoded = (*codec)->Decode(std::move(packed), bytes + kOverhead);
    if (!decoded.ok()) return decoded.status();
    packed = *std::move(decoded);
  }
  if (packed.size() != bytes) return Status::DataLoss(fmt::format("has {} bytes, expected {}", packed.size(), bytes));
  return packed;
}

}  // namespace slabstream
