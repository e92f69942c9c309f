// Compressed files: members that follow each other, what lies behind them, and ends that come too soon.
#include "data/volume_io/decompressor.h"

#include <gtest/gtest.h>

#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/volume_io/volume_files.h"

namespace slabstream {
namespace {

class DecompressorTest : public testing::Test {
 protected:
  // What is read in pieces of so many bytes, and whether the stream ends well then.
  std::pair<std::string, bool> Read(const std::string& file, Compression compression, std::size_t piece) {
    WriteFile(directory_ / "packed", "head" + file);
    std::ifstream stream(directory_ / "packed", std::ios::binary);
    const auto decompressor = Decompressor::Make(compression, stream, 4);
    std::string all, bytes(piece, '\0');
    for (std::size_t count = piece; count == piece;) {
      count = decompressor->Read(std::as_writable_bytes(std::span(bytes)));
      all += bytes.substr(0, count);
    }
    return {all, decompressor->EndsWell() && !decompressor->damaged()};
  }

  static std::string SomeBytes(std::size_t count) {
    std::string bytes(count, '\0');
    for (std::size_t i = 0; i < count; ++i) bytes[i] = char(i * i / 1000);
    return bytes;
  }

  const TemporaryDirectory directory_;
};

TEST_F(DecompressorTest, MembersOfGzipAreOneStream) {
  const std::string bytes = SomeBytes(500'000);
  std::string packed;
  for (std::size_t at = 0, count = 0; at < bytes.size(); at += count, count = 3 * count + 1) packed += Gzip(bytes.substr(at, count));
  for (const std::size_t piece : {1, 100, 65'536, 1'000'000}) {
    for (const std::string& behind : {std::string(), std::string(1000, '\0'), std::string("padding")}) {
      const auto [read, well] = Read(packed + behind, Compression::kDeflate, piece);
      EXPECT_TRUE(read == bytes) << piece << behind;
      EXPECT_TRUE(well) << piece << behind;
    }
  }
  EXPECT_FALSE(Read(packed + Gzip("more").substr(0, 15), Compression::kDeflate, 1000).second);
}

TEST_F(DecompressorTest, PaddingBehindOneMemberIsIgnored) {
  const std::string bytes = SomeBytes(100'000);
  for (const std::string& behind : {std::string(), std::string(100'000, '\0'), std::string(3, 'x')}) {
    EXPECT_EQ(Read(Zlib(bytes) + behind, Compression::kDeflate, 999), std::pair(bytes, true));
    EXPECT_EQ(Read(PackBytes("deflate", bytes) + behind, Compression::kBareDeflate, 999), std::pair(bytes, true));
  }
}

TEST_F(DecompressorTest, EndsThatComeTooSoonAreFound) {
  const std::string bytes = SomeBytes(20'000);
  for (const auto& [packed, compression] : {std::pair{Gzip(bytes), Compression::kDeflate},
                                            {Zlib(bytes), Compression::kDeflate},
                                            {PackBytes("deflate", bytes), Compression::kBareDeflate},
                                            {PackBytes("bzip2", bytes), Compression::kBzip2}}) {
    for (std::size_t length = 0; length < packed.size(); length += 1 + length / 50) {
      const auto [read, well] = Read(packed.substr(0, length), compression, 5000);
      EXPECT_FALSE(well) << length;
      EXPECT_TRUE(bytes.starts_with(read)) << length;
    }
    EXPECT_EQ(Read(packed, compression, 5000), std::pair(bytes, true));
  }
}

}  // namespace
}  // namespace slabstream
