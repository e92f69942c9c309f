// Precomputed volumes, written chunk by chunk as Neuroglancer's documents say.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <map>

#include "data/open/open_source.h"
#include "data/precomputed/jpeg_codec.h"
#include "data/precomputed/segmentation_codec.h"
#include "data/precomputed/sharding.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using Triple = std::array<std::uint64_t, 3>;

Bytes BytesOf(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return Bytes(std::vector<std::byte>(bytes.begin(), bytes.end()));
}

std::string Word(std::uint32_t word) { return std::string(reinterpret_cast<const char*>(&word), sizeof(word)); }

// One channel as the documents define it: headers of all blocks, then for each block its values and its table.
template <class Label>
std::string Segmented(const std::vector<Label>& labels, const Triple& size, const Triple& block) {
  Triple counts;
  for (std::size_t axis = 0; axis < 3; ++axis) counts[axis] = (size[axis] + block[axis] - 1) / block[axis];
  std::vector<std::uint32_t> words(2 * counts[0] * counts[1] * counts[2]);
  std::size_t header = 0;
  for (std::uint64_t bz = 0; bz < counts[2]; ++bz) {
    for (std::uint64_t by = 0; by < counts[1]; ++by) {
      for (std::uint64_t bx = 0; bx < counts[0]; ++bx, header += 2) {
        std::vector<Label> in_block;
        for (std::uint64_t z = 0; z < block[2]; ++z) {
          for (std::uint64_t y = 0; y < block[1]; ++y) {
            for (std::uint64_t x = 0; x < block[0]; ++x) {
              const std::uint64_t px = std::min(bx * block[0] + x, size[0] - 1), py = std::min(by * block[1] + y, size[1] - 1),
                                  pz = std::min(bz * block[2] + z, size[2] - 1);
              in_block.push_back(labels[(pz * size[1] + py) * size[0] + px]);
            }
          }
        }
        std::vector<Label> table = in_block;
        std::ranges::sort(table);
        table.erase(std::unique(table.begin(), table.end()), table.end());
        unsigned bits = 0;
        while ((std::uint64_t{1} << bits) < table.size()) bits = bits == 0 ? 1 : 2 * bits;
        const std::size_t values = words.size();
        words.resize(values + (in_block.size() * bits + 31) / 32);
        for (std::size_t i = 0; bits > 0 && i < in_block.size(); ++i) {
          const auto number = std::uint32_t(std::ranges::find(table, in_block[i]) - table.begin());
          words[values + i * bits / 32] |= number << (i * bits % 32);
        }
        words[header] = std::uint32_t(words.size()) | bits << 24;
        words[header + 1] = std::uint32_t(values);
        for (const Label label : table) {
          for (std::size_t i = 0; i < sizeof(Label) / 4; ++i) words.push_back(std::uint32_t(std::uint64_t{label} >> (32 * i)));
        }
      }
    }
  }
  return std::string(reinterpret_cast<const char*>(words.data()), 4 * words.size());
}

template <class Label>
void CheckSegmentations(Random& random) {
  for (int round = 0; round < 60; ++round) {
    Triple size, block;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      size[axis] = random.Integer<std::uint64_t>(1, 20);
      block[axis] = random.Integer<std::uint64_t>(1, 9);
    }
    const int kinds = random.Integer(1, 400);
    std::vector<Label> labels(size[0] * size[1] * size[2]);
    std::string packed = Word(2), second;
    std::string expected;
    for (int channel = 0; channel < 2; ++channel) {
      for (Label& label : labels) label = Label(random.Integer(0, kinds - 1)) * Label(0x9e3779b97f4a7c15U);
      const std::string one = Segmented(labels, size, block);
      if (channel == 0) packed += Word(std::uint32_t(2 + one.size() / 4));
      packed += one;
      expected += std::string(reinterpret_cast<const char*>(labels.data()), labels.size() * sizeof(Label));
    }
    const SharedCodec codec = precomputed::SegmentationCodec(size, block, 2, sizeof(Label));
    const Result<Bytes> decoded = codec->Decode(BytesOf(packed), expected.size());
    ASSERT_TRUE(decoded.ok()) << decoded.status().message();
    ASSERT_TRUE(std::ranges::equal(decoded->span(), std::as_bytes(std::span(expected))));
    // Whatever is cut off or altered is an answer or a refusal.
    const Result<Bytes> cut = codec->Decode(BytesOf(packed.substr(0, random.Integer<std::size_t>(0, packed.size() - 4))), expected.size());
    EXPECT_FALSE(cut.ok() && cut->size() != expected.size());
    packed[random.Integer<std::size_t>(0, packed.size() - 1)] = char(random.Integer(0, 255));
    (void)codec->Decode(BytesOf(packed), expected.size());
  }
}

