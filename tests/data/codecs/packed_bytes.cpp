#include "tests/data/codecs/packed_bytes.h"

#include <blosc.h>
#include <brotli/encode.h>
#include <bzlib.h>
#include <lz4.h>
#include <lzf.h>
#include <lzma.h>
#include <xxhash.h>
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

constexpr std::size_t kLz4JavaBlock = 1000;

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
  if (codec == "deflate") return Deflated(bytes, -kWindow);
  if (codec == "crc32c") return bytes + Little32(Crc32c(std::as_bytes(std::span(bytes))));
  if (codec == "blosc") return PackBlosc("zstd", BLOSC_SHUFFLE, element_bytes, bytes);
  if (codec == "zstd") {
    std::string packed(ZSTD_compressBound(bytes.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
    return packed;
  }
  if (codec == "lz4") return Little32(std::uint32_t(bytes.size())) + PackBytes("lz4 block", bytes);
  if (codec == "lz4 block") {
    std::string packed(std::size_t(LZ4_compressBound(int(bytes.size()))), '\0');
    packed.resize(std::size_t(LZ4_compress_default(bytes.data(), packed.data(), int(bytes.size()), int(packed.size()))));
    return packed;
  }
  if (codec == "lz4 java") {
    std::string stream;
    for (std::size_t begin = 0; begin < bytes.size(); begin += kLz4JavaBlock) {
      const std::string block = bytes.substr(begin, kLz4JavaBlock), packed = PackBytes("lz4 block", block);
      const bool stored = packed.size() >= block.size();
      const std::uint32_t sum = XXH32(block.data(), block.size(), 0x9747b28c) & 0xfffffff;
      stream += std::string("LZ4Block") + char(stored ? 0x16 : 0x26) + Little32(std::uint32_t((stored ? block : packed).size())) +
                Little32(std::uint32_t(block.size())) + Little32(sum) + (stored ? block : packed);
    }
    return stream + "LZ4Block" + char(0x16) + std::string(12, '\0');
  }
  if (codec == "bzip2") {
    std::string packed(bytes.size() + bytes.size() / 100 + 600, '\0');
    auto size = unsigned(packed.size());
    CHECK_EQ(BZ2_bzBuffToBuffCompress(packed.data(), &size, const_cast<char*>(bytes.data()), unsigned(bytes.size()), 1, 0, 0), BZ_OK);
    packed.resize(size);
    return packed;
  }
  if (codec == "xz") {
    std::string packed(lzma_stream_buffer_bound(bytes.size()), '\0');
    std::size_t size = 0;
    CHECK_EQ(lzma_easy_buffer_encode(0, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(),
                                     reinterpret_cast<std::uint8_t*>(packed.data()), &size, packed.size()),
             LZMA_OK);
    packed.resize(size);
    return packed;
  }
  if (codec == "brotli") {
    std::string packed(BrotliEncoderMaxCompressedSize(bytes.size()) + 64, '\0');
    std::size_t size = packed.size();
    CHECK_EQ(BrotliEncoderCompress(1, 18, BROTLI_MODE_GENERIC, bytes.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()), &size,
                                   reinterpret_cast<std::uint8_t*>(packed.data())),
             BROTLI_TRUE);
    packed.resize(size);
    return packed;
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

std::string BitshuffledBytes(const std::string& bytes, std::size_t element_bytes, std::size_t block_elements) {
  std::string shuffled = bytes;
  const std::size_t whole = bytes.size() / element_bytes / 8 * 8;  // elements
  for (std::size_t first = 0; first < whole; first += block_elements) {
    const std::size_t count = std::min(block_elements, whole - first);
    char* const out = shuffled.data() + first * element_bytes;
    std::fill_n(out, count * element_bytes, char{0});
    for (std::size_t bit = 0; bit < 8 * element_bytes; ++bit) {
      for (std::size_t i = 0; i < count; ++i) {
        const unsigned byte = static_cast<unsigned char>(bytes[(first + i) * element_bytes + bit / 8]);
        const std::size_t place = bit * count + i;
        out[place / 8] = char(static_cast<unsigned char>(out[place / 8]) | ((byte >> bit % 8 & 1U) << place % 8));
      }
    }
  }
  return shuffled;
}

std::string PackBlocks(const std::string& codec, const std::string& bytes, std::size_t block_bytes, std::size_t bitshuffle) {
  const auto big_endian = [](std::uint64_t number, int count) {
    std::string text;
    for (int i = count - 1; i >= 0; --i) text.push_back(char(number >> (8 * i) & 0xff));
    return text;
  };
  const std::size_t plain = bitshuffle == 0 ? 0 : bytes.size() % (8 * bitshuffle);
  std::string all = big_endian(bytes.size(), 8) + big_endian(block_bytes, 4);
  for (std::size_t at = 0; at < bytes.size() - plain; at += block_bytes) {
    const std::string block = bytes.substr(at, std::min(block_bytes, bytes.size() - plain - at));
    std::string packed = PackBytes(codec, bitshuffle == 0 ? block : BitshuffledBytes(block, bitshuffle, block_bytes / bitshuffle));
    if (bitshuffle == 0 && packed.size() >= block.size()) packed = block;
    all += big_endian(packed.size(), 4) + packed;
  }
  return all + bytes.substr(bytes.size() - plain);
}

}  // namespace slabstream
