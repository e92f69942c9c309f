// Samples of VTK's XML files that are in base64 or in compressed blocks are read box by box, and are those of the decoded whole.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <vector>

#include "tests/data/positional/like_whole.h"
#include "tests/data/volume_io/more_files.h"

namespace slabstream {
namespace {

// Samples that shrink, but not to nothing, and whose blocks differ.
std::vector<double> SomeValues(Random& random, std::size_t count) {
  std::vector<double> values(count);
  double value = 0;
  for (double& each : values) each = random.Chance(0.2) ? value = random.Integer(0, 100) : value;
  return values;
}

struct Encoding {
  std::string format, encoding, compressor;
};
// Without LZMA, which takes long to write, if samples are many.
std::vector<Encoding> Encodings(bool many = false) {
  std::vector<Encoding> encodings;
  for (const auto& [format, encoding] : {std::pair{"appended", "raw"}, {"appended", "base64"}, {"binary", ""}}) {
    for (const char* const compressor : {"", "ZLib", "LZ4", "LZMA"}) {
      const bool plain = std::string(encoding) == "raw" && std::string(compressor).empty();
      if (!plain && !(many && std::string(compressor) == "LZMA")) encodings.push_back({format, encoding, compressor});
    }
  }
  return encodings;
}

VtiOptions OptionsOf(const Encoding& encoding, std::size_t block, bool wide) {
  return {.format = encoding.format,
          .encoding = encoding.encoding,
          .wide_header = wide,
          .block = encoding.compressor.empty() ? 0 : block,
          .compressor = encoding.compressor};
}

void ExpectInParts(const std::string& path, const ReadOptions& options, Random& random, int boxes) {
  EXPECT_TRUE(Opened(path, options)->info().in_parts());
  ExpectLikeWhole(path, options, random, boxes);
}

TEST(Packed, BoxesOfEveryEncodingAreThoseOfTheWhole) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  for (const Encoding& encoding : Encodings()) {
    for (const bool big : {false, true}) {
      for (const bool wide : {false, true}) {
        for (const std::size_t block : {64, 101, 1000, 32768}) {
          SCOPED_TRACE(fmt::format("{} {} {} {} {} {}", encoding.format, encoding.encoding, encoding.compressor, big, wide, block));
          constexpr SampleType kTypes[] = {SampleType::kInt8, SampleType::kUint16, SampleType::kFloat32, SampleType::kFloat64};
          const FileSpec spec{.size = {random.Integer(1, 30), random.Integer(1, 9), random.Integer(1, 9)},
                              .type = kTypes[random.Integer(0, 3)],
                              .big_endian = big,
                              .spacing = {0.5, 1.25, 3}};
          const std::vector<double> values = SomeValues(random, CountIn(spec.size));
          const FileBytes samples = EncodeSamples(spec.type, values, big);
          WriteFile(path, VtiFile(spec, samples, OptionsOf(encoding, block, wide)));
          ExpectInParts(path, {}, random, 4);
          WriteFile(directory / "plain.vti", VtiFile(spec, samples));
          EXPECT_TRUE(ReadDecoded(path)->volume->block.bytes == ReadDecoded(directory / "plain.vti")->volume->block.bytes);
          if (encoding.compressor.empty()) break;
        }
      }
    }
  }
}

// Of several chunks, by slices and by rows.
TEST(Packed, BoxesOfLargeFilesAreThoseOfTheWhole) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  for (const Encoding& encoding : Encodings(true)) {
    for (const Index3& size : {Index3{101, 99, 70}, Index3{701, 503, 2}}) {
      const std::size_t block = std::size_t(random.Integer(5000, 50000));
      SCOPED_TRACE(fmt::format("{} {} {} {}", encoding.format, encoding.encoding, encoding.compressor, block));
      const FileSpec spec{.size = size, .type = SampleType::kUint16, .big_endian = random.Chance(0.5)};
      VtiOptions options = OptionsOf(encoding, block, random.Chance(0.5));
      if (random.Chance(0.5)) options.direction = "0 -1 0 1 0 0 0 0 -1";
      const FileBytes samples = EncodeSamples(spec.type, SomeValues(random, CountIn(size)), spec.big_endian);
      WriteFile(path, VtiFile(spec, samples, options));
      ExpectInParts(path, {}, random, 5);
    }
  }
}

TEST(Packed, OneOfSeveralComponentsIsRead) {
  Random random(63);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {40, 9, 7}, .type = SampleType::kFloat32};
  VtiOptions options{.encoding = "base64", .block = 1000};
  options.components = 3;
  WriteFile(path, VtiFile(spec, EncodeSamples(spec.type, SomeValues(random, 3 * CountIn(spec.size)), false), options));
  for (const int channel : {0, 1, 2}) ExpectInParts(path, {.channel = channel}, random, 4);
  const auto other = Opened(path, {.channel = 0})->At(0, 2);
  ASSERT_NE(other, nullptr);
  const Box box = other->info().finest().geometry.bounds();
  EXPECT_TRUE(ReadBox(*other, 0, box) == ReadBox(*Opened(path, {.channel = 2}), 0, box));
  EXPECT_TRUE(Opened(path, {.channel = kLuminance})->info().whole);
}

