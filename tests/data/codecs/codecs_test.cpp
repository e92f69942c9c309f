// Codecs give back what was packed, notice damage, and take no more memory than they may.
#include "data/codecs/codecs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/data/codecs/packed_bytes.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

Bytes ToBytes(const std::string& text) {
  const auto view = std::as_bytes(std::span(text));
  return Bytes(std::vector<std::byte>(view.begin(), view.end()));
}
std::string Text(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.span().data()), bytes.size()}; }

// Compressible, but not alone of one value.
std::string SomeBytes(Random& random, std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t i = 0; i < count; ++i) bytes[i] = char((i / 7) % 50 + (random.Chance(0.1) ? random.Integer(0, 200) : 0));
  return bytes;
}

struct Case {
  std::string name;
  SharedCodec codec;
  std::string (*pack)(const std::string& bytes);
  bool checks = true;  // its bytes tell damage and their number
};

const std::vector<Case>& Cases() {
  static const std::vector<Case> cases = {
      {"gzip", GzipCodec(), [](const std::string& bytes) { return PackBytes("gzip", bytes); }},
      {"gzip_members", GzipCodec(),
       [](const std::string& bytes) {
         return PackBytes("gzip", bytes.substr(0, bytes.size() / 2)) + PackBytes("gzip", bytes.substr(bytes.size() / 2));
       }},
      {"zlib", ZlibCodec(), [](const std::string& bytes) { return PackBytes("zlib", bytes); }},
      {"zstd", ZstdCodec(), [](const std::string& bytes) { return PackBytes("zstd", bytes); }},
      {"zstd_stream", ZstdCodec(), PackZstdStream},
      {"zstd_frames", ZstdCodec(),
       [](const std::string& bytes) {
         return PackBytes("zstd", bytes.substr(0, bytes.size() / 2)) + PackBytes("zstd", bytes.substr(bytes.size() / 2));
       }},
      {"blosc", BloscCodec(), [](const std::string& bytes) { return PackBytes("blosc", bytes, 2); }},
      {"lz4", Lz4Codec(), [](const std::string& bytes) { return PackBytes("lz4", bytes); }},
      {"lz4_java", Lz4JavaCodec(), [](const std::string& bytes) { return PackBytes("lz4 java", bytes); }},
      {"lz4_blocks", BlocksCodec({Lz4BlockCodec()}), [](const std::string& bytes) { return PackBlocks("lz4 block", bytes, 100, 0); }},
      {"bitshuffle_lz4", BlocksCodec({Lz4BlockCodec(), true, 2}),
       [](const std::string& bytes) { return PackBlocks("lz4 block", bytes, 64, 2); }},
      {"bitshuffle_zstd", BlocksCodec({ZstdCodec(), true, 3}), [](const std::string& bytes) { return PackBlocks("zstd", bytes, 240, 3); }},
      {"bzip2", Bzip2Codec(), [](const std::string& bytes) { return PackBytes("bzip2", bytes); }},
      {"bzip2_streams", Bzip2Codec(),
       [](const std::string& bytes) {
         return PackBytes("bzip2", bytes.substr(0, bytes.size() / 2)) + PackBytes("bzip2", bytes.substr(bytes.size() / 2));
       }},
      {"xz", XzCodec(), [](const std::string& bytes) { return PackBytes("xz", bytes); }},
      {"brotli", BrotliCodec(), [](const std::string& bytes) { return PackBytes("brotli", bytes); }, false},
      {"lzf", LzfCodec(), [](const std::string& bytes) { return PackBytes("lzf", bytes); }, false},
      {"crc32c", Crc32cCodec(), [](const std::string& bytes) { return PackBytes("crc32c", bytes); }},
      {"swap", SwapBytesCodec(4), [](const std::string& bytes) { return SwappedBytes(bytes, 4); }, false},
      {"bitshuffle", BitshuffleCodec(4, 16), [](const std::string& bytes) { return BitshuffledBytes(bytes, 4, 16); }, false},
      {"shuffle", ShuffleCodec(8), [](const std::string& bytes) { return ShuffledBytes(bytes, 8); }, false}};
  return cases;
}

class EveryCodec : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Codecs, EveryCodec, testing::ValuesIn(Cases()), [](const auto& which) { return which.param.name; });

TEST_P(EveryCodec, GivesBackWhatWasPacked) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {0, 8, 16, 1000, 4096, 300'000}) {
    const std::string bytes = SomeBytes(random, count);
    const Result<Bytes> decoded = GetParam().codec->Decode(ToBytes(GetParam().pack(bytes)), count);
    ASSERT_TRUE(decoded.ok()) << count << ": " << decoded.status().message();
    EXPECT_TRUE(Text(*decoded) == bytes) << count;
  }
}

TEST_P(EveryCodec, HoldsNoMoreThanItMay) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  const Bytes packed = ToBytes(GetParam().pack(SomeBytes(random, 4000)));
  for (const std::uint64_t most : {0, 1, 3999}) {
    const Result<Bytes> decoded = GetParam().codec->Decode(packed, most);
    ASSERT_FALSE(decoded.ok()) << most;
    EXPECT_EQ(decoded.status().code(), StatusCode::kResourceExhausted) << decoded.status().message();
  }
}

