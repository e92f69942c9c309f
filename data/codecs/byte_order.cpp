#include <algorithm>
#include <bit>
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
void Swap(std::span<const std::byte> in, std::byte* out) {
  for (std::size_t i = 0; i < in.size(); i += sizeof(T)) {
    T value;
    std::memcpy(&value, in.data() + i, sizeof(T));
    value = Swapped(value);
    std::memcpy(out + i, &value, sizeof(T));
  }
}

class SwapBytes : public ChunkCodec {
 public:
  explicit SwapBytes(std::size_t element_bytes) : element_bytes_(element_bytes) {}

  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const override {
    if (element_bytes_ == 1) return packed;
    if (packed.size() > most) return TooManyBytes("a chunk", packed.size(), most);
    if (packed.size() % element_bytes_ != 0) {
      return Status::DataLoss(fmt::format("has {} bytes, must have a multiple of {}", packed.size(), element_bytes_));
    }
    UnwrittenVector<std::byte> out(packed.size());
    switch (element_bytes_) {
      case 2: Swap<std::uint16_t>(packed.span(), out.data()); break;
      case 4: Swap<std::uint32_t>(packed.span(), out.data()); break;
      default: Swap<std::uint64_t>(packed.span(), out.data()); break;
    }
    return Bytes(std::move(out));
  }

 private:
  const std::size_t element_bytes_;
};

}  // namespace

SharedCodec SwapBytesCodec(std::size_t element_bytes) {
  CHECK(element_bytes == 1 || element_bytes == 2 || element_bytes == 4 || element_bytes == 8) << element_bytes;
  return std::make_shared<SwapBytes>(element_bytes);
}

}  // namespace slabstream
