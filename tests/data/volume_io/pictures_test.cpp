// Folders of numbered pictures as volumes: PNG, JPEG, JPEG 2000 and BMP.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class PicturesTest : public testing::Test {
 protected:
  static LoadedVolume ReadPath(const std::string& path, const ReadOptions& options = {}) {
    Result<LoadedVolume> loaded = ReadVolume(path, options);
    CHECK(loaded.ok()) << loaded.status().message();
    return *std::move(loaded);
  }
  static std::vector<double> ValuesIn(const LoadedVolume& loaded) { return DataValues(*loaded.volume); }

  TemporaryDirectory directory_;
};

TEST_F(PicturesTest, FoldersOfPicturesAreVolumes) {
  const auto slice = [](int z) {
    FileBytes bytes;
    for (int i = 0; i < 12; ++i) bytes += char(z * 12 + i);
    return bytes;
  };
  for (const int z : {0, 1, 2}) WritePng(directory_ / fmt::format("s{}.png", z * 5), {4, 3, 1}, 8, 0, slice(z), z == 1);
  EXPECT_TRUE(LooksLikeVolume(directory_.path()));
  const LoadedVolume loaded = ReadPath(directory_.path(), {.spacing = Vec3{0.5, 0.5, 2}});
  EXPECT_EQ(loaded.info.format, "PNG");
  EXPECT_EQ(loaded.info.finest().geometry.size, (Index3{4, 3, 3}));
  EXPECT_EQ(loaded.info.finest().geometry.spacing, (Vec3{0.5, 0.5, 2}));
  std::vector<double> counted(36);
  std::iota(counted.begin(), counted.end(), 0);
  EXPECT_EQ(ValuesIn(loaded), counted);
  WritePng(directory_ / "s7.png", {4, 3, 1}, 16, 0, slice(0) + slice(1));
  EXPECT_THAT(ReadVolume(directory_.path()).status().message(), testing::AllOf(HasSubstr("s7.png is 4 x 3 uint16, must be 4 x 3 uint8")));
  // A picture alone is a volume of one slice.
  EXPECT_EQ(ReadPath(directory_ / "s5.png").info.finest().geometry.size, (Index3{4, 3, 1}));
  // A folder of one picture is none, nor are pictures of several names, nor those beside a volume.
  std::filesystem::remove(directory_ / "s7.png");
  WritePng(directory_ / "t8.png", {4, 3, 1}, 8, 0, slice(0));
  EXPECT_FALSE(LooksLikeVolume(directory_.path()));
  std::filesystem::remove(directory_ / "t8.png");
  EXPECT_TRUE(LooksLikeVolume(directory_.path()));
  WriteFile(directory_ / "v.nii", NiftiHeader({}) + FileBytes(24, 'x'));
  EXPECT_FALSE(LooksLikeVolume(directory_.path()));
}

TEST_F(PicturesTest, PicturesOfEveryKindHaveTheirSamples) {
  const auto both = [&](int bits, int kind, const FileBytes& samples, const ReadOptions& options) {
    for (const int z : {1, 2}) WritePng(directory_ / fmt::format("{}.png", z), {2, 2, 1}, bits, kind, samples);
    const std::vector<double> values = ValuesIn(ReadPath(directory_.path(), options));
    return std::vector<double>(values.begin(), values.begin() + 4);
  };
  using Values = std::vector<double>;
  EXPECT_EQ(both(8, 0, {1, 2, 3, char(255)}, {}), (Values{1, 2, 3, 255}));
  EXPECT_EQ(both(2, 0, {0, 1, 2, 3}, {}), (Values{0, 1, 2, 3}));
  EXPECT_EQ(both(16, 0, EncodeSamples(SampleType::kUint16, {1, 2, 300, 65535}), {}), (Values{1, 2, 300, 65535}));
  EXPECT_EQ(both(8, 2, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, {.channel = 1}), (Values{2, 5, 8, 11}));
  EXPECT_EQ(both(8, 3, {0, 1, 1, 0}, {.channel = 2}), (Values{30, 220, 220, 30}));
  EXPECT_EQ(both(8, 4, {1, 2, 3, 4, 5, 6, 7, 8}, {.channel = 0}), (Values{1, 3, 5, 7}));
  EXPECT_EQ(both(8, 6, FileBytes(16, 'x'), {.channel = 3}), (Values(4, 'x')));
  EXPECT_THAT(ReadVolume(directory_.path()).status().message(),
              HasSubstr("has 4 components a voxel, of which --channel takes one: 0 to 3, or luminance"));
}

