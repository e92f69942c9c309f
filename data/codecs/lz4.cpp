#include <lz4.h>

#include <algorithm>

#include "common/base/unwritten_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

class Lz4 : public ChunkCodec {
 public:
  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const override {
    const std::span<const std::byte> in = packed.span();
    constexpr std::size_t kHeader = 4;
    if (in.size() < kHeader || in.size() > LZ4_MAX_INPUT_SIZE) return DamagedBytes("lz4");
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < kHeader; ++i) bytes |= std::to_integer<std::uint64_t>(in[i]) << (8 * i);
    if (bytes > most) return TooManyBytes("lz4", bytes, most);
    constexpr std::uint64_t kMostRatio = 255;  // a byte of a length stands for so many at most
    if (bytes > LZ4_MAX_INPUT_SIZE || bytes > kMostRatio * in.size()) return DamagedBytes("lz4");
    UnwrittenVector<std::byte> out(bytes);
    const std::span<const std::byte> block = in.subspan(kHeader);
    const int decoded = LZ4_decompress_safe(reinterpret_cast<const char*>(block.data()), reinterpret_cast<char*>(out.data()),
                                            int(block.size()), int(out.size()));
    if (decoded < 0 || std::uint64_t(decoded) != bytes) return DamagedBytes("lz4");
    return Bytes(std::move(out));
  }
};

}  // namespace

SharedCodec Lz4Codec() { return std::make_shared<Lz4>(); }

}  // namespace slabstream