TEST_P(EveryCodec, SurvivesEveryCutAndEveryChange) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  const std::string packed = GetParam().pack(SomeBytes(random, 400));
  int taken = 0;
  for (std::size_t i = 0; i < packed.size(); ++i) {
    const Result<Bytes> cut = GetParam().codec->Decode(ToBytes(packed.substr(0, i)), 1000);
    EXPECT_TRUE(!cut.ok() || cut->size() < 400) << i;
    std::string changed = packed;
    changed[i] = char(changed[i] ^ char(random.Integer(1, 255)));
    const Result<Bytes> decoded = GetParam().codec->Decode(ToBytes(changed), 1000);
    if (decoded.ok()) ++taken;
    EXPECT_TRUE(!decoded.ok() || decoded->size() <= 1000U);
    EXPECT_EQ(decoded.status().message().find('\n'), std::string::npos);
  }
  EXPECT_TRUE(!GetParam().checks || std::size_t(taken) < packed.size());
}

TEST(BloscCodecTest, HasEveryInnerCodecAndShuffle) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  for (const char* const inner : {"blosclz", "lz4", "lz4hc", "snappy", "zlib", "zstd"}) {
    for (const int shuffle : {0, 1, 2}) {
      for (const std::size_t element : {1, 2, 4, 8}) {
        const std::string bytes = SomeBytes(random, 80'000), packed = PackBlosc(inner, shuffle, element, bytes);
        ASSERT_FALSE(packed.empty()) << inner;
        const Result<Bytes> decoded = BloscCodec()->Decode(ToBytes(packed), bytes.size());
        ASSERT_TRUE(decoded.ok()) << inner << shuffle << element;
        EXPECT_TRUE(Text(*decoded) == bytes) << inner << shuffle << element;
      }
    }
  }
}

// It does not tell how many bytes it holds, so its readers state them.
TEST(Lz4BlockTest, HoldsAtMostWhatIsStated) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  const std::string bytes = SomeBytes(random, 4000);
  const Bytes packed = ToBytes(PackBytes("lz4 block", bytes));
  EXPECT_EQ(Text(Lz4BlockCodec()->Decode(packed, 4000).value()), bytes);
  EXPECT_EQ(Text(Lz4BlockCodec()->Decode(packed, 9000).value()), bytes);
  EXPECT_EQ(Lz4BlockCodec()->Decode(packed, 3999).status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(Lz4BlockCodec()->Decode(ToBytes(std::string(100, '\xff')), 9000).status().code(), StatusCode::kDataLoss);
}

// A stream of few bytes may hold very many, and only those that are wanted may take memory.
TEST(Codecs, BombsAreRefused) {
  const std::string zeros(std::size_t{8} << 20, '\0');
  for (const auto& [name, codec] : {std::pair{"bzip2", Bzip2Codec()}, {"xz", XzCodec()}, {"brotli", BrotliCodec()}}) {
    const Bytes bomb = ToBytes(PackBytes(name, zeros));
    EXPECT_LT(bomb.size(), 10'000U);
    EXPECT_EQ(codec->Decode(bomb, 100'000).status().code(), StatusCode::kResourceExhausted) << name;
    EXPECT_EQ(codec->Decode(bomb, zeros.size()).value().size(), zeros.size()) << name;
  }
}

TEST(Crc32cTest, IsThatOfTheStandard) {
  const auto sum = [](const std::string& text) { return Crc32c(std::as_bytes(std::span(text))); };
  EXPECT_EQ(sum("123456789"), 0xe3069283U);
  EXPECT_EQ(sum(std::string(32, '\0')), 0x8a9136aaU);  // RFC 3720, B.4
  EXPECT_EQ(sum(std::string(32, '\xff')), 0x62a8ab43U);
}

TEST(Crc32cTest, NoticesEveryBit) {
  const std::string packed = PackBytes("crc32c", "some bytes of a chunk");
  for (std::size_t bit = 0; bit < 8 * packed.size(); ++bit) {
    std::string changed = packed;
    changed[bit / 8] = char(changed[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_EQ(Crc32cCodec()->Decode(ToBytes(changed), 100).status().code(), StatusCode::kDataLoss);
  }
}

TEST(Codecs, WhatDoesNothingReturnsItsInput) {
  const Bytes bytes = ToBytes("bytes");
  EXPECT_EQ(SwapBytesCodec(1)->Decode(bytes, 5)->span().data(), bytes.span().data());
  EXPECT_EQ(ShuffleCodec(1)->Decode(bytes, 5)->span().data(), bytes.span().data());
  const Bytes checked = ToBytes(PackBytes("crc32c", "bytes"));
  EXPECT_EQ(Crc32cCodec()->Decode(checked, 5)->span().data(), checked.span().data());
}

TEST(Codecs, PartsOfElementsAreDamage) {
  for (const SharedCodec& codec : {SwapBytesCodec(2), ShuffleCodec(2)}) {
    const Status status = codec->Decode(ToBytes("odd"), 100).status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss);
    EXPECT_THAT(status.message(), HasSubstr("has 3 bytes"));
  }
}

TEST(Codecs, AChainIsUndoneFromItsEnd) {
  const std::string bytes = "8 bytes.and 8...";
  const std::string packed = PackBytes("crc32c", PackBytes("zstd", ShuffledBytes(SwappedBytes(bytes, 2), 4)));
  const CodecChain chain = {SwapBytesCodec(2), ShuffleCodec(4), ZstdCodec(), Crc32cCodec()};
  EXPECT_EQ(Text(*DecodeChain(chain, ToBytes(packed), bytes.size())), bytes);
  EXPECT_EQ(DecodeChain(chain, ToBytes(packed), bytes.size() + 1).status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(DecodeChain(chain, ToBytes(packed), bytes.size() - 1).status().code(), StatusCode::kDataLoss);
}

}  // namespace
}  // namespace slabstream