TEST(SegmentationCodec, DecodesLabelsOfAnyNumber) {
  Random random(9);
  SCOPED_TRACE(random.trace());
  CheckSegmentations<std::uint32_t>(random);
  CheckSegmentations<std::uint64_t>(random);
}

TEST(SegmentationCodec, TakesNoMemoryForWhatIsTooMuch) {
  const SharedCodec codec = precomputed::SegmentationCodec({1 << 20, 1 << 20, 1 << 20}, {8, 8, 8}, 1, 8);
  EXPECT_EQ(codec->Decode(BytesOf(std::string(64, '\1')), 1 << 20).status().code(), StatusCode::kResourceExhausted);
}

class PrecomputedTest : public testing::Test {
 protected:
  Result<std::shared_ptr<VolumeSource>> Open(const ReadOptions& options = {}) { return OpenSource(root_, options, context_); }
  void ExpectRefused(const ReadOptions& options, const std::string& why) { ExpectRefusal(Open(options), why); }

  TemporaryDirectory directory_;
  const std::string root_ = directory_ / "em";
  SourceContext context_ = TestReadContext();
};

std::string Info(const std::string& type, const std::string& data_type, int channels, const std::string& scales) {
  return fmt::format(
      R"({{"@type": "neuroglancer_multiscale_volume", "type": "{}", "data_type": "{}", "num_channels": {}, "scales": [{}]}})", type,
      data_type, channels, scales);
}

// The value of a voxel in a channel.
std::uint16_t Value(int x, int y, int z, int channel) { return std::uint16_t(channel * 20000 + z * 1000 + y * 30 + x); }

