// DICOM series that are sound: voxels, values and places are those that were written, whatever the order of files, the encoding of pixels
// and the way in which a file says it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/volume_io/compressed_frame.h"
#include "tests/data/volume_io/dicom_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

LoadedVolume ReadDicomVolume(const std::string& path, const ReadOptions& options = {}) {
  Result<LoadedVolume> loaded = ReadVolume(path, options);
  CHECK(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->info.format, "DICOM");
  return *std::move(loaded);
}

LoadedVolume ReadAsNrrd(const TemporaryDirectory& directory, const Stored& stored) {
  WriteFile(directory / "v.nrrd", NrrdFile(stored));
  Result<LoadedVolume> loaded = ReadVolume(directory / "v.nrrd");
  CHECK(loaded.ok()) << loaded.status().message();
  return *std::move(loaded);
}

void ExpectSamePlace(const VolumeGeometry& a, const VolumeGeometry& b) {
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.orientation.world, World::kPatient);
  ExpectNear(a.spacing, b.spacing, 1e-6);
  ExpectNear(a.orientation.origin, b.orientation.origin, 1e-5);
  for (std::size_t i = 0; i < 3; ++i) ExpectNear(a.orientation.axes[i], b.orientation.axes[i], 1e-6);
}

Steps Turned(const Steps& steps, double degrees, Vec3 axis) {
  axis = Normalized(axis);
  const double angle = degrees * std::numbers::pi / 180;
  const auto turn = [&](const Vec3& v) {  // Rodrigues
    return std::cos(angle) * v + std::sin(angle) * Cross(axis, v) + (1 - std::cos(angle)) * Dot(axis, v) * axis;
  };
  return {turn(steps[0]), turn(steps[1]), turn(steps[2])};
}

// Axial, sagittal and coronal, from either end, with rows and columns in either direction; straight and oblique.
TEST(Dicom, InAnyOfThe48AcquisitionsIsTheVolumeThatNrrdHas) {
  for (const double oblique : {0.0, 25.0}) {
    Object object;
    object.steps = Turned(object.steps, oblique, {1, 2, -1});
    const TemporaryDirectory other;
    const LoadedVolume expected = ReadAsNrrd(other, StoredAs(object, AllStorages().front()));
    for (const Storage& storage : AllStorages()) {
      SCOPED_TRACE(Text(storage));
      const TemporaryDirectory directory;
      WriteSeries(directory.path(), StoredAs(object, storage));
      ASSERT_TRUE(LooksLikeVolume(directory.path()));
      const LoadedVolume loaded = ReadDicomVolume(directory.path());
      ExpectSamePlace(loaded.info.finest().geometry, expected.info.finest().geometry);
      EXPECT_TRUE(std::ranges::equal(loaded.volume->block.bytes, expected.volume->block.bytes));
      EXPECT_FALSE(loaded.info.stored->slanted);
    }
  }
}

TEST(Dicom, OfATiltedGantryIsStraightenedLikeNrrd) {
  for (const double degrees : {-20.0, 12.0}) {
    Object object{.size = {10, 12, 9}};
    const double tilt = degrees * std::numbers::pi / 180;
    object.steps[2] = {0, 3 * std::sin(tilt), 3 * std::cos(tilt)};
    object.steps = Turned(object.steps, 5, {1, 1, 0});
    object.value = [](const Index3& at) { return std::uint8_t(20 * at.x + at.y + 3 * at.z); };
    const Stored stored = StoredAs(object, AllStorages().front());
    const TemporaryDirectory directory, other;
    WriteSeries(directory.path(), stored);
    const LoadedVolume loaded = ReadDicomVolume(directory.path()), expected = ReadAsNrrd(other, stored);
    EXPECT_TRUE(loaded.info.stored->slanted);
    ExpectSamePlace(loaded.info.finest().geometry, expected.info.finest().geometry);
    const std::vector<double> values = DataValues(*loaded.volume), wanted = DataValues(*expected.volume);
    ASSERT_EQ(values.size(), wanted.size());
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], wanted[i], 1) << i;  // numbers in text are rounded
  }
}

