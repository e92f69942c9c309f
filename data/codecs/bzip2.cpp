#include <bzlib.h>

#include <new>

#include "data/codecs/codecs.h"
#include "data/codecs/growing_bytes.h"

namespace slabstream {
namespace {

class Decompressor {
 public:
  Decompressor() { Begin(); }
  ~Decompressor() { BZ2_bzDecompressEnd(&stream_); }
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;

  StreamState Step(std::span<const std::byte>& in, std::span<std::byte>& out) {
    while (!out.empty()) {
      const unsigned given = CountFor<unsigned>(in), room = CountFor<unsigned>(out);
      stream_.next_in = const_cast<char*>(reinterpret_cast<const char*>(in.data()));  // which bzip2 does not change
      stream_.avail_in = given;
      stream_.next_out = reinterpret_cast<char*>(out.data());
      stream_.avail_out = room;
      const int code = BZ2_bzDecompress(&stream_);
      if (code == BZ_MEM_ERROR) throw std::bad_alloc();
      if (code != BZ_OK && code != BZ_STREAM_END) return StreamState::kDamaged;
      const bool stuck = code == BZ_OK && stream_.avail_in == given && stream_.avail_out == room;
      in = in.subspan(given - stream_.avail_in);
      out = out.subspan(room - stream_.avail_out);
      if (stuck) break;
      if (code == BZ_OK) continue;
      if (in.empty()) return StreamState::kEnded;
      BZ2_bzDecompressEnd(&stream_);  // another stream follows
      Begin();
    }
    return StreamState::kGoesOn;
  }

 private:
  void Begin() {
    stream_ = {};
    if (BZ2_bzDecompressInit(&stream_, 0, 0) != BZ_OK) throw std::bad_alloc();
  }

  bz_stream stream_{};
};

}  // namespace

SharedCodec Bzip2Codec() {
  return std::make_shared<ChunkCodec>([](const Bytes& packed, std::uint64_t most) {
    Decompressor decompressor;
    return DecodeGrowing("bzip2", packed.span(), most, [&](auto& in, auto& out) { return decompressor.Step(in, out); });
  });
}

}  // namespace slabstream
