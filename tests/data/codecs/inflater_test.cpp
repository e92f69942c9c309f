// Members come out as zlib reads them, however they are cut into pieces, and damage is found.
#include "data/codecs/inflater.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "data/codecs/codecs.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr int kLargestWindow = 15, kGzipHeader = 16;  // zlib's numbers
int WindowBits(DeflateFrame frame) {
  return frame == DeflateFrame::kGzip ? kLargestWindow + kGzipHeader : frame == DeflateFrame::kZlib ? kLargestWindow : -kLargestWindow;
}

// One member of every kind that zlib makes: stored, with the codes of the standard or with its own, in one block or more; of gzip with
// any field in its header.
std::string Packed(DeflateFrame frame, const std::string& bytes, Random& random) {
  z_stream stream{};
  CHECK_EQ(deflateInit2(&stream, random.Integer(0, 9), Z_DEFLATED, WindowBits(frame), random.Integer(1, 9), random.Integer(0, 4)), Z_OK);
  std::string name(100, 'n'), comment(20, 'c'), extra(300, 'e');
  gz_header header{};
  if (random.Chance(0.5)) header.name = reinterpret_cast<Bytef*>(name.data());
  if (random.Chance(0.5)) header.comment = reinterpret_cast<Bytef*>(comment.data());
  if (random.Chance(0.5)) header.extra = reinterpret_cast<Bytef*>(extra.data());
  header.extra_len = uInt(extra.size());
  header.hcrc = random.Integer(0, 1);
  if (frame == DeflateFrame::kGzip) CHECK_EQ(deflateSetHeader(&stream, &header), Z_OK);
  std::string packed(2 * bytes.size() + 2000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  stream.avail_in = uInt(bytes.size() / 2);
  CHECK_EQ(deflate(&stream, random.Chance(0.5) ? Z_FULL_FLUSH : Z_BLOCK), Z_OK);
  stream.avail_in += uInt(bytes.size() - bytes.size() / 2);
  CHECK_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string AnyBytes(Random& random, std::size_t count) {
  std::string bytes(count, '\0');
  const int kind = random.Integer(0, 2), values = random.Integer(1, 255);
  for (std::size_t i = 0; kind > 0 && i < count; ++i)
    bytes[i] = char(kind == 1 || random.Chance(0.1) ? random.Integer(0, values) : int(i / 7 % 50));
  return bytes;
}

struct Inflated {
  bool ended;
  std::string bytes;
};

Inflated ByZlib(DeflateFrame frame, const std::string& packed, std::size_t room) {
  z_stream stream{};
  CHECK_EQ(inflateInit2(&stream, WindowBits(frame)), Z_OK);
  Inflated inflated{false, std::string(room, '\0')};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = uInt(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(inflated.bytes.data());
  stream.avail_out = uInt(room);
  inflated.ended = inflate(&stream, Z_NO_FLUSH) == Z_STREAM_END;
  inflated.bytes.resize(stream.total_out);
  inflateEnd(&stream);
  return inflated;
}

// `most_in`, `most_out`: bytes of a piece. Each piece has memory of its own, so that a sanitizer sees who goes beyond it.
Inflated InPieces(DeflateFrame frame, const std::string& packed, std::size_t room, std::size_t most_in, std::size_t most_out) {
  Inflater inflater(frame);
  Inflated inflated{false, ""};
  for (std::size_t at = 0; at < packed.size() && !inflated.ended; at += most_in) {
    const std::vector<char> piece(packed.begin() + std::ptrdiff_t(at),
                                  packed.begin() + std::ptrdiff_t(std::min(at + most_in, packed.size())));
    std::span<const std::byte> in = std::as_bytes(std::span(piece));
    for (std::span<std::byte> out; out.empty();) {
      std::vector<char> made(std::min(most_out, room - inflated.bytes.size()));
      if (made.empty()) return inflated;
      out = std::as_writable_bytes(std::span(made));
      const StreamState step = inflater.Advance(in, out);
      if (step == StreamState::kDamaged) return inflated;
      inflated.bytes.append(made.data(), made.size() - out.size());
      inflated.ended = step == StreamState::kEnded;
      if (inflated.ended) break;
    }
  }
  return inflated;
}

class EveryFrame : public testing::TestWithParam<DeflateFrame> {};
INSTANTIATE_TEST_SUITE_P(Frames, EveryFrame, testing::Values(DeflateFrame::kGzip, DeflateFrame::kZlib, DeflateFrame::kBare));

TEST_P(EveryFrame, PiecesOfAnySizeMakeTheWhole) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {0, 1, 2, 9, 300, 5000, 32'768, 70'000, 200'000}) {
    const std::string bytes = AnyBytes(random, count), packed = Packed(GetParam(), bytes, random);
    for (const std::size_t most_in : {1, 2, 7, 400, 1 << 16}) {
      for (const std::size_t most_out : {1, 13, 4000, 1 << 16, 1 << 20}) {
        if (count > 5000 && most_in + most_out < 400) continue;  // to take less time
        const Inflated inflated = InPieces(GetParam(), packed, count + 1, most_in, most_out);
        EXPECT_TRUE(inflated.ended) << count << " by " << most_in << " to " << most_out;
        EXPECT_TRUE(inflated.bytes == bytes) << count << " by " << most_in << " to " << most_out;
      }
    }
  }
}

// What zlib takes is taken, as the same bytes. A frame tells everything else. ISA-L also takes codes that are not complete, so where there
// is no frame it may take what zlib refuses.
TEST_P(EveryFrame, EveryFlippedBitIsFoundOrChangesNothing) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {0, 1, 5, 40, 300, 1000, 3000, 100'000}) {
    for (int i = 0; i < 4; ++i) {
      const std::string bytes = AnyBytes(random, count), packed = Packed(GetParam(), bytes, random);
      const std::size_t bits = 8 * packed.size(), tried = std::min<std::size_t>(bits, count > 3000 ? 400 : 4000);
      for (std::size_t bit = 0; bit < tried; ++bit) {
        const std::size_t flipped = 2 * bit < tried ? bit : bits == tried ? bit : random.Integer<std::size_t>(0, bits - 1);
        std::string damaged = packed;
        damaged[flipped / 8] = char(damaged[flipped / 8] ^ (1 << flipped % 8));
        const Inflated oracle = ByZlib(GetParam(), damaged, count + 1);
        const Inflated inflated = InPieces(GetParam(), damaged, count + 1, random.Chance(0.5) ? damaged.size() : 1000, count + 1);
        EXPECT_TRUE(inflated.ended || !oracle.ended) << count << " " << flipped;
        EXPECT_TRUE(!oracle.ended || inflated.bytes == oracle.bytes) << count << " " << flipped;
        EXPECT_TRUE(GetParam() == DeflateFrame::kBare || !inflated.ended || inflated.bytes == bytes) << count << " " << flipped;
      }
    }
  }
}

TEST_P(EveryFrame, EveryTruncationIsFound) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {0, 1, 5, 40, 300, 1000, 3000}) {
    const std::string packed = Packed(GetParam(), AnyBytes(random, count), random);
    for (std::size_t length = 0; length < packed.size(); ++length) {
      EXPECT_FALSE(InPieces(GetParam(), packed.substr(0, length), count + 1, 1 << 16, count + 1).ended) << count << " " << length;
    }
  }
}

