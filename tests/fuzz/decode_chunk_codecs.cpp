// Codecs of chunks.
//
// input: u8 codec (Codecs()), u16 most bytes, the packed bytes
#include <algorithm>

#include "data/codecs/codecs.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {
namespace {

const std::vector<CodecChain>& Codecs() {
  static const std::vector<CodecChain> codecs = {{GzipCodec()},
                                                 {ZlibCodec()},
                                                 {ZstdCodec()},
                                                 {BloscCodec()},
                                                 {Lz4Codec()},
                                                 {Crc32cCodec()},
                                                 {LzfCodec()},
                                                 {SwapBytesCodec(2), ShuffleCodec(4), ZstdCodec(), Crc32cCodec()},
                                                 {Lz4JavaCodec()},
                                                 {Bzip2Codec()},
                                                 {XzCodec()},
                                                 {BrotliCodec()},
                                                 {Lz4BlockCodec()},
                                                 {BlocksCodec({Lz4BlockCodec()})},
                                                 {BlocksCodec({ZstdCodec(), true, 2})},
                                                 {BitshuffleCodec(2, 8)}};
  return codecs;
}

Bytes CopyOf(std::span<const std::byte> bytes) { return Bytes(std::vector<std::byte>(bytes.begin(), bytes.end())); }

}  // namespace

bool DecodeChunkCodec(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const CodecChain& codecs = Codecs()[input.Take<std::uint8_t>() % Codecs().size()];
  const std::uint64_t most = input.Take<std::uint16_t>();
  const Result<Bytes> exact = DecodeChain(codecs, CopyOf(input.rest()), most);
  CHECK(!exact.ok() || exact->size() == most);
  const Result<Bytes> decoded = codecs.back()->Decode(CopyOf(input.rest()), most);
  if (!decoded.ok()) {
    CheckRefusal(exact.status());
    CheckRefusal(decoded.status());
    return false;
  }
  CHECK_LE(decoded->size(), most);
  const Result<Bytes> again = codecs.back()->Decode(CopyOf(input.rest()), most);
  CHECK(again.ok() && std::ranges::equal(again->span(), decoded->span()));
  return true;
}

std::vector<FuzzBytes> ChunkCodecSeeds() {
  const std::string bytes = "some bytes of a chunk, some bytes of a chunk.";
  std::vector<FuzzBytes> seeds;
  const auto add = [&](std::uint8_t codec, const std::string& packed) {
    seeds.push_back(FuzzSeed().Put(codec).Put(std::uint16_t{1000}).Put(std::string_view(packed)).bytes());
  };
  std::uint8_t number = 0;
  for (const char* const codec : {"gzip", "zlib", "zstd", "blosc", "lz4", "crc32c", "lzf"}) add(number++, PackBytes(codec, bytes));
  ++number;
  for (const char* const codec : {"lz4 java", "bzip2", "xz", "brotli", "lz4 block"}) add(number++, PackBytes(codec, bytes));
  add(number++, PackBlocks("lz4 block", bytes, 20, 0));
  add(number++, PackBlocks("zstd", bytes, 32, 2));
  add(number++, BitshuffledBytes(bytes, 2, 8));
  add(0, PackBytes("gzip", bytes) + PackBytes("gzip", bytes));
  add(2, PackZstdStream(bytes));
  for (const char* const inner : {"blosclz", "lz4", "snappy", "zlib", "zstd"}) {
    for (const int shuffle : {0, 1, 2}) add(3, PackBlosc(inner, shuffle, 4, std::string(600, 'x') + bytes + bytes));
  }
  add(7, PackBytes("crc32c", PackBytes("zstd", ShuffledBytes(SwappedBytes("8 bytes.", 2), 4))));
  return seeds;
}

}  // namespace slabstream