TEST_F(PrecomputedTest, RawChunksPlainAndGzipped) {
  const int size[3] = {10, 7, 5}, chunk[3] = {4, 4, 3}, offset[3] = {100, -3, 0};
  WriteFile(root_ + "/info", Info("image", "uint16", 2, R"({"key": "8_8_40", "size": [10, 7, 5], "chunk_sizes": [[4, 4, 3]],
    "resolution": [8, 8, 40], "voxel_offset": [100, -3, 0], "encoding": "raw"},
    {"key": "16_16_40", "size": [5, 4, 5], "chunk_sizes": [[64, 64, 64]], "resolution": [16, 16, 40],
    "voxel_offset": [50, -2, 0], "encoding": "raw"})"));
  int number = 0;
  for (int z = 0; z < size[2]; z += chunk[2]) {
    for (int y = 0; y < size[1]; y += chunk[1]) {
      for (int x = 0; x < size[0]; x += chunk[0], ++number) {
        const int end[3] = {std::min(x + chunk[0], size[0]), std::min(y + chunk[1], size[1]), std::min(z + chunk[2], size[2])};
        std::string bytes;
        for (int channel = 0; channel < 2; ++channel) {
          for (int k = z; k < end[2]; ++k) {
            for (int j = y; j < end[1]; ++j) {
              for (int i = x; i < end[0]; ++i) {
                const std::uint16_t value = Value(i, j, k, channel);
                bytes += std::string(reinterpret_cast<const char*>(&value), 2);
              }
            }
          }
        }
        const std::string name = fmt::format("{}/8_8_40/{}-{}_{}-{}_{}-{}", root_, offset[0] + x, offset[0] + end[0], offset[1] + y,
                                             offset[1] + end[1], offset[2] + z, offset[2] + end[2]);
        if (number == 5) continue;  // is not there
        WriteFile(name + (number % 3 == 2 ? ".gz" : ""), number % 3 == 0 ? bytes : Gzip(bytes));
      }
    }
  }
  ExpectRefused({.channel = 2}, "em: has 2 channels, so channel must be 0 to 1");
  EXPECT_EQ((*Open({}))->info().channel, 0);
  const auto source = Open({.channel = 1});
  ASSERT_TRUE(source.ok()) << source.status().message();
  const SourceInfo& info = (*source)->info();
  EXPECT_EQ(info.channel, 1);
  EXPECT_EQ(info.format, "Neuroglancer precomputed");
  EXPECT_EQ(SamplesOf<std::uint16_t>(*(*Open({}))->At(0, 1)).value(), SamplesOf<std::uint16_t>(**source).value());
  EXPECT_FALSE(info.labels);
  ASSERT_EQ(info.levels.size(), 2U);
  const VolumeGeometry& fine = info.levels[0].description.geometry;
  EXPECT_EQ(fine.size, (Index3{10, 7, 5}));
  EXPECT_EQ(fine.spacing, (Vec3{8, 8, 40}));
  EXPECT_EQ(fine.orientation.unit, LengthUnit::kNanometre);
  EXPECT_EQ(fine.orientation.origin, (Vec3{804, -20, 20}));
  EXPECT_EQ(info.levels[1].description.geometry.orientation.origin, (Vec3{808, -24, 20}));
  const auto samples = SamplesOf<std::uint16_t>(**source);
  ASSERT_TRUE(samples.ok()) << samples.status().message();
  int missing = 0;
  for (int z = 0, i = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x, ++i) {
        const bool there = !(x >= 8 && y >= 4 && z < 3);
        missing += there ? 0 : 1;
        ASSERT_EQ((*samples)[std::size_t(i)], there ? Value(x, y, z, 1) : 0) << x << " " << y << " " << z;
      }
    }
  }
  EXPECT_GT(missing, 0);
  EXPECT_THAT(SamplesOf<std::uint16_t>(**source, 1).value(), testing::Each(0)) << "no chunk of this level is there";

  WriteFile(root_ + "/8_8_40/100-104_-3-1_0-3", "short");
  const Status damaged = SamplesOf<std::uint16_t>(**Open({.channel = 0})).status();
  EXPECT_EQ(damaged.code(), StatusCode::kDataLoss);
  EXPECT_THAT(damaged.message(), HasSubstr("em/8_8_40/100-104_-3-1_0-3: has 5 bytes, expected 192"));
}

