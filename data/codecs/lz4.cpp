// Blocks of LZ4: bare, and in the two frames that formats put round them.
#include <lz4.h>
#include <xxhash.h>

#include <algorithm>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kMostRatio = 255;  // a byte of a length stands for so many at most

// How many bytes a block held; -1: it is damaged, or holds more than `out`.
int DecodeBlock(std::span<const std::byte> block, std::span<std::byte> out) {
  if (block.size() > LZ4_MAX_INPUT_SIZE || out.size() > LZ4_MAX_INPUT_SIZE) return -1;
  return LZ4_decompress_safe(reinterpret_cast<const char*>(block.data()), reinterpret_cast<char*>(out.data()), int(block.size()),
                             int(out.size()));
}

Result<Bytes> DecodeLz4(const Bytes& packed, std::uint64_t most) {
  const std::span<const std::byte> in = packed.span();
  constexpr std::size_t kHeader = 4;
  if (in.size() < kHeader) return DamagedBytes("lz4");
  const std::uint64_t bytes = Little32(in);
  if (bytes > most) return TooManyBytes("lz4", bytes, most);
  if (bytes > kMostRatio * in.size()) return DamagedBytes("lz4");
  UnwrittenVector<std::byte> out(bytes);
  const int decoded = DecodeBlock(in.subspan(kHeader), out);
  if (decoded < 0 || std::uint64_t(decoded) != bytes) return DamagedBytes("lz4");
  return Bytes(std::move(out));
}

Result<Bytes> DecodeBareBlock(const Bytes& packed, std::uint64_t most) {
  UnwrittenVector<std::byte> out(std::min(most, kMostRatio * packed.size()));
  const int decoded = DecodeBlock(packed.span(), out);
  if (decoded < 0) return Status::DataLoss(fmt::format("damaged: this is no block of lz4 of at most {} bytes", out.size()));
  out.resize(std::size_t(decoded));
  return Bytes(std::move(out));
}

bool UnpackOfJava(unsigned method, std::span<const std::byte> block, std::span<std::byte> out, std::uint32_t sum) {
  constexpr unsigned kStored = 0x10, kPacked = 0x20;
  constexpr std::uint32_t kSeed = 0x9747b28c, kSumBits = 0xfffffff;
  if (method == kStored && block.size() == out.size()) {
    std::ranges::copy(block, out.begin());
  } else if (method != kPacked || DecodeBlock(block, out) != int(out.size())) {
    return false;
  }
  return (XXH32(out.data(), out.size(), kSeed) & kSumBits) == sum;
}

// Each block has a header: "LZ4Block", the method, the bytes of the block packed and unpacked, and a checksum of those unpacked. A block of
// nothing ends the stream. Source: LZ4BlockOutputStream of https://github.com/lz4/lz4-java
Result<Bytes> DecodeLz4Java(const Bytes& packed, std::uint64_t most) {
  UnwrittenVector<std::byte> out;
  for (std::span<const std::byte> in = packed.span();;) {
    constexpr std::string_view kMagic = "LZ4Block";
    constexpr std::size_t kMethod = 8, kPackedBytes = 9, kBytes = 13, kSum = 17, kHeader = 21;
    if (in.size() < kHeader || !std::ranges::equal(in.first(kMagic.size()), std::as_bytes(std::span(kMagic)))) return DamagedBytes("lz4");
    const std::uint64_t packed_bytes = Little32(in.subspan(kPackedBytes)), bytes = Little32(in.subspan(kBytes));
    const std::uint32_t sum = Little32(in.subspan(kSum));
    const unsigned method = std::to_integer<unsigned>(in[kMethod]) & 0xf0U;
    in = in.subspan(kHeader);
    if (bytes == 0 && in.empty()) return Bytes(std::move(out));
    if (packed_bytes > in.size() || bytes > kMostRatio * packed_bytes) return DamagedBytes("lz4");
    if (bytes > most - out.size()) return TooManyBytes("lz4", out.size() + bytes, most);
    const std::size_t done = out.size();
    out.resize(done + bytes);
    if (!UnpackOfJava(method, in.first(packed_bytes), std::span(out).subspan(done), sum)) return DamagedBytes("lz4");
    in = in.subspan(packed_bytes);
  }
}

}  // namespace

SharedCodec Lz4Codec() { return std::make_shared<ChunkCodec>(DecodeLz4); }
SharedCodec Lz4BlockCodec() { return std::make_shared<ChunkCodec>(DecodeBareBlock); }
SharedCodec Lz4JavaCodec() { return std::make_shared<ChunkCodec>(DecodeLz4Java); }

}  // namespace slabstream
