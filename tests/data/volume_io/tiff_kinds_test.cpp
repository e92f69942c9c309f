// Kinds of pixels in TIFF files: bits, components together and apart, colours; what is not read is named, and never called damaged.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include "data/open/read_volume.h"
#include "tests/data/volume_io/tiff_files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr Index3 kTiffSize = {21, 5, 2};

std::uint64_t Counted(int x, int y, int z, int component) { return std::uint64_t(x + 31 * y + 7 * z + 113 * component); }

class TiffKindsTest : public testing::Test {
 protected:
  // `sample` of all voxels, in the lowest `bits`.
  static std::vector<double> Values(int bits, int component) {
    std::vector<double> values;
    for (int z = 0; z < kTiffSize.z; ++z) {
      for (int y = 0; y < kTiffSize.y; ++y) {
        for (int x = 0; x < kTiffSize.x; ++x) values.push_back(double(Counted(x, y, z, component) & ((1U << bits) - 1)));
      }
    }
    return values;
  }
  Result<LoadedVolume> Read(const TiffKind& kind, const ReadOptions& options = {}) {
    WriteTiffKind(directory_ / "v.tif", kTiffSize, kind, Counted);
    return ReadVolume(directory_ / "v.tif", options);
  }
  // The only note of a file whose samples are as they are.
  std::string NoteOf(const TiffKind& kind) {
    const Result<LoadedVolume> loaded = Read(kind);
    CHECK(loaded.ok()) << loaded.status().message();
    EXPECT_EQ(DataValues(*loaded->volume), Values(kind.bits, 0));
    return loaded->info.notes.size() == 1 ? loaded->info.notes.front() : "";
  }
  std::string WhyNot(const TiffKind& kind) {
    const Result<LoadedVolume> loaded = Read(kind);
    EXPECT_EQ(loaded.status().code(), StatusCode::kInvalidArgument) << kind.bits;
    EXPECT_THAT(loaded.status().message(), testing::Not(HasSubstr("damaged")));
    return loaded.status().message();
  }

  TemporaryDirectory directory_;
};

TEST_F(TiffKindsTest, SamplesOfAFewBitsKeepTheirValues) {
  for (int bits = 1; bits < 16; ++bits) {
    for (const int tile : {0, 16}) {
      for (const bool big_endian : {false, true}) {
        SCOPED_TRACE(fmt::format("{} bits, tile {}, big endian {}", bits, tile, big_endian));
        const Result<LoadedVolume> loaded =
            Read({.bits = bits, .compression = bits % 2 == 0 ? COMPRESSION_LZW : COMPRESSION_NONE, .tile = tile, .big_endian = big_endian});
        ASSERT_TRUE(loaded.ok()) << loaded.status().message();
        EXPECT_EQ(loaded->info.file_type, bits <= 8 ? "uint8" : "uint16");
        EXPECT_EQ(DataValues(*loaded->volume), Values(bits, 0));
      }
    }
  }
}

TEST_F(TiffKindsTest, ComponentsMayHavePlanesOfTheirOwn) {
  for (const int bits : {8, 12, 16}) {
    for (const int tile : {0, 16}) {
      for (const int planar : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE}) {
        for (const int component : {0, 1, 2}) {
          SCOPED_TRACE(fmt::format("{} bits, tile {}, planar {}, component {}", bits, tile, planar, component));
          const Result<LoadedVolume> loaded =
              Read({.bits = bits, .components = 3, .photometric = PHOTOMETRIC_RGB, .planar = planar, .tile = tile}, {.channel = component});
          ASSERT_TRUE(loaded.ok()) << loaded.status().message();
          EXPECT_EQ(DataValues(*loaded->volume), Values(bits, component));
        }
      }
    }
  }
}

TEST_F(TiffKindsTest, WhatIsShownOtherwiseIsNoted) {
  EXPECT_THAT(NoteOf({.photometric = PHOTOMETRIC_PALETTE}), HasSubstr("values are its indices"));
  EXPECT_THAT(NoteOf({.bits = 1, .photometric = PHOTOMETRIC_MINISWHITE}), HasSubstr("values are not inverted"));
  EXPECT_THAT(NoteOf({.orientation = ORIENTATION_RIGHTTOP}), HasSubstr("Orientation of the pages, 6, is not applied"));
  EXPECT_EQ(NoteOf({}), "");
}

