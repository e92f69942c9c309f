
#include "common/base/check.h"
#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {

SharedCodec ShuffleCodec(std::size_t element_bytes) {
  CHECK(element_bytes >= 1);
  return std::make_shared<ChunkCodec>([element_bytes](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    if (element_bytes == 1) return packed;
    if (Status status = CheckElements(packed, element_bytes, most); !status.ok()) return status;
    const std::size_t count = packed.size() / element_bytes;
    UnwrittenVector<std::byte> out(packed.size());
    for (std::size_t byte = 0; byte < element_bytes; ++byte) {
      const std::byte* const from = packed.span().data() + byte * count;
      for (std::size_t i = 0; i < count; ++i) out[i * element_bytes + byte] = from[i];
    }
    return Bytes(std::move(out));
  });
}

}  // namespace slabstream
