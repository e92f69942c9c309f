#include "data/codecs/codec.h"

#include <fmt/format.h>

namespace slabstream {

std::uint64_t MostEncoded(const CodecChain& chain, std::uint64_t bytes) {
  for (const auto& codec : chain) bytes = codec->MostEncoded(bytes);
  return bytes;
}

Result<Bytes> DecodeChain(const CodecChain& chain, Bytes packed, std::uint64_t bytes) {
  constexpr std::uint64_t kTooMany = 4096;               // so many are told below, as another number of bytes
  std::vector<std::uint64_t> most = {bytes + kTooMany};  // of what each codec gives
  for (const auto& codec : chain) most.push_back(codec->MostEncoded(most.back()));
  for (std::size_t i = chain.size(); i-- > 0;) {
    Result<Bytes> decoded = chain[i]->Decode(std::move(packed), most[i]);
    if (!decoded.ok()) return decoded.status();
    packed = *std::move(decoded);
  }
  if (packed.size() != bytes) return Status::DataLoss(fmt::format("has {} bytes, expected {}", packed.size(), bytes));
  return packed;
}

}  // namespace slabstream