// A stack of samples along the patient's axes, so that the order of voxels is that of samples.
Stored StackOf(SampleType type, const std::vector<double>& values, std::int32_t columns = 4, std::int32_t rows = 3) {
  return {.size = {columns, rows, std::int32_t(values.size()) / (columns * rows)},
          .steps = {Vec3{0.5, 0, 0}, Vec3{0, 0.75, 0}, Vec3{0, 0, 2}},
          .origin = {},
          .samples = EncodeSamples(type, values)};
}

TEST(Dicom, GivesBackEveryTypeOfPixelsInEveryTransferSyntax) {
  const struct {
    SampleType type;
    double low, high;
  } cases[] = {{SampleType::kInt8, -128, 127},  {SampleType::kUint8, 0, 255},          {SampleType::kInt16, -32768, 32767},
               {SampleType::kUint16, 0, 65535}, {SampleType::kInt32, -0x1p31, 0x1p30}, {SampleType::kUint32, 0, 0x1p31}};
  for (const auto& [type, low, high] : cases) {
    for (const DicomSyntax syntax : {DicomSyntax::kImplicit, DicomSyntax::kExplicit, DicomSyntax::kBigEndian, DicomSyntax::kJpegLossless,
                                     DicomSyntax::kJpegLs, DicomSyntax::kJpeg2000, DicomSyntax::kRle}) {
      // GDCM's coders take no more bits, and programs differ in what 32 bits in big endian are.
      if (BytesPerSample(type) == 4 && syntax >= DicomSyntax::kBigEndian) continue;
      SCOPED_TRACE(fmt::format("{} {}", ToString(type), int(syntax)));
      std::vector<double> values;  // slices of fewer pixels are too small for GDCM's coders
      for (int i = 0; i < 20 * 16 * 3; ++i) values.push_back(i % 120);
      values.front() = low;
      values.back() = high;
      const TemporaryDirectory directory;
      WriteSeries(directory.path(), StackOf(type, values, 20, 16), type, {}, syntax);
      const LoadedVolume loaded = ReadDicomVolume(directory.path());
      EXPECT_EQ(loaded.info.file_type, ToString(type));
      EXPECT_EQ(DataValues(*loaded.volume), values);
    }
  }
}

TEST(Dicom, TellsTheDecoderOfFramesInAnyFile) {
  const CompressedFrame frame = {.path = "a \"b\\\n c/1.dcm",
                                 .transfer_syntax = "1.2.840.10008.1.2.5",
                                 .fragments = {{1234, 99}, {std::int64_t{5} << 33, 1}},
                                 .columns = 7,
                                 .rows = 5,
                                 .bits_allocated = 16};
  std::stringstream text;
  text << frame << CompressedFrame{};
  CompressedFrame first, second, none;
  ASSERT_TRUE(text >> first >> second);
  EXPECT_EQ(first, frame);
  EXPECT_EQ(second, CompressedFrame{});
  EXPECT_FALSE(text >> none);
}

TEST(Dicom, TakesTheBitsThatAreStored) {
  const struct {
    SampleType type;
    const char *stored, *high;
    std::vector<double> raw, values;
  } cases[] = {
      // 12 bits at the low end; above them an overlay.
      {SampleType::kUint16, "12", "11", {0, 4095, 0xf001, 0x1fff}, {0, 4095, 1, 4095}},
      {SampleType::kInt16, "12", "11", {2047, 2048, 4095, 0x7001}, {2047, -2048, -1, 1}},
      // At the high end.
      {SampleType::kUint16, "12", "15", {0x10, 0xfff0, 0x1f, 0}, {1, 4095, 1, 0}},
      {SampleType::kInt16, "12", "15", {0x10, -16, 0x7ff0, -0x8000}, {1, -1, 2047, -2048}},
      {SampleType::kInt8, "7", "6", {63, 64, 127, -128}, {63, -64, -1, 0}},
      {SampleType::kUint32, "20", "19", {1048575, 0x7ff00001, 1, 2}, {1048575, 1, 1, 2}},
  };
  for (const auto& each : cases) {
    SCOPED_TRACE(fmt::format("{} {} {}", ToString(each.type), each.stored, each.high));
    std::vector<double> raw, values;
    for (int i = 0; i < 24; ++i) {
      raw.push_back(each.raw[std::size_t(i % 4)]);
      values.push_back(each.values[std::size_t(i % 4)]);
    }
    const TemporaryDirectory directory;
    WriteSeries(directory.path(), StackOf(each.type, raw), each.type, {{kTagBitsStored, each.stored}, {kTagHighBit, each.high}});
    EXPECT_EQ(DataValues(*ReadDicomVolume(directory.path()).volume), values);
  }
}

