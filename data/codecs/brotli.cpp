#include <brotli/decode.h>

#include <memory>
#include <new>

#include "data/codecs/codecs.h"
#include "data/codecs/growing_bytes.h"

namespace slabstream {
namespace {

struct FreeDecoder {
  void operator()(BrotliDecoderState* decoder) const { BrotliDecoderDestroyInstance(decoder); }
};

Result<Bytes> DecodeBrotli(const Bytes& packed, std::uint64_t most) {
  const std::unique_ptr<BrotliDecoderState, FreeDecoder> decoder(BrotliDecoderCreateInstance(nullptr, nullptr, nullptr));
  if (decoder == nullptr) throw std::bad_alloc();
  return DecodeGrowing("brotli", packed.span(), most, [&](std::span<const std::byte>& in, std::span<std::byte>& out) {
    std::size_t given = in.size(), room = out.size();
    const auto* next_in = reinterpret_cast<const std::uint8_t*>(in.data());
    auto* next_out = reinterpret_cast<std::uint8_t*>(out.data());
    const BrotliDecoderResult code = BrotliDecoderDecompressStream(decoder.get(), &given, &next_in, &room, &next_out, nullptr);
    in = in.last(given);
    out = out.last(room);
    return code == BROTLI_DECODER_RESULT_SUCCESS             ? StreamState::kEnded
           : code == BROTLI_DECODER_RESULT_NEEDS_MORE_OUTPUT ? StreamState::kGoesOn
                                                             : StreamState::kDamaged;
  });
}

}  // namespace

SharedCodec BrotliCodec() { return std::make_shared<ChunkCodec>(DecodeBrotli); }

}  // namespace slabstream
