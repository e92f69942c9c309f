// Bitshuffle: the first bit of each element of a block, then the second one of each, and so on; and the frame that filters of HDF5 put
// round blocks, packed by LZ4 or Zstandard. Source: https://github.com/kiyo-masui/bitshuffle
#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/check.h"
#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

constexpr std::size_t kTogether = 8;  // elements: as many as a byte has bits

static_assert(std::endian::native == std::endian::little);

// Bit j of byte i becomes bit i of byte j.
std::uint64_t Transposed(std::uint64_t bits) {
  const auto exchange = [&](int distance, std::uint64_t mask) {
    const std::uint64_t differ = (bits ^ (bits >> distance)) & mask;
    bits ^= differ ^ (differ << distance);
  };
  exchange(7, 0x00aa00aa00aa00aa);
  exchange(14, 0x0000cccc0000cccc);
  exchange(28, 0x00000000f0f0f0f0);
  return bits;
}

// `in` and `out`: as many elements, a multiple of kTogether.
void Unshuffle(std::span<const std::byte> in, std::size_t element_bytes, std::byte* out) {
  const std::size_t row = in.size() / element_bytes / kTogether;  // bytes that hold one bit of each element
  for (std::size_t byte = 0; byte < element_bytes; ++byte) {
    const std::byte* const rows = in.data() + byte * kTogether * row;
    for (std::size_t group = 0; group < row; ++group) {
      std::array<std::byte, kTogether> bytes;
      for (std::size_t bit = 0; bit < kTogether; ++bit) bytes[bit] = rows[bit * row + group];
      bytes = std::bit_cast<std::array<std::byte, kTogether>>(Transposed(std::bit_cast<std::uint64_t>(bytes)));
      std::byte* const elements = out + group * kTogether * element_bytes + byte;
      for (std::size_t i = 0; i < kTogether; ++i) elements[i * element_bytes] = bytes[i];
    }
  }
}

std::uint64_t BigEndian(std::span<const std::byte> bytes) {
  std::uint64_t number = 0;
  for (const std::byte byte : bytes) number = number << 8 | std::to_integer<std::uint64_t>(byte);
  return number;
}

}  // namespace

SharedCodec BitshuffleCodec(std::size_t element_bytes, std::size_t block_elements) {
  CHECK(element_bytes >= 1 && block_elements > 0 && block_elements % kTogether == 0);
  return std::make_shared<ChunkCodec>([=](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    if (packed.size() > most) return TooManyBytes("bitshuffle", packed.size(), most);
    UnwrittenVector<std::byte> out(packed.size());
    std::span<const std::byte> in = packed.span();
    std::byte* to = out.data();
    // What is left over at the end is as it was.
    const std::size_t whole = in.size() / (kTogether * element_bytes) * kTogether * element_bytes;
    for (std::size_t left = whole; left > 0;) {
      const std::size_t bytes = std::min(left, block_elements * element_bytes);
      Unshuffle(in.first(bytes), element_bytes, to);
      in = in.subspan(bytes);
      to += bytes;
      left -= bytes;
    }
    std::ranges::copy(in, to);
    return Bytes(std::move(out));
  });
}

// The number of decoded bytes (64 bits) and of those of a block (32 bits); then each block behind the number of its packed bytes (32 bits).
// All numbers are big endian.
SharedCodec BlocksCodec(const BlockFormat& format) {
  CHECK(format.element_bytes >= 1 && format.packing != nullptr);
  return std::make_shared<ChunkCodec>([format](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    constexpr std::size_t kHeader = 12, kLength = 4;
    const std::span<const std::byte> all = packed.span();
    if (all.size() < kHeader) return DamagedBytes("blocks");
    const std::uint64_t bytes = BigEndian(all.first(8)), stated = BigEndian(all.subspan(8, 4));
    if (bytes > most) return TooManyBytes("a chunk", bytes, most);
    const std::size_t together = kTogether * format.element_bytes;
    if (stated == 0 || (format.bitshuffle && stated % together != 0)) return DamagedBytes("blocks");
    const std::uint64_t plain = format.bitshuffle ? bytes % together : 0;  // at the end, not packed
    UnwrittenVector<std::byte> out(bytes);
    std::size_t at = kHeader;
    for (std::uint64_t done = 0; done < bytes - plain;) {
      const std::uint64_t block_bytes = std::min(stated, bytes - plain - done);
      if (all.size() - at < kLength) return DamagedBytes("blocks");
      const std::uint64_t length = BigEndian(all.subspan(at, kLength));
      at += kLength;
      if (length > all.size() - at) return DamagedBytes("blocks");
      Bytes block = packed.Part(at, length);
      at += length;
      // LZ4's filter leaves a block as it is that would not shrink.
      const bool as_it_is = !format.bitshuffle && length == block_bytes;
      if (!as_it_is) {
        Result<Bytes> decoded = format.packing->Decode(std::move(block), block_bytes);
        if (!decoded.ok()) return decoded;
        block = *std::move(decoded);
      }
      if (block.size() != block_bytes) return DamagedBytes("blocks");
      if (format.bitshuffle) {
        Unshuffle(block.span(), format.element_bytes, out.data() + done);
      } else {
        std::ranges::copy(block.span(), out.data() + done);
      }
      done += block_bytes;
    }
    if (all.size() - at < plain) return DamagedBytes("blocks");
    std::ranges::copy(all.subspan(at, plain), out.data() + bytes - plain);
    return Bytes(std::move(out));
  });
}

}  // namespace slabstream