TEST(Packed, OnlyWhatABoxNeedsIsRead) {
  Random random(64);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {256, 256, 40}, .type = SampleType::kUint16};
  const FileBytes samples = EncodeSamples(spec.type, RandomValues(random, spec.type, CountIn(spec.size)));
  for (const Encoding& encoding : Encodings(true)) {
    WriteFile(path, VtiFile(spec, samples, OptionsOf(encoding, 32768, false)));
    const auto source = Opened(path);
    EXPECT_EQ(source->info().levels[0].block, (Index3{256, 256, 4})) << "512 KiB";
    ReadBox(*source, 0, {{9, 9, 9}, {20, 20, 10}});
    const double stored = double(std::filesystem::file_size(path)) / double(samples.size()) * 4 * 256 * 256 * 2;
    EXPECT_NEAR(double(source->counts().stored_bytes), stored, 0.01 * stored);
    EXPECT_EQ(source->counts().chunks, 1U);
  }
}

TEST(Packed, WhatCannotBeReadInPartsIsDecodedAsAWhole) {
  Random random(65);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {100, 10, 10}, .type = SampleType::kInt16};
  const FileBytes samples = EncodeSamples(spec.type, SomeValues(random, CountIn(spec.size)));
  const auto expect_whole = [&](const FileBytes& file) {
    WriteFile(path, file);
    EXPECT_TRUE(Opened(path)->info().whole);
    ExpectLikeWhole(path, {}, random, 3);
  };
  expect_whole(VtiFile(spec, samples, {.block = 40}));  // tiny blocks
  // Lines of base64: the letters of the samples begin with those of the header, or behind them.
  for (const std::size_t block : {0, 5000}) {
    const FileBytes good = VtiFile(spec, samples, {.format = "binary", .block = block});
    const std::size_t first = good.find('>', good.find("<DataArray")) + 2, last = good.find('\n', first);
    const std::size_t samples_at = first + (block == 0 ? 5 : 41);
    for (const std::size_t at : {samples_at, samples_at + 40, (samples_at + last) / 2, last - 1}) {
      FileBytes file = good;
      expect_whole(file.insert(at, "\n  "));
    }
    FileBytes around = good;
    around.insert(last, " \n ").insert(first + 2, " \n ").insert(first, " \n ");
    WriteFile(path, around);
    ExpectInParts(path, {}, random, 3);
  }
}

TEST(Packed, ADamagedBlockIsNamedAndOthersAreRead) {
  Random random(66);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {256, 256, 40}, .type = SampleType::kUint16};
  const FileBytes samples = EncodeSamples(spec.type, SomeValues(random, CountIn(spec.size)));
  for (const Encoding& encoding : Encodings(true)) {
    SCOPED_TRACE(fmt::format("{} {} {}", encoding.format, encoding.encoding, encoding.compressor));
    FileBytes file = VtiFile(spec, samples, OptionsOf(encoding, 32768, true));
    const std::size_t middle = file.size() / 2;
    std::fill_n(file.begin() + std::ptrdiff_t(middle), 300, encoding.encoding == "raw" ? '\xff' : '#');
    WriteFile(path, file);
    const auto source = Opened(path);
    ASSERT_TRUE(source->info().in_parts());
    std::vector<std::byte> bytes(samples.size());
    const auto read = [&](std::int32_t from, std::int32_t to) {
      return source->ReadNow(0, {{0, 0, from}, {256, 256, to}}, std::span(bytes).first(samples.size() / 40 * std::size_t(to - from)));
    };
    const Status status = read(0, 40);
    EXPECT_EQ(status.code(), StatusCode::kDataLoss);
    EXPECT_THAT(status.message(), AllOf(HasSubstr(path + ": array density: "), HasSubstr("damaged")));
    if (encoding.encoding == "raw") {
      EXPECT_THAT(status.message(), testing::MatchesRegex(".*: block [0-9]+ is damaged"));
    }
    EXPECT_TRUE(read(0, 12).ok());
    EXPECT_TRUE(read(32, 40).ok());
  }
}

TEST(Packed, AFileThatBecomesShorterIsNamed) {
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {256, 256, 40}, .type = SampleType::kUint16};
  WriteFile(path, VtiFile(spec, FileBytes(CountIn(spec.size) * 2, 'x'), {.encoding = "base64"}));
  const auto source = Opened(path);
  std::vector<std::byte> bytes(std::size_t{256} * 256 * 2);
  const auto read = [&](std::int32_t z) { return source->ReadNow(0, {{0, 0, z}, {256, 256, z + 1}}, bytes); };
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_TRUE(read(3).ok());
  EXPECT_EQ(read(30).code(), StatusCode::kDataLoss);
  EXPECT_THAT(read(30).message(), HasSubstr(path + ": array density: the file ends before it does"));
  ExpectRefusal(Open(path), path + ": truncated: array density has");
  std::filesystem::remove(path);
  EXPECT_EQ(read(10).code(), StatusCode::kUnavailable);
}