// CloudVolume names the packing of a file in its ending, unless it writes to a server.
TEST_F(PrecomputedTest, FilesOfEveryEndingAreUnpacked) {
  const std::pair<const char*, const char*> packings[] = {{"", ""},          {".gz", "gzip"}, {".br", "brotli"}, {".zstd", "zstd"},
                                                          {".bz2", "bzip2"}, {".xz", "xz"},   {"", "gzip"},      {"", "zstd"}};
  std::vector<std::uint32_t> labels(4 * 4 * 4 * std::size(packings));
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = std::uint32_t(i / 5);
  for (const std::string encoding : {"raw", "compressed_segmentation"}) {
    std::filesystem::remove_all(root_);
    WriteFile(root_ + "/info", Info("segmentation", "uint32", 1,
                                    fmt::format(R"({{"key": "s", "size": [4, 4, {}], "chunk_sizes": [[4, 4, 4]], "resolution": [1, 1, 1],
      "encoding": "{}", "compressed_segmentation_block_size": [2, 2, 2]}})",
                                                4 * std::size(packings), encoding)));
    for (std::size_t i = 0; i < std::size(packings); ++i) {
      const std::vector<std::uint32_t> part(labels.begin() + std::ptrdiff_t(64 * i), labels.begin() + std::ptrdiff_t(64 * (i + 1)));
      const std::string bytes = encoding == "raw" ? std::string(reinterpret_cast<const char*>(part.data()), 256)
                                                  : Word(1) + Segmented(part, {4, 4, 4}, {2, 2, 2});
      WriteFile(fmt::format("{}/s/0-4_0-4_{}-{}{}", root_, 4 * i, 4 * i + 4, packings[i].first), PackBytes(packings[i].second, bytes));
    }
    const auto samples = SamplesOf<float>(**Open());
    ASSERT_TRUE(samples.ok()) << samples.status().message();
    EXPECT_TRUE(std::ranges::equal(*samples, labels)) << encoding;
  }
  // What is not packed as its ending says is no chunk of zeros.
  WriteFile(root_ + "/s/0-4_0-4_8-12.br", "no brotli");
  const Status damaged = SamplesOf<float>(**Open()).status();
  EXPECT_EQ(damaged.code(), StatusCode::kDataLoss);
  EXPECT_THAT(damaged.message(), HasSubstr("em/s/0-4_0-4_8-12.br: damaged: these are no bytes of brotli"));
}

TEST_F(PrecomputedTest, JpegChunks) {
  for (const int channels : {1, 3}) {
    WriteFile(root_ + "/info", Info("image", "uint8", channels, R"({"key": "0", "size": [8, 4, 8], "chunk_sizes": [[8, 4, 4]],
      "resolution": [1, 1, 1], "encoding": "jpeg"})"));
    for (const int z : {0, 4}) {
      FileBytes pixels;
      for (int i = 0; i < 8 * 16; ++i) {
        for (int channel = 0; channel < channels; ++channel) pixels += char(100 + 20 * channel + z);
      }
      const std::string path = directory_ / "picture.jpg";
      WriteJpeg(path, {8, 16, 1}, channels, pixels, false);
      WriteFile(fmt::format("{}/0/0-8_0-4_{}-{}", root_, z, z + 4), ReadFile(path));
    }
    const auto source = Open({.channel = channels - 1});
    ASSERT_TRUE(source.ok()) << source.status().message();
    const auto samples = SamplesOf<std::uint8_t>(**source);
    ASSERT_TRUE(samples.ok()) << samples.status().message();
    for (std::size_t i = 0; i < samples->size(); ++i) EXPECT_NEAR((*samples)[i], 100 + 20 * (channels - 1) + (i < 128 ? 0 : 4), 3) << i;
  }
  WriteJpeg(directory_ / "picture.jpg", {8, 8, 1}, 3, FileBytes(192, 'x'), false);
  const std::string small = ReadFile(directory_ / "picture.jpg"), chunk = root_ + "/0/0-8_0-4_0-4";
  const std::string good = ReadFile(chunk);
  for (const auto& [bytes, why] :
       {std::pair<std::string, const char*>{small, "is a JPEG picture of 64 pixels of 3 components, must be of 128 of 3"},
        {"no picture", "not a JPEG picture"},
        {good.substr(0, good.size() - 2), "truncated or damaged"}}) {
    WriteFile(chunk, bytes);
    const Status status = SamplesOf<std::uint8_t>(**Open({.channel = 0})).status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << why;
    EXPECT_THAT(status.message(), testing::AllOf(HasSubstr("em/0/0-8_0-4_0-4: "), HasSubstr(why)));
  }
}