TEST_P(EveryFrame, TheNextMemberBeginsBehindTheEnd) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {0, 1, 100, 5000, 100'000}) {
    const std::string packed = Packed(GetParam(), AnyBytes(random, count), random), more = packed + "behind";
    std::string made(count + 1, '\0');
    std::span<const std::byte> in = std::as_bytes(std::span(more));
    std::span<std::byte> out = std::as_writable_bytes(std::span(made));
    Inflater inflater(GetParam());
    ASSERT_EQ(inflater.Advance(in, out), StreamState::kEnded);
    EXPECT_EQ(in.size(), 6U) << count;
    EXPECT_EQ(out.size(), 1U) << count;
  }
}

TEST(InflaterTest, APresetDictionaryIsDamage) {
  z_stream stream{};
  CHECK_EQ(deflateInit(&stream, 6), Z_OK);
  const std::string dictionary = "some bytes";
  CHECK_EQ(deflateSetDictionary(&stream, reinterpret_cast<const Bytef*>(dictionary.data()), uInt(dictionary.size())), Z_OK);
  std::string bytes = dictionary, packed(200, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  CHECK_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  for (const std::size_t most_in : {1, 200}) EXPECT_FALSE(InPieces(DeflateFrame::kZlib, packed, 100, most_in, 100).ended);
  const auto view = std::as_bytes(std::span(packed));
  EXPECT_EQ(ZlibCodec()->Decode(Bytes(std::vector<std::byte>(view.begin(), view.end())), 100).status().code(), StatusCode::kDataLoss);
}

}  // namespace
}  // namespace slabstream
