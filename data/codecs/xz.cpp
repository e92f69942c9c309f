#include <lzma.h>

#include <new>

#include "data/codecs/codecs.h"
#include "data/codecs/growing_bytes.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kMostMemory = std::uint64_t{256} << 20;  // four times what the highest level of xz takes

class Decoder {
 public:
  Decoder() {
    if (lzma_stream_decoder(&stream_, kMostMemory, LZMA_CONCATENATED) != LZMA_OK) throw std::bad_alloc();
  }
  ~Decoder() { lzma_end(&stream_); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  StreamState Step(std::span<const std::byte>& in, std::span<std::byte>& out) {
    stream_.next_in = reinterpret_cast<const std::uint8_t*>(in.data());
    stream_.avail_in = in.size();
    stream_.next_out = reinterpret_cast<std::uint8_t*>(out.data());
    stream_.avail_out = out.size();
    lzma_ret code = LZMA_OK;
    while (code == LZMA_OK && stream_.avail_out > 0) code = lzma_code(&stream_, LZMA_FINISH);
    in = in.last(stream_.avail_in);
    out = out.last(stream_.avail_out);
    if (code == LZMA_MEM_ERROR || code == LZMA_MEMLIMIT_ERROR) throw std::bad_alloc();
    return code == LZMA_STREAM_END ? StreamState::kEnded : code == LZMA_OK ? StreamState::kGoesOn : StreamState::kDamaged;
  }

 private:
  lzma_stream stream_ = LZMA_STREAM_INIT;
};

}  // namespace

SharedCodec XzCodec() {
  return std::make_shared<ChunkCodec>([](const Bytes& packed, std::uint64_t most) {
    Decoder decoder;
    return DecodeGrowing("xz", packed.span(), most, [&](auto& in, auto& out) { return decoder.Step(in, out); });
  });
}

}  // namespace slabstream
