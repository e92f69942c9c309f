#include "data/volume_io/packed_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "common/text/base64.h"
#include "data/codecs/codec.h"

namespace slabstream {

PackedSamples::Range PackedSamples::PlaceOf(std::size_t block) const {
  const std::uint64_t first = block == 0 ? 0 : block_ends[block - 1];
  return {first, block_ends[block] - first};
}

PackedSamples::Range PackedSamples::Packed(const Range& part) const {
  if (codec == nullptr) return part;
  const std::uint64_t first = PlaceOf(part.begin / block_bytes).begin;
  return {first, block_ends[(part.begin + part.bytes - 1) / block_bytes] - first};
}

PackedSamples::Range PackedSamples::Stored(const Range& part) const {
  const Range packed = Packed(part);
  if (!base64) return {begin + packed.begin, packed.bytes};
  const std::uint64_t first = (before + packed.begin) / 3, last = (before + packed.begin + packed.bytes + 2) / 3;
  return {begin + 4 * first, 4 * (last - first)};
}

Result<Bytes> PackedSamples::Decode(Bytes stored, const Range& part) const {
  const Range packed = Packed(part);
  if (base64) {
    UnwrittenVector<std::byte> decoded(stored.size() / 4 * 3);
    const std::optional<std::size_t> found = DecodeBase64(stored.span(), decoded);
    const std::uint64_t first = (before + packed.begin) % 3;
    if (!found || *found < first + packed.bytes) {
      return Status::DataLoss(fmt::format("bytes {} to {} of its samples are damaged: these are no letters of base64 in one piece",
                                          part.begin, part.begin + part.bytes - 1));
    }
    stored = Bytes(std::move(decoded)).Part(first, packed.bytes);
  }
  if (codec == nullptr) return stored;
  UnwrittenVector<std::byte> out(part.bytes);
  for (std::uint64_t done = 0; done < part.bytes;) {
    const std::uint64_t block = (part.begin + done) / block_bytes, within = (part.begin + done) % block_bytes;
    const auto [first, count] = PlaceOf(block);
    const Result<Bytes> decoded = DecodeBlock(block, stored.Part(first - packed.begin, count));
    if (!decoded.ok()) return decoded;
    const auto wanted = decoded->span().subspan(within, std::min(decoded->size() - within, part.bytes - done));
    std::ranges::copy(wanted, out.begin() + std::ptrdiff_t(done));
    done += wanted.size();
  }
  return Bytes(std::move(out));
}

Result<Bytes> PackedSamples::DecodeBlock(std::size_t block, Bytes packed) const {
  const std::uint64_t wanted = std::min(block_bytes, bytes - block * block_bytes);
  Result<Bytes> decoded = codec->Decode(std::move(packed), wanted);
  if (decoded.ok() && decoded->size() == wanted) return decoded;
  return Status::DataLoss(fmt::format("block {} is damaged", block));
}

}  // namespace slabstream