TEST(Dicom, KeepsStoredIntegersUnderOneRescaling) {
  const TemporaryDirectory directory;
  std::vector<double> raw, values;
  for (int i = 0; i < 36; ++i) {
    raw.push_back(i * 100);
    values.push_back(0.5 * i * 100 - 1024);
  }
  // Values of MONOCHROME1 are the same: it only asks to be shown inverted.
  for (const char* photometric : {"MONOCHROME2", "MONOCHROME1"}) {
    WriteSeries(directory.path(), StackOf(SampleType::kInt16, raw), SampleType::kInt16,
                {{kTagSlope, "0.5"}, {kTagIntercept, "-1024"}, {kTagPhotometric, photometric}});
    const LoadedVolume loaded = ReadDicomVolume(directory.path());
    EXPECT_EQ(loaded.info.finest().type, ScalarType::kUint16);
    EXPECT_EQ(loaded.info.finest().mapping.scale, 0.5);
    EXPECT_EQ(DataValues(*loaded.volume), values);
  }
}

// As PET has it.
TEST(Dicom, GivesRightValuesWhereEachSliceHasItsOwnRescaling) {
  const TemporaryDirectory directory;
  std::vector<double> values;
  const std::vector<double> slopes = {0.5, 1.25, 3}, intercepts = {0, -10, 7};
  for (int z = 0; z < 3; ++z) {
    std::vector<double> raw;
    for (int i = 0; i < 12; ++i) {
      raw.push_back(z == 2 ? -1000 * i : 65535 - i);  // the last slice is signed
      values.push_back(raw.back() * slopes[std::size_t(z)] + intercepts[std::size_t(z)]);
    }
    const SampleType type = z == 2 ? SampleType::kInt16 : SampleType::kUint16;
    DicomSpec spec{.pixels = EncodeSamples(type, raw)};
    for (const auto& [tag, value] : PixelValues(type)) spec.values[tag] = value;
    spec.values[kTagSlope] = fmt::format("{}", slopes[std::size_t(z)]);
    spec.values[kTagIntercept] = fmt::format("{}", intercepts[std::size_t(z)]);
    spec.values[kTagOrientation] = "-1\\0\\0\\0\\-1\\0";
    spec.values[kTagPosition] = fmt::format("0\\0\\{}", 2 * z);
    WriteDicom(directory / std::to_string(z), spec);
  }
  const LoadedVolume loaded = ReadDicomVolume(directory.path());
  EXPECT_EQ(loaded.info.finest().type, ScalarType::kFloat32);
  EXPECT_EQ(DataValues(*loaded.volume), values);
}

TEST(Dicom, OfSeveralFramesInAFileIsReadInTheOrderOfTheirPositions) {
  constexpr DicomTag kPlanePosition = 0x00209113, kPlaneOrientation = 0x00209116, kPixelMeasures = 0x00289110, kTransformation = 0x00289145;
  constexpr int kPixels = 20 * 16;
  for (const DicomSyntax syntax : {DicomSyntax::kExplicit, DicomSyntax::kImplicit, DicomSyntax::kBigEndian, DicomSyntax::kJpeg2000,
                                   DicomSyntax::kRle, DicomSyntax::kJpegLs, DicomSyntax::kJpegLossless}) {
    SCOPED_TRACE(int(syntax));
    std::vector<double> raw, values(3 * kPixels);
    DicomSpec spec{.syntax = syntax};
    for (const DicomTag tag : {kTagPosition, kTagOrientation, kTagPixelSpacing}) spec.values.erase(tag);
    spec.values[0x00080016] = "1.2.840.10008.5.1.4.1.1.2.1";
    spec.values[kTagColumns] = "20";
    spec.values[kTagRows] = "16";
    spec.values[kTagFrames] = "3";
    spec.shared = {{kPlaneOrientation, {{kTagOrientation, "-1\\0\\0\\0\\-1\\0"}}}, {kPixelMeasures, {{kTagPixelSpacing, "0.75\\0.5"}}}};
    const int places[] = {1, 2, 0};  // of frames in the stack
    for (int frame = 0; frame < 3; ++frame) {
      const int slope = frame + 1;
      spec.per_frame.push_back({{kPlanePosition, {{kTagPosition, fmt::format("4\\5\\{}", 2.5 * places[frame])}}},
                                {kTransformation, {{kTagSlope, std::to_string(slope)}, {kTagIntercept, "-7"}}}});
      for (int i = 0; i < kPixels; ++i) {
        raw.push_back(100 * frame + i);
        values[std::size_t(kPixels * places[frame] + i)] = raw.back() * slope - 7;
      }
    }
    spec.pixels = EncodeSamples(SampleType::kInt16, raw);
    const TemporaryDirectory directory;
    WriteDicom(directory / "enhanced", spec);
    for (const std::string& path : {directory.path(), directory / "enhanced"}) {
      const LoadedVolume loaded = ReadDicomVolume(path);
      EXPECT_EQ(DataValues(*loaded.volume), values);
      EXPECT_EQ(loaded.info.finest().geometry.spacing, (Vec3{0.5, 0.75, 2.5}));
      EXPECT_EQ(loaded.info.finest().geometry.orientation.origin, (Vec3{-4, -5, 0}));
    }
  }
}