TEST_F(PicturesTest, FoldersOfJpegAreVolumes) {
  for (const bool progressive : {false, true}) {
    FileBytes samples;
    for (int i = 0; i < 16 * 16; ++i) samples += char(100 + i % 16 + i / 16);
    for (const int z : {1, 2}) WriteJpeg(directory_ / fmt::format("{}.jpg", z), {16, 16, 1}, 1, samples, progressive);
    const LoadedVolume loaded = ReadPath(directory_.path());
    EXPECT_EQ(loaded.info.format, "JPEG");
    const std::vector<double> values = ValuesIn(loaded);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], 100 + double(i % 16) + double(i % 256 / 16), 2);
    for (const int z : {1, 2}) WriteJpeg(directory_ / fmt::format("{}.jpg", z), {16, 16, 1}, 3, samples + samples + samples, progressive);
    EXPECT_THAT(ReadVolume(directory_.path()).status().message(), HasSubstr("has 3 components a voxel"));
  }
}

TEST_F(PicturesTest, FoldersOfBmpAreVolumes) {
  using Values = std::vector<double>;
  const auto values = [&](const BmpKind& kind, const FileBytes& rows, const ReadOptions& options = {}) {
    for (const int z : {1, 2}) WriteFile(directory_ / fmt::format("{}.bmp", z), Bmp({2, 2, 1}, kind, rows));
    const LoadedVolume loaded = ReadPath(directory_.path(), options);
    EXPECT_EQ(loaded.info.format, "BMP");
    const Values all = ValuesIn(loaded);
    return Values(all.begin(), all.begin() + 4);
  };
  // Rows are filled up to four bytes, the lowest one first.
  const FileBytes greys = {0, 0, 0, 0, 9, 9, 9, 0, 5, 5, 5, 0, char(200), char(200), char(200), 0}, colours = {1, 2, 3, 0, 4, 5, 6, 0};
  EXPECT_EQ(values({.bits = 8, .palette = greys}, {0, 1, 0, 0, 2, 3, 0, 0}), (Values{5, 200, 0, 9}));
  EXPECT_EQ(values({.bits = 8, .palette = greys, .from_top = true}, {0, 1, 0, 0, 2, 3, 0, 0}), (Values{0, 9, 5, 200}));
  EXPECT_EQ(values({.bits = 4, .palette = greys}, {0x01, 0, 0, 0, 0x23, 0, 0, 0}), (Values{5, 200, 0, 9}));
  EXPECT_EQ(values({.bits = 1, .palette = greys.substr(0, 8)}, {0x40, 0, 0, 0, char(0x80), 0, 0, 0}), (Values{9, 0, 0, 9}));
  EXPECT_EQ(values({.bits = 8, .palette = colours}, {0, 1, 0, 0, 1, 1, 0, 0}, {.channel = 0}), (Values{6, 6, 3, 6}));
  EXPECT_EQ(values({.bits = 24}, {1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12, 0, 0}, {.channel = 2}), (Values{7, 10, 1, 4}));
  EXPECT_EQ(values({.bits = 32}, {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0, 10, 11, 12, 0}, {.channel = 1}), (Values{8, 11, 2, 5}));
  for (const int z : {1, 2})
    WriteFile(directory_ / fmt::format("{}.bmp", z), Bmp({2, 2, 1}, {.bits = 8, .compression = 1, .palette = greys}, "x"));
  EXPECT_THAT(ReadVolume(directory_.path()).status().message(), HasSubstr("8 bits a pixel with compression 1 are not supported"));
}