// As soon as it is opened, although its header could be read.
TEST(Packed, ATruncatedFileIsRefused) {
  Random random(69);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {50, 40, 30}, .type = SampleType::kUint16};
  const FileBytes samples = EncodeSamples(spec.type, SomeValues(random, CountIn(spec.size)));
  for (const Encoding& encoding : Encodings()) {
    if (encoding.format != "appended") continue;
    const FileBytes file = VtiFile(spec, samples, OptionsOf(encoding, 1000, false));
    const std::size_t end = file.rfind("\n</AppendedData>");
    for (const std::size_t left_out : {std::size_t{1}, std::size_t(random.Integer(2, 3000))}) {
      WriteFile(path, file.substr(0, end - left_out));
      ExpectRefusal(Open(path), path + ": array density: truncated: needs ");
    }
  }
}

// Each number of the header, and several at a time.
TEST(Packed, NumbersOfHeadersThatDoNotFitAreRefused) {
  Random random(67);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {10, 10, 10}, .type = SampleType::kUint8};
  const FileBytes good =
      VtiFile(spec, EncodeSamples(spec.type, SomeValues(random, 1000)), {.wide_header = true, .block = 100, .compressor = "LZ4"});
  const std::size_t header = good.find('_', good.find("<AppendedData")) + 1;
  const std::uint64_t numbers[] = {
      0, 1, 9, 10, 99, 100, 101, 456, 457, 900, 1000, 1001, std::uint64_t{1} << 32, std::uint64_t{1} << 63, ~std::uint64_t{0}};
  for (int i = 0; i < 1500; ++i) {
    FileBytes file = good;
    for (int hits = random.Integer(1, 3); hits > 0; --hits) {
      const std::uint64_t number = numbers[random.Integer<std::size_t>(0, std::size(numbers) - 1)];
      std::memcpy(file.data() + header + 8 * random.Integer<std::size_t>(0, 12), &number, 8);
    }
    WriteFile(path, file);
    const auto source = Open(path);
    if (!source.ok()) {
      EXPECT_THAT(source.status().message(), AllOf(HasSubstr(path), testing::Not(HasSubstr("\n"))));
      continue;
    }
    std::vector<std::byte> bytes(1000);
    const Status status = (*source)->ReadNow(0, (*source)->info().finest().geometry.bounds(), bytes);
    const Result<LoadedVolume> decoded = ReadDecoded(path);
    EXPECT_EQ(status.ok(), decoded.ok()) << status.message() << decoded.status().message();
    EXPECT_TRUE(!status.ok() || std::ranges::equal(bytes, decoded->volume->block.bytes));
  }
}

// What is read in parts is right, or an error: never something else than the whole.
TEST(Packed, AlteredFilesAreNeverReadAsSomethingElse) {
  Random random(68);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.vti";
  const FileSpec spec{.size = {31, 17, 5}, .type = SampleType::kInt16, .big_endian = true};
  const FileBytes samples = EncodeSamples(spec.type, SomeValues(random, CountIn(spec.size)), true);
  int in_parts = 0, refused = 0;
  for (const Encoding& encoding : Encodings()) {
    const FileBytes good = VtiFile(spec, samples, OptionsOf(encoding, 500, random.Chance(0.5)));
    for (int i = 0; i < 250; ++i) {
      FileBytes file = good;
      for (int hits = random.Integer(1, 3); hits > 0; --hits) {
        char& byte = file[random.Integer<std::size_t>(0, file.size() - 1)];
        if (random.Chance(0.2)) {
          byte = " =A\n"[random.Integer(0, 3)];
        } else {
          Damage(byte, random);
        }
      }
      if (random.Chance(0.1)) file.resize(random.Integer<std::size_t>(0, file.size()));
      WriteFile(path, file);
      SCOPED_TRACE(fmt::format("{} {} {} {}", encoding.format, encoding.encoding, encoding.compressor, i));
      const auto source = Open(path);
      if (!source.ok() || !(*source)->info().in_parts()) continue;
      const SourceInfo& info = (*source)->info();
      const Box all = info.finest().geometry.bounds();
      ASSERT_LT(all.voxel_count(), 100000);
      std::vector<std::byte> bytes(std::size_t(all.voxel_count()) * BytesPerSample(info.exact.type));
      const Status status = (*source)->ReadNow(0, all, BoxRoom::Dense(all, bytes.data(), true));
      ++(status.ok() ? in_parts : refused);
      if (status.ok()) {
        ExpectLikeWhole(path, {}, random, 2);
      } else {
        EXPECT_THAT(status.message(), AllOf(HasSubstr(path), testing::Not(HasSubstr("\n"))));
      }
    }
  }
  EXPECT_GT(in_parts, 100);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace slabstream