TEST_F(TiffKindsTest, HalfFloatsAreRead) {
  const auto half = [](int x, int, int, int) { return std::uint64_t(0x3c00 + (x % 2) * 0x400); };  // 1 and 2
  for (const bool big_endian : {false, true}) {
    WriteTiffKind(directory_ / "v.tif", kTiffSize, {.bits = 16, .format = SAMPLEFORMAT_IEEEFP, .big_endian = big_endian}, half);
    const Result<LoadedVolume> loaded = ReadVolume(directory_ / "v.tif");
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    EXPECT_EQ(loaded->info.file_type, "float16");
    EXPECT_THAT(DataValues(*loaded->volume), testing::Each(testing::AnyOf(1, 2)));
    EXPECT_EQ(DataValues(*loaded->volume)[1], 2);
  }
}

TEST_F(TiffKindsTest, WhatIsNotSupportedIsNamed) {
  EXPECT_THAT(WhyNot({.components = 4, .photometric = PHOTOMETRIC_SEPARATED}), HasSubstr("kind 5 (CMYK)"));
  EXPECT_THAT(WhyNot({.bits = 64, .format = SAMPLEFORMAT_COMPLEXIEEEFP}), HasSubstr("64 bits and format 6 (complex float)"));
  EXPECT_THAT(WhyNot({.bits = 24}), HasSubstr("24 bits"));
  EXPECT_THAT(WhyNot({.bits = 12, .format = SAMPLEFORMAT_INT}), HasSubstr("12 bits and format 2 (signed)"));
}

// libtiff writes none of these, so the field is changed in the file.
TEST_F(TiffKindsTest, FieldsOfOthersAreNamed) {
  const auto with = [&](int tag, int value) {
    FileBytes bytes = OneDirectoryTiff({4, 3, 1}, 8, false, "", FileBytes(12, 'x'));
    const FileBytes entry = {char(tag), char(tag >> 8), 4, 0, 1, 0, 0, 0};
    bytes.replace(bytes.find(entry) + 8, 2, {char(value), char(value >> 8)});
    WriteFile(directory_ / "v.tif", bytes);
    const Status status = ReadVolume(directory_ / "v.tif").status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.message();
  };
  EXPECT_THAT(with(TIFFTAG_COMPRESSION, 34712), HasSubstr("compression 34712 (JPEG 2000) is not supported"));
  EXPECT_THAT(with(TIFFTAG_COMPRESSION, 50002), HasSubstr("compression 50002 (JPEG XL) is not supported"));
  EXPECT_THAT(with(TIFFTAG_COMPRESSION, 4711), HasSubstr("compression 4711 is not supported"));
  EXPECT_THAT(with(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_CIELAB), HasSubstr("kind 8 (CIE L*a*b*)"));
}

TEST_F(TiffKindsTest, SlicesInOnePageAreNamed) {
  TIFF* tiff = TIFFOpen((directory_ / "v.tif").c_str(), "w");
  for (const auto& [tag, value] : std::initializer_list<std::pair<ttag_t, int>>{{TIFFTAG_IMAGEWIDTH, 16},
                                                                                {TIFFTAG_IMAGELENGTH, 16},
                                                                                {TIFFTAG_IMAGEDEPTH, 7},
                                                                                {TIFFTAG_BITSPERSAMPLE, 8},
                                                                                {TIFFTAG_PHOTOMETRIC, 1}}) {
    TIFFSetField(tiff, tag, value);
  }
  FileBytes row(16, 'x');
  CHECK_EQ(TIFFWriteScanline(tiff, row.data(), 0, 0), 1);
  TIFFClose(tiff);
  EXPECT_THAT(ReadVolume(directory_ / "v.tif").status().message(), HasSubstr("ImageDepth is 7"));
}

}  // namespace
}  // namespace slabstream