TEST_F(PicturesTest, FoldersOfJpeg2000AreVolumes) {
  for (const int bits : {1, 8, 10, 12, 16}) {
    for (const bool is_signed : {false, true}) {
      for (const int components : {1, 3}) {
        for (const char* ending : {"jp2", "j2k"}) {
          SCOPED_TRACE(fmt::format("{} bits, signed {}, {} components, {}", bits, is_signed, components, ending));
          const std::int64_t least = is_signed ? -(std::int64_t{1} << (bits - 1)) : 0;
          std::vector<int> samples;
          for (int i = 0; i < 32 * 32 * components; ++i) samples.push_back(int(least + (i * 37) % (1 << bits)));
          const TemporaryDirectory directory;
          for (const int z : {1, 2}) {
            WriteJpeg2000(directory / fmt::format("{}.{}", z, ending), {32, 32, 1}, components, bits, is_signed, samples);
          }
          const LoadedVolume loaded = ReadPath(directory.path(), {.channel = components - 1});
          EXPECT_EQ(loaded.info.format, "JPEG 2000");
          const std::vector<double> values = ValuesIn(loaded);
          for (std::size_t i = 0; i < 32 * 32; ++i)
            ASSERT_EQ(values[i], samples[i * std::size_t(components) + std::size_t(components) - 1]) << i;
        }
      }
    }
  }
}

TEST_F(PicturesTest, PicturesThatAreCutOffOrDamagedFail) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  constexpr Index3 kSize = {32, 32, 1};
  FileBytes samples;
  for (int i = 0; i < 32 * 32; ++i) samples += char(random.Integer(0, 255));
  WritePng(directory_ / "1.png", kSize, 8, 0, samples);
  for (const bool progressive : {false, true}) WriteJpeg(directory_ / (progressive ? "2.jpg" : "1.jpg"), kSize, 1, samples, progressive);
  std::vector<int> whole_numbers;
  for (const char sample : samples) whole_numbers.push_back(static_cast<unsigned char>(sample));
  WriteJpeg2000(directory_ / "1.jp2", kSize, 1, 8, false, whole_numbers);
  WriteFile(directory_ / "1.bmp", Bmp(kSize, {.bits = 8, .palette = FileBytes(1024, 'x')}, samples));
  for (const char* picture : {"1.png", "1.jpg", "2.jpg", "1.jp2", "1.bmp"}) {
    const FileBytes good = ReadFile(directory_ / picture);
    const TemporaryDirectory folder;
    const std::string ending = std::filesystem::path(picture).extension(), second = folder / ("2" + ending);
    WriteFile(folder / ("1" + ending), good);
    WriteFile(second, good);
    ASSERT_TRUE(ReadVolume(folder.path()).ok()) << picture;
    for (std::size_t length = 0; length + 2 < good.size(); length += 1 + length / 16) {
      WriteFile(second, good.substr(0, length));
      const Result<LoadedVolume> loaded = ReadVolume(folder.path());
      ASSERT_FALSE(loaded.ok()) << second << " cut to " << length << " of " << good.size();
      EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(second), testing::Not(HasSubstr("\n"))));
    }
    for (int i = 0; i < 200; ++i) {
      FileBytes bytes = good;
      bytes[random.Integer<std::size_t>(0, bytes.size() - 1)] ^= char(1 << random.Integer(0, 7));
      WriteFile(second, bytes);
      const Result<LoadedVolume> loaded = ReadVolume(folder.path());
      if (!loaded.ok()) {
        EXPECT_THAT(loaded.status().message(), testing::Not(HasSubstr("\n")));
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