TEST_F(PrecomputedTest, SegmentationsAreLabels) {
  WriteFile(root_ + "/info", Info("segmentation", "uint32", 1, R"({"key": "seg", "size": [5, 6, 7], "chunk_sizes": [[8, 8, 8]],
    "resolution": [4, 4, 4], "encoding": "compressed_segmentation", "compressed_segmentation_block_size": [4, 4, 4]})"));
  std::vector<std::uint32_t> labels(5 * 6 * 7);
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = std::uint32_t(i * 7 % 50);
  WriteFile(root_ + "/seg/0-5_0-6_0-7", Gzip(Word(1) + Segmented(labels, {5, 6, 7}, {4, 4, 4})));
  const auto source = Open();
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_TRUE((*source)->info().labels);
  const auto samples = SamplesOf<float>(**source);
  ASSERT_TRUE(samples.ok()) << samples.status().message();
  EXPECT_TRUE(std::ranges::equal(*samples, labels));
}

std::string ShardingText(const std::string& hash, int minishard_bits, int shard_bits, bool gzip = false) {
  return fmt::format(R"({{"@type": "neuroglancer_uint64_sharded_v1", "hash": "{}", "preshift_bits": 0, "minishard_bits": {},
    "shard_bits": {}, "minishard_index_encoding": "{}", "data_encoding": "{}"}})",
                     hash, minishard_bits, shard_bits, gzip ? "gzip" : "raw", gzip ? "gzip" : "raw");
}

// The places are those of a shard that TensorStore wrote.
TEST(Sharding, PlacesChunksAsOthersDo) {
  EXPECT_EQ(precomputed::ChunkNumber({1, 2, 3}, {2, 4, 8}), 29U);
  EXPECT_EQ(precomputed::ChunkNumber({4, 2, 4}, {5, 3, 5}), 208U);
  const precomputed::Sharding murmur{.minishard_bits = 32, .shard_bits = 32, .murmur = true};
  EXPECT_EQ(precomputed::PlaceOf(murmur, 0).file, "4772b084.shard");
  EXPECT_EQ(precomputed::PlaceOf(murmur, 0).minishard, 3760762433U);
  EXPECT_EQ(precomputed::PlaceOf(murmur, 123456789012345).file, "9b457016.shard");
  const precomputed::Sharding identity{.preshift_bits = 2, .minishard_bits = 3, .shard_bits = 5};
  EXPECT_EQ(precomputed::PlaceOf(identity, 0x1234).file, "11.shard");
  EXPECT_EQ(precomputed::PlaceOf(identity, 0x1234).minishard, 5U);
}

std::string LongWord(std::uint64_t word) { return std::string(reinterpret_cast<const char*>(&word), sizeof(word)); }

// Writes a shard for each of `chunks` by their numbers.
void WriteShards(const std::string& folder, const precomputed::Sharding& sharding, const std::map<std::uint64_t, std::string>& chunks) {
  std::map<std::string, std::map<std::uint64_t, std::vector<std::uint64_t>>> shards;  // by file and minishard, in order
  for (const auto& [number, bytes] : chunks) {
    const precomputed::ShardPlace place = precomputed::PlaceOf(sharding, number);
    shards[place.file][place.minishard].push_back(number);
  }
  for (const auto& [file, minishards] : shards) {
    std::string index(sharding.index_bytes(), '\0'), data;
    for (const auto& [minishard, numbers] : minishards) {
      std::string deltas, gaps, lengths;
      std::uint64_t last = 0, end = 0;
      for (const std::uint64_t number : numbers) {
        const std::string bytes = sharding.gzip_data ? Gzip(chunks.at(number)) : chunks.at(number);
        data += "gap";
        deltas += LongWord(number - last);
        gaps += LongWord(data.size() - end);
        lengths += LongWord(bytes.size());
        data += bytes;
        last = number;
        end = data.size();
      }
      const std::string packed = sharding.gzip_index ? Gzip(deltas + gaps + lengths) : deltas + gaps + lengths;
      index.replace(16 * minishard, 16, LongWord(data.size()) + LongWord(data.size() + packed.size()));
      data += packed;
    }
    WriteFile(folder + "/" + file, index + data);
  }
}

