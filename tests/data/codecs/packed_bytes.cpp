#include "tests/data/codecs/packed_bytes.h"

#include <blosc.h>
#include <lz4.h>
#include <lzf.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>

#include "common/base/check.h"
#include "data/codecs/codecs.h"

namespace slabstream {
namespace {

std::string Deflated(const std::string& bytes, int window_bits) {
  z_stream stream{};
  CHECK_EQ(deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  CHECK_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string Little32(std::uint32_t number) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += char(number >> (8 * i));
  return bytes;
}

}  // namespace

std::string PackBytes(const std::string& codec, const std::string& bytes, std::size_t element_bytes) {
  constexpr int kWindow = 15, kGzip = 16;
  if (codec == "gzip") return Deflated(bytes, kWindow + kGzip);
  if (codec == "zlib") return Deflated(bytes, kWindow);
  if (codec == "crc32c") return bytes + Little32(Crc32c(std::as_bytes(std::span(bytes))));
  if (codec == "blosc") return PackBlosc("zstd", BLOSC_SHUFFLE, element_bytes, bytes);
  if (codec == "zstd") {
    std::string packed(ZSTD_compressBound(bytes.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
    return packed;
  }
  if (codec == "lz4") {
    std::string packed(std::size_t(LZ4_compressBound(int(bytes.size()))), '\0');
    packed.resize(std::size_t(LZ4_compress_default(bytes.data(), packed.data(), int(bytes.size()), int(packed.size()))));
    return Little32(std::uint32_t(bytes.size())) + packed;
  }
  if (codec == "lzf") {
    std::string packed(bytes.size() + bytes.size() / 16 + 64, '\0');
    packed.resize(lzf_compress(bytes.data(), unsigned(bytes.size()), packed.data(), unsigned(packed.size())));
    return packed;
  }
  CHECK(codec.empty()) << codec;
  return bytes;
}

std::string PackBlosc(const std::string& inner, int shuffle, std::size_t element_bytes, const std::string& bytes) {
  std::string packed(bytes.size() + BLOSC_MAX_OVERHEAD, '\0');
  const int length =
      blosc_compress_ctx(5, shuffle, element_bytes, bytes.size(), bytes.data(), packed.data(), packed.size(), inner.c_str(), 0, 1);
  packed.resize(std::size_t(std::max(length, 0)));
  return packed;
}

std::string PackZstdStream(const std::string& bytes) {
  ZSTD_CCtx* const context = ZSTD_createCCtx();
  std::string packed(ZSTD_compressBound(bytes.size()) + 64, '\0');
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  ZSTD_outBuffer out{packed.data(), packed.size(), 0};
  CHECK_EQ(ZSTD_isError(ZSTD_compressStream2(context, &out, &in, ZSTD_e_continue)), 0U);
  CHECK_EQ(ZSTD_compressStream2(context, &out, &in, ZSTD_e_end), 0U);
  packed.resize(out.pos);
  ZSTD_freeCCtx(context);
  return packed;
}

std::string ShuffledBytes(const std::string& bytes, std::size_t element_bytes) {
  std::string shuffled;
  for (std::size_t byte = 0; byte < element_bytes; ++byte) {
    for (std::size_t i = byte; i < bytes.size(); i += element_bytes) shuffled += bytes[i];
  }
  return shuffled;
}

std::string SwappedBytes(const std::string& bytes, std::size_t element_bytes) {
  std::string swapped = bytes;
  for (std::size_t i = 0; i < swapped.size(); i += element_bytes) std::reverse(swapped.data() + i, swapped.data() + i + element_bytes);
  return swapped;
}

}  // namespace slabstream
