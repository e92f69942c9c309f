// Payloads: what is packed comes out again, and damage of any kind is found.
#include "common/wire/payload.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/image/run_image.h"
#include "common/wire/digest.h"
#include "common/wire/limits.h"
#include "tests/support/random.h"
#include "tests/support/random_image.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

RunImage Runs(Random& random, PixelFormat format, const PixelBounds& bounds) {
  return EncodeRuns(RandomImage(random, format, bounds), {0, std::uint64_t(bounds.x_end) * std::uint64_t(bounds.y_end)}, bounds.x_end);
}

bool Same(std::span<const std::byte> a, std::span<const std::byte> b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

// Smooth enough that zstd shrinks it.
RunImage SmoothRuns() {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, 64, 64});
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = 0.25F + float(i % 256) / 1024;
  return EncodeRuns(image, {0, 64 * 64}, 64);
}

TEST(Payload, RunsComeOutAsTheyWentIn) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
    for (const PixelBounds& bounds : {PixelBounds{}, PixelBounds{0, 0, 1, 1}, PixelBounds{3, 5, 40, 17}, PixelBounds{0, 0, 200, 100}}) {
      for (const Codec codec : {Codec::kRaw, Codec::kZstd}) {
        const RunImage image = Runs(random, format, bounds);
        EncodedRuns runs{.image = image.header};
        const Bytes packed = PackRuns(Bytes(image.payload), codec, runs);
        EXPECT_EQ(runs.encoded_bytes, packed.size());
        EXPECT_LE(packed.size(), image.payload.size());
        const Result<Bytes> unpacked = UnpackRuns(runs, packed);
        ASSERT_TRUE(unpacked.ok()) << unpacked.status().message();
        EXPECT_TRUE(Same(unpacked->span(), image.payload));
      }
    }
  }
}

TEST(Payload, DigestsAreXxh3OnEveryProcessor) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  std::vector<std::byte> bytes(5000);
  for (std::byte& byte : bytes) byte = std::byte(random.Integer(0, 255));
  for (std::size_t size : {0, 1, 16, 17, 128, 129, 240, 241, 1024, 4096, 4999}) {
    EXPECT_EQ(Digest({bytes.data() + 1, size}), XXH3_64bits(bytes.data() + 1, size)) << size;
  }
}

TEST(Payload, RawRunsAreNotCopied) {
  const RunImage image = SmoothRuns();
  const Bytes payload(image.payload);
  EncodedRuns runs{.image = image.header};
  const Bytes packed = PackRuns(payload, Codec::kRaw, runs);
  EXPECT_EQ(packed.span().data(), payload.span().data());
  EXPECT_EQ(UnpackRuns(runs, packed)->span().data(), payload.span().data());
}

TEST(Payload, SmoothImagesShrinkAndNoiseStaysRaw) {
  const RunImage smooth = SmoothRuns();
  EncodedRuns runs{.image = smooth.header};
  EXPECT_LT(PackRuns(Bytes(smooth.payload), Codec::kZstd, runs).size(), smooth.payload.size() / 4);
  EXPECT_EQ(runs.codec, Codec::kZstd);

  Random random(5);
  SCOPED_TRACE(random.trace());
  std::vector<std::byte> noise(PayloadBytes(smooth.header));
  for (std::byte& byte : noise) byte = std::byte(random.Integer(0, 255));
  PackRuns(Bytes(noise), Codec::kZstd, runs);
  EXPECT_EQ(runs.codec, Codec::kRaw);
  EXPECT_EQ(runs.encoded_bytes, noise.size());
}

TEST(Payload, WordsAreGroupedBySignificanceBeforeZstd) {
  // The layout that docs/wire.md gives to other programs, undone by hand.
  const RunImage image = SmoothRuns();
  EncodedRuns runs{.image = image.header};
  const Bytes packed = PackRuns(Bytes(image.payload), Codec::kZstd, runs);
  std::vector<std::byte> grouped(image.payload.size());
  ASSERT_EQ(ZSTD_decompress(grouped.data(), grouped.size(), packed.span().data(), packed.size()), grouped.size());
  const std::size_t words = grouped.size() / 4;
  for (std::size_t i = 0; i < grouped.size(); ++i) ASSERT_EQ(grouped[(i % 4) * words + i / 4], image.payload[i]) << i;
}