TEST_F(PrecomputedTest, ChunksInShards) {
  for (const bool gzip : {false, true}) {
    for (const std::string hash : {"identity", "murmurhash3_x86_128"}) {
      std::filesystem::remove_all(root_);
      WriteFile(root_ + "/info", Info("image", "uint8", 1,
                                      R"({"key": "s", "size": [9, 7, 8], "chunk_sizes": [[4, 4, 4]],
        "resolution": [1, 1, 1], "encoding": "raw", "sharding": )" +
                                          ShardingText(hash, 2, 1, gzip) + "}"));
      std::map<std::uint64_t, std::string> chunks;
      for (std::uint64_t z = 0; z < 2; ++z) {
        for (std::uint64_t y = 0; y < 2; ++y) {
          for (std::uint64_t x = 0; x < 3; ++x) {
            if (x == 1 && y == 1 && z == 0) continue;  // is not there
            const std::size_t count = (x == 2 ? 1U : 4U) * (y == 1 ? 3U : 4U) * 4U;
            chunks[precomputed::ChunkNumber({x, y, z}, {3, 2, 2})] = std::string(count, char(100 + 20 * z + 5 * y + x));
          }
        }
      }
      const precomputed::Sharding sharding{
          .minishard_bits = 2, .shard_bits = 1, .murmur = hash != "identity", .gzip_index = gzip, .gzip_data = gzip};
      WriteShards(root_ + "/s", sharding, chunks);
      const auto source = Open();
      ASSERT_TRUE(source.ok()) << source.status().message();
      const auto samples = SamplesOf<std::uint8_t>(**source);
      ASSERT_TRUE(samples.ok()) << samples.status().message();
      for (int z = 0, i = 0; z < 8; ++z) {
        for (int y = 0; y < 7; ++y) {
          for (int x = 0; x < 9; ++x, ++i) {
            const bool there = !(x / 4 == 1 && y / 4 == 1 && z / 4 == 0);
            ASSERT_EQ((*samples)[std::size_t(i)], there ? 100 + 20 * (z / 4) + 5 * (y / 4) + x / 4 : 0) << x << " " << y << " " << z;
          }
        }
      }
    }
  }
  // The file that holds the first chunk, damaged in turn.
  const std::string path = root_ + "/s/" + precomputed::PlaceOf({.minishard_bits = 2, .shard_bits = 1, .murmur = true}, 0).file;
  const std::string good = ReadFile(path);
  std::string far = good;
  for (std::size_t minishard = 0; minishard < 4; ++minishard) far.replace(16 * minishard, 16, LongWord(1) + LongWord(~std::uint64_t{0}));
  for (const auto& [bytes, why] : {std::pair<std::string, const char*>{good.substr(0, 7), "the shard ends within its index"},
                                   {good.substr(0, 70), "the shard ends within an index"},
                                   {far, "the index of the shard is damaged: a minishard lies from 1 to 18446744073709551615"}}) {
    WriteFile(path, bytes);
    const Status status = SamplesOf<std::uint8_t>(**Open()).status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << why;
    EXPECT_THAT(status.message(), testing::AllOf(HasSubstr(".shard: chunk "), HasSubstr(why)));
  }
}