TEST(Dicom, OfARadiationDoseLiesByItsOffsets) {
  DicomSpec spec;
  std::vector<double> raw, values;
  for (int i = 0; i < 36; ++i) {
    raw.push_back(70000 * i);
    values.push_back(70000 * i * 0.25);
  }
  for (const auto& [tag, value] : PixelValues(SampleType::kUint32)) spec.values[tag] = value;
  spec.values[kTagFrames] = "3";
  spec.values[kTagModality] = "RTDOSE";
  spec.values[kTagOrientation] = "-1\\0\\0\\0\\-1\\0";
  spec.values[kTagPosition] = "1\\2\\30";
  spec.values[0x3004000c] = "0\\2.5\\5";
  spec.values[0x3004000e] = "0.25";
  spec.pixels = EncodeSamples(SampleType::kUint32, raw);
  const TemporaryDirectory directory;
  WriteDicom(directory / "dose", spec);
  const LoadedVolume loaded = ReadDicomVolume(directory / "dose");
  EXPECT_EQ(DataValues(*loaded.volume), values);
  EXPECT_EQ(loaded.info.finest().geometry.spacing.z, 2.5);
  EXPECT_EQ(loaded.info.finest().geometry.orientation.origin, (Vec3{-1, -2, 30}));
}

TEST(Dicom, IsFoundByItsBytesInAllSubFolders) {
  const TemporaryDirectory directory;
  const std::vector<double> values(36, 5);
  WriteSeries(directory.path(), StackOf(SampleType::kInt16, values), SampleType::kInt16);
  std::filesystem::create_directories(directory / "DISK1/SER2");
  int number = 0;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  for (const auto& file : files) {
    ++number;
    std::filesystem::rename(file, directory / (number % 2 == 0 ? "DISK1/IM" : "DISK1/SER2/slice.dcm") + std::to_string(number));
  }
  WriteFile(directory / "README.TXT", "see DISK1");
  DicomSpec medium;  // the index of the medium
  medium.values = {{0x00080016, "1.2.840.10008.1.3.10"}, {0x00041130, "DISK"}};
  WriteDicom(directory / "DICOMDIR", medium);
  ASSERT_TRUE(LooksLikeVolume(directory.path()));
  EXPECT_EQ(DataValues(*ReadDicomVolume(directory.path()).volume), values);
  EXPECT_EQ(DataValues(*ReadDicomVolume(directory / "DICOMDIR").volume), values) << "stands for its folder";
  EXPECT_THAT(CheckVolumeHeaders(directory / "DICOMDIR").value(), testing::ElementsAre(directory / "DICOMDIR", directory.path()));
  EXPECT_THAT(CheckVolumeHeaders(directory.path()).value(), testing::ElementsAre(directory.path()));
  EXPECT_TRUE(LooksLikeVolume(directory / "DISK1/IM2"));
  EXPECT_FALSE(LooksLikeVolume(directory / "README.TXT"));
}

}  // namespace
}  // namespace slabstream