TEST(Payload, DamagedRunsAreDataLoss) {
  const RunImage image = SmoothRuns();
  for (const Codec codec : {Codec::kRaw, Codec::kZstd}) {
    EncodedRuns runs{.image = image.header};
    const Bytes packed = PackRuns(Bytes(image.payload), codec, runs);
    std::vector<std::byte> bytes(packed.span().begin(), packed.span().end());
    for (std::size_t i = 0; i < bytes.size(); i += bytes.size() / 50 + 1) {
      std::vector<std::byte> altered = bytes;
      altered[i] ^= std::byte{4};
      EXPECT_EQ(UnpackRuns(runs, Bytes(altered)).status().code(), StatusCode::kDataLoss);
      altered.resize(i);
      EXPECT_EQ(UnpackRuns(runs, Bytes(altered)).status().code(), StatusCode::kDataLoss);
    }
  }
}

TEST(Payload, FrameOfAnotherSizeIsRefusedBeforeItIsUnpacked) {
  // A digest proves nothing about a sender who means harm: a frame that unpacks to more or less than the header says.
  const RunImage image = SmoothRuns();
  for (const std::size_t size : {image.payload.size() - 4, image.payload.size() + 4, std::size_t{1} << 26}) {
    std::vector<std::byte> zeros(size), packed(ZSTD_compressBound(size));
    packed.resize(ZSTD_compress(packed.data(), packed.size(), zeros.data(), zeros.size(), 1));
    EncodedRuns runs{.image = image.header};
    PackRuns(Bytes(image.payload), Codec::kRaw, runs);
    EncodedRuns lie = runs;
    lie.codec = Codec::kZstd;
    lie.encoded_bytes = packed.size();
    lie.digest = XXH3_64bits(packed.data(), packed.size());
    EXPECT_THAT(UnpackRuns(lie, Bytes(packed)).status().message(),
                HasSubstr("zstd frame of " + std::to_string(size) + " bytes, the header says " + std::to_string(image.payload.size())));
  }
}

TEST(Payload, ChunksComeOutAsTheyWentIn) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  for (const std::size_t size : {std::size_t{1}, std::size_t{2}, std::size_t{1000}, std::size_t{kChunkBytes}}) {
    for (const bool noise : {false, true}) {
      std::vector<std::byte> samples(size);
      for (std::byte& byte : samples) byte = std::byte(noise ? random.Integer(0, 255) : 7);
      for (const Codec codec : {Codec::kRaw, Codec::kZstd}) {
        Chunk chunk;
        const Bytes packed = PackChunk(Bytes(samples), codec, chunk);
        EXPECT_EQ(chunk.raw_bytes, size);
        EXPECT_EQ(chunk.encoded_bytes, packed.size());
        EXPECT_EQ(chunk.codec, codec == Codec::kZstd && !noise && size > 100 ? Codec::kZstd : Codec::kRaw);
        std::vector<std::byte> unpacked(size, std::byte{0xAA});
        const Status status = UnpackChunk(chunk, packed.span(), unpacked);
        ASSERT_TRUE(status.ok()) << status.message();
        EXPECT_EQ(unpacked, samples);
      }
    }
  }
}

TEST(Payload, DamagedChunksAreDataLoss) {
  std::vector<std::byte> samples(5000);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = std::byte(i / 16);
  for (const Codec codec : {Codec::kRaw, Codec::kZstd}) {
    Chunk chunk;
    const Bytes packed = PackChunk(Bytes(samples), codec, chunk);
    std::vector<std::byte> room(samples.size());
    for (std::size_t i = 0; i < packed.size(); i += packed.size() / 50 + 1) {
      std::vector<std::byte> altered(packed.span().begin(), packed.span().end());
      altered[i] ^= std::byte{32};
      const Status status = UnpackChunk(chunk, altered, room);
      // Bits of a zstd frame that do not reach the content may be flipped without harm.
      EXPECT_TRUE(status.code() == StatusCode::kDataLoss || (status.ok() && room == samples)) << i;
      EXPECT_EQ(UnpackChunk(chunk, packed.span().first(i), room).code(), StatusCode::kDataLoss);
    }
    Chunk wrong = chunk;
    wrong.digest ^= 1;
    EXPECT_EQ(UnpackChunk(wrong, packed.span(), room).code(), StatusCode::kDataLoss);
    std::vector<std::byte> small_room(samples.size() - 1);
    EXPECT_EQ(UnpackChunk(chunk, packed.span(), small_room).code(), StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace slabstream