TEST_F(PrecomputedTest, WhatIsWrongOrNotSupportedIsNamed) {
  const std::string good = Info(
      "image", "uint8", 1, R"({"key": "0", "size": [8, 4, 8], "chunk_sizes": [[8, 4, 4]], "resolution": [1, 1, 1], "encoding": "raw"})");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const std::pair<std::string, const char*> cases[] = {
      {with("\"raw\"", "\"compresso\""),
       "scales[0].encoding is \"compresso\", must be a supported encoding: raw, jpeg or compressed_segmentation"},
      {with("\"raw\"", "\"raw\", \"sharding\": {\"@type\": \"v2\"}"),
       "scales[0].sharding.@type is \"v2\", must be neuroglancer_uint64_sharded_v1"},
      {with("\"raw\"", "\"raw\", \"sharding\": " + ShardingText("md5", 1, 1)),
       "sharding.hash is \"md5\", must be identity or murmurhash3_x86_128"},
      {with("\"raw\"", "\"raw\", \"sharding\": " + ShardingText("identity", 33, 1)),
       "minishard_bits is 33, must be a whole number in [0, 32]"},
      {with("\"raw\"", "\"raw\", \"sharding\": " + ShardingText("identity", 32, 33)),
       "shard_bits is 33, must be a whole number in [0, 32]"},
      {with("\"raw\"", "\"compressed_segmentation\""), "must be raw or jpeg, since labels are uint32 or uint64"},
      {with("uint8", "complex64"), "data_type is \"complex64\", must be one of int8"},
      {with("[8, 4, 8]", "[8, 0, 8]"), "scales[0].size[1] is 0, must be a whole number"},
      {with("[8, 4, 8]", "[8, 4]"), "scales[0].size is [8,4], must be a list of 3 numbers"},
      {with("[8, 4, 8]", "[8, 4, 80000]"), "80000"},
      {with("[[8, 4, 4]]", "[]"), "scales[0].chunk_sizes[0] is missing, must be a list of 3 numbers"},
      {with("[[8, 4, 4]]", "[[800000000, 400000000, 400000000]]"), "has chunks of more than 1073741824 bytes"},
      {with("[1, 1, 1]", "[1, 0, 1]"), "scales[0].resolution[1] is 0, must be above 0"},
      {with("[1, 1, 1]", "[1, 1, 1], \"voxel_offset\": [0.5, 0, 0]"), "scales[0].voxel_offset[0] is 0.5, must be a whole number"},
      {with("\"num_channels\": 1", "\"num_channels\": 0"), "num_channels is 0, must be a whole number in [1, 4096]"},
      {with("neuroglancer_multiscale_volume", "neuroglancer_legacy_mesh"), "@type is \"neuroglancer_legacy_mesh\""},
      {"{\"scales\"", "em/info: damaged: not JSON"},
  };
  for (const auto& [text, why] : cases) {
    WriteFile(root_ + "/info", text);
    ExpectRefused({}, why);
  }
  WriteFile(root_ + "/info", with("\"key\": \"0\"", "\"key\": \"../elsewhere\""));
  const auto outside = Open();
  ASSERT_TRUE(outside.ok()) << outside.status().message();
  EXPECT_FALSE(SamplesOf<std::uint8_t>(**outside).ok()) << "chunks lie in the folder";
  WriteFile(root_ + "/info", good);
  ExpectRefused({.time = TimeRange{0, 0}}, "time is no option of Neuroglancer precomputed");
}

TEST_F(PrecomputedTest, OneLineTellsThatNoChunkIsThere) {
  const auto said = [&](const std::string& more) {
    WriteFile(root_ + "/info", Info("image", "uint8", 1,
                                    R"({"key": "s", "size": [10, 7, 5], "chunk_sizes": [[4, 4, 3]],
      "resolution": [8, 8, 40], "voxel_offset": [-8, 0, 0], "encoding": "raw")" +
                                        more + "}"));
    const auto source = Opened(Open());
    testing::internal::CaptureStderr();
    EXPECT_TRUE(SamplesOf<std::uint8_t>(*source).ok());
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(said(""), HasSubstr("looked for " + root_ + "/s/-8--4_0-4_0-3 and 11 others"));
  EXPECT_THAT(said(R"(, "sharding": {"@type": "neuroglancer_uint64_sharded_v1", "hash": "identity", "minishard_bits": 1, "shard_bits": 2,
    "preshift_bits": 0})"),
              HasSubstr("looked for " + root_ + "/s/0.shard and 11 others"));
}

}  // namespace
}  // namespace slabstream
