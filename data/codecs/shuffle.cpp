#include <algorithm>

#include "common/base/check.h"
#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

class Shuffle : public ChunkCodec {
 public:
  explicit Shuffle(std::size_t element_bytes) : element_bytes_(element_bytes) {}

  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const override {
    if (element_bytes_ == 1) return packed;
    if (packed.size() > most) return TooManyBytes("a chunk", packed.size(), most);
    if (packed.size() % element_bytes_ != 0) {
      return Status::DataLoss(fmt::format("has {} bytes, must have a multiple of {}", packed.size(), element_bytes_));
    }
    const std::size_t count = packed.size() / element_bytes_;
    UnwrittenVector<std::byte> out(packed.size());
    for (std::size_t byte = 0; byte < element_bytes_; ++byte) {
      const std::byte* const from = packed.span().data() + byte * count;
      for (std::size_t i = 0; i < count; ++i) out[i * element_bytes_ + byte] = from[i];
    }
    return Bytes(std::move(out));
  }

 private:
  const std::size_t element_bytes_;
};

}  // namespace

SharedCodec ShuffleCodec(std::size_t element_bytes) {
  CHECK(element_bytes >= 1);
  return std::make_shared<Shuffle>(element_bytes);
}

}  // namespace slabstream
