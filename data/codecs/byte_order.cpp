#include <cstring>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

template <class T>
T Swapped(T value) {
  if constexpr (sizeof(T) == 2) return __builtin_bswap16(value);
  if constexpr (sizeof(T) == 4) return __builtin_bswap32(value);
  if constexpr (sizeof(T) == 8) return __builtin_bswap64(value);
}

template <class T>
Result<Bytes> SwapBytes(const Bytes& packed, std::uint64_t most) {
  if (Status status = CheckElements(packed, sizeof(T), most); !status.ok()) return status;
  UnwrittenVector<std::byte> out(packed.size());
  for (std::size_t i = 0; i < out.size(); i += sizeof(T)) {
    T value;
    std::memcpy(&value, packed.span().data() + i, sizeof(T));
    value = Swapped(value);
    std::memcpy(out.data() + i, &value, sizeof(T));
  }
  return Bytes(std::move(out));
}

}  // namespace

SharedCodec SwapBytesCodec(std::size_t element_bytes) {
  CHECK(element_bytes == 1 || element_bytes == 2 || element_bytes == 4 || element_bytes == 8) << element_bytes;
  switch (element_bytes) {
    case 1: return std::make_shared<ChunkCodec>([](Bytes packed, std::uint64_t) { return packed; });
    case 2: return std::make_shared<ChunkCodec>(SwapBytes<std::uint16_t>);
    case 4: return std::make_shared<ChunkCodec>(SwapBytes<std::uint32_t>);
    default: return std::make_shared<ChunkCodec>(SwapBytes<std::uint64_t>);
  }
}

}  // namespace slabstream
