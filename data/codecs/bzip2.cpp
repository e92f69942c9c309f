#include "data/codecs/bunzipper.h"
#include "data/codecs/codecs.h"

namespace slabstream {

SharedCodec Bzip2Codec() {
  return std::make_shared<ChunkCodec>([](const Bytes& packed, std::uint64_t most) {
    Bunzipper bunzipper;
    return DecodeGrowing("bzip2", packed.span(), most, [&](auto& in, auto& out) {
      while (!out.empty()) {
        const std::size_t had = in.size(), room = out.size();
        const StreamState state = bunzipper.Advance(in, out);
        if (state == StreamState::kDamaged || (state == StreamState::kEnded && in.empty())) return state;
        if (state == StreamState::kEnded) {
          bunzipper.Begin();  // another stream follows
        } else if (in.size() == had && out.size() == room) {
          break;
        }
      }
      return StreamState::kGoesOn;
    });
  });
}

}  // namespace slabstream
