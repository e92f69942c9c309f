// gzip and zlib: the same bytes within another frame.
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>
#include <string_view>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

class Inflater {
 public:
  explicit Inflater(int window_bits) {
    if (inflateInit2(&stream_, window_bits) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  // The result of inflate() where a member ends, or where it cannot go on. Moves both to what is left.
  int Member(std::span<const std::byte>& in, std::span<std::byte>& out) {
    constexpr std::size_t kMost = std::numeric_limits<uInt>::max();
    (void)inflateReset(&stream_);
    while (true) {
      const uInt given = uInt(std::min(in.size(), kMost)), room = uInt(std::min(out.size(), kMost));
      stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(in.data()));  // which zlib does not change
      stream_.avail_in = given;
      stream_.next_out = reinterpret_cast<Bytef*>(out.data());
      stream_.avail_out = room;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      in = in.subspan(given - stream_.avail_in);
      out = out.subspan(room - stream_.avail_out);
      if (code != Z_OK || (stream_.avail_in == given && stream_.avail_out == room)) return code;
    }
  }

 private:
  z_stream stream_{};
};

SharedCodec InflateCodec(std::string_view name, int window_bits, bool many) {
  return std::make_shared<ChunkCodec>([=](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    // Deflate makes at most 258 bytes of 2 bits. One more than allowed tells that there are more.
    constexpr std::uint64_t kDeflateRatio = 1032;
    const std::uint64_t limit = packed.size() > most / kDeflateRatio ? most : packed.size() * kDeflateRatio;
    UnwrittenVector<std::byte> bytes(limit + 1);
    std::span<const std::byte> in = packed.span();
    std::span<std::byte> out = bytes;
    Inflater inflater(window_bits);
    do {
      const int code = inflater.Member(in, out);
      if (code == Z_MEM_ERROR) throw std::bad_alloc();
      if (out.empty()) return TooManyBytes(name, limit + 1, limit);
      if (code != Z_STREAM_END) return DamagedBytes(name);
    } while (many && !in.empty());
    if (!in.empty()) return DamagedBytes(name);
    bytes.resize(bytes.size() - out.size());
    return Bytes(std::move(bytes));
  });
}

constexpr int kLargestWindow = 15, kGzipHeader = 16;  // zlib's numbers

}  // namespace

SharedCodec GzipCodec() { return InflateCodec("gzip", kLargestWindow + kGzipHeader, true); }
SharedCodec ZlibCodec() { return InflateCodec("zlib", kLargestWindow, false); }

}  // namespace slabstream
