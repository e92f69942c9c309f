// Every format with every sample type: what is read are the values that were written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/volume_writer.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/full_disk.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr SampleType kTypes[] = {SampleType::kInt8,   SampleType::kUint8, SampleType::kInt16,  SampleType::kUint16,  SampleType::kInt32,
                                 SampleType::kUint32, SampleType::kInt64, SampleType::kUint64, SampleType::kFloat32, SampleType::kFloat64};

// The ends of the type's range among small values; all exact as float.
std::vector<double> ValuesFor(SampleType type) {
  std::vector<double> values;
  for (int i = 0; i < 24; ++i) values.push_back(i * 5);
  const auto ends = [&](double low, double high) {
    values.front() = low;
    values.back() = high;
    return values;
  };
  switch (type) {
    case SampleType::kInt8: return ends(-128, 127);
    case SampleType::kUint8: return ends(0, 255);
    case SampleType::kInt16: return ends(-32768, 32767);
    case SampleType::kUint16: return ends(0, 65535);
    case SampleType::kInt32: return ends(-0x1p31, 0x1p30);
    case SampleType::kUint32: return ends(0, 0x1p31);
    case SampleType::kInt64: return ends(-0x1p63, 0x1p62);
    case SampleType::kUint64: return ends(0, 0x1p63);
    case SampleType::kFloat32: return ends(-1.5, 3.402823466e+38);
    case SampleType::kFloat16: return ends(-1.5, 65504);
    case SampleType::kFloat64: break;
  }
  return ends(-0.25, 0x1p100);
}

// Reads, and checks what must hold for every volume.
LoadedVolume Read(const std::string& path) {
  Result<LoadedVolume> loaded = ReadVolume(path);
  CHECK(loaded.ok()) << loaded.status().message();
  const Volume& volume = *loaded->volume;
  EXPECT_EQ(volume.description, loaded->info.finest());
  EXPECT_EQ(volume.block.box, volume.description.geometry.bounds());
  EXPECT_EQ(volume.block.type, volume.description.type);
  EXPECT_EQ(std::int64_t(volume.block.bytes.size()), volume.description.voxel_bytes());
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(volume.block.bytes.data()) % kBufferAlignment, 0U);
  return std::move(*loaded);
}

struct Writer {
  const char* name;
  const char* file;
  const char* format;
  void (*write)(const std::string& path, const FileSpec& spec, const FileBytes& samples);
};

const Writer kWriters[] = {
    {"nii", "v.nii", "NIfTI",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteFile(path, NiftiHeader(spec) + samples); }},
    {"nii_gz", "v.nii.gz", "NIfTI",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteFile(path, Gzip(NiftiHeader(spec) + samples)); }},
    {"nrrd_raw", "v.nrrd", "NRRD",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteFile(path, NrrdHeader(spec, "raw") + samples); }},
    {"nrrd_gzip", "v.NRRD", "NRRD",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       WriteFile(path, NrrdHeader(spec, "gzip") + Gzip(samples));
     }},
    {"nhdr_raw", "v.nhdr", "NRRD",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       WriteFile(path, NrrdHeader(spec, "raw", "samples.raw"));
       WriteFile((std::filesystem::path(path).parent_path() / "samples.raw").string(), samples);
     }},
    {"nhdr_gzip", "v.nhdr", "NRRD",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       WriteFile(path, NrrdHeader(spec, "gzip", "samples.raw.gz"));
       WriteFile((std::filesystem::path(path).parent_path() / "samples.raw.gz").string(), Gzip(samples));
     }},
    {"mha", "v.mha", "MetaImage",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteFile(path, MetaHeader(spec, "LOCAL") + samples); }},
    {"mha_zlib", "v.mha", "MetaImage",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       const FileBytes packed = Zlib(samples);
       WriteFile(path, MetaHeader(spec, "LOCAL", std::int64_t(packed.size())) + packed);
     }},
    {"mhd", "v.mhd", "MetaImage",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       WriteFile(path, MetaHeader(spec, "samples.raw"));
       WriteFile((std::filesystem::path(path).parent_path() / "samples.raw").string(), samples);
     }},
    {"mhd_zlib", "v.mhd", "MetaImage",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       const FileBytes packed = Zlib(samples);
       WriteFile(path, MetaHeader(spec, "samples.zraw", std::int64_t(packed.size())));
       WriteFile((std::filesystem::path(path).parent_path() / "samples.zraw").string(), packed);
     }},
    {"npy", "v.npy", "NumPy",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteFile(path, NpyHeader(spec) + samples); }},
    {"vti_raw", "v.vti", "VTK image",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteFile(path, VtiFile(spec, samples)); }},
    {"vti_blocks", "v.vti", "VTK image",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) {
       WriteFile(path, VtiFile(spec, samples, {.format = "binary", .block = 32}));
     }},
    {"tiff_pages", "v.tif", "TIFF",
     [](const std::string& path, const FileSpec& spec, const FileBytes& samples) { WriteTiff(path, spec, samples); }},
};

class EveryFormat : public testing::TestWithParam<Writer> {};

TEST_P(EveryFormat, GivesBackEveryTypeInBothByteOrders) {
  const Writer& writer = GetParam();
  const bool tiff = std::string(writer.format) == "TIFF";  // its byte order is libtiff's business
  const bool states_spacing = !tiff && std::string(writer.format) != "NumPy";
  for (const SampleType type : kTypes) {
    for (const bool big_endian : {false, true}) {
      if (tiff && big_endian) continue;
      SCOPED_TRACE(testing::Message() << ToString(type) << (big_endian ? " big endian" : " little endian"));
      const TemporaryDirectory directory;
      FileSpec spec{.size = {4, 3, 2}, .type = type, .big_endian = big_endian, .spacing = {0.5, 1.25, 3}};
      const std::vector<double> values = ValuesFor(type);
      writer.write(directory / writer.file, spec, EncodeSamples(type, values, big_endian));
      ASSERT_TRUE(LooksLikeVolume(directory / writer.file));
      const LoadedVolume loaded = Read(directory / writer.file);
      EXPECT_EQ(loaded.info.format, writer.format);
      EXPECT_EQ(loaded.info.file_type, ToString(type));
      EXPECT_EQ(loaded.info.finest().geometry.size, spec.size);
      EXPECT_EQ(loaded.info.finest().geometry.spacing, states_spacing ? spec.spacing : (Vec3{1, 1, 1}));
      std::vector<double> expected = values;
      if (type == SampleType::kFloat32) expected.back() = double(float(expected.back()));
      EXPECT_EQ(DataValues(*loaded.volume), expected);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, EveryFormat, testing::ValuesIn(kWriters), [](const auto& each) { return std::string(each.param.name); });

TEST(SampleTypes, AreKeptInTheSmallestTypeThatLosesNothing) {
  const struct {
    SampleType type;
    std::vector<double> values;
    ScalarType kept;
    double offset;
  } cases[] = {
      {SampleType::kInt8, {-128, 127}, ScalarType::kUint8, -128},
      {SampleType::kInt16, {-1000, 3000}, ScalarType::kUint16, -32768},
      {SampleType::kInt32, {0, 65535}, ScalarType::kUint16, 0},
      {SampleType::kInt32, {-1, 65534}, ScalarType::kUint16, -1},
      {SampleType::kInt32, {-1, 65535}, ScalarType::kFloat32, 0},
      {SampleType::kUint32, {4294901760, 4294967295}, ScalarType::kUint16, 4294901760},
      {SampleType::kInt64, {-9223372036854775808.0, -9223372036854774784.0}, ScalarType::kUint16, -9223372036854775808.0},
      {SampleType::kFloat64, {-5, 100}, ScalarType::kUint16, -5},
      {SampleType::kFloat64, {0.5, 100}, ScalarType::kFloat32, 0},
      {SampleType::kFloat64, {0, std::numeric_limits<double>::quiet_NaN()}, ScalarType::kFloat32, 0},
      {SampleType::kFloat64, {0, std::numeric_limits<double>::infinity()}, ScalarType::kFloat32, 0},
  };
  for (const auto& [type, values, kept, offset] : cases) {
    SCOPED_TRACE(testing::Message() << ToString(type) << " " << values[0] << " " << values[1]);
    const TemporaryDirectory directory;
    WriteFile(directory / "v.nrrd", NrrdHeader({.size = {2, 1, 1}, .type = type}, "raw") + EncodeSamples(type, values));
    const LoadedVolume loaded = Read(directory / "v.nrrd");
    EXPECT_EQ(loaded.info.finest().type, kept);
    EXPECT_EQ(loaded.info.finest().mapping, (ValueMapping{1, offset}));
    EXPECT_THAT(DataValues(*loaded.volume), testing::Pointwise(testing::NanSensitiveDoubleEq(), values));
  }
}

TEST(SampleTypes, WarnWhereFloatsCannotHoldAValue) {
  const auto exact = [](std::vector<double> values, SampleType type) {
    const FileBytes file = EncodeSamples(type, values);
    AlignedVector<std::byte> bytes(file.size());
    std::memcpy(bytes.data(), file.data(), file.size());
    return KeepBeside(type, bytes).exact;
  };
  EXPECT_TRUE(exact({0, 16777216}, SampleType::kInt32));
  EXPECT_FALSE(exact({0, 16777217}, SampleType::kInt32));
  EXPECT_FALSE(exact({-70000, 4294967295}, SampleType::kInt64));
  EXPECT_FALSE(exact({0, 2147483647}, SampleType::kInt32)) << "rounds up to a value that int32 does not have";
  EXPECT_TRUE(exact({0.5, 1}, SampleType::kFloat64));
  EXPECT_FALSE(exact({0.1, 1}, SampleType::kFloat64));
  EXPECT_FALSE(exact({0.5, 1e300}, SampleType::kFloat64));
}

TEST(Nifti, KeepsStoredIntegersUnderASlope) {
  const TemporaryDirectory directory;
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt16, SampleType::kFloat32}) {
    const std::vector<double> values = {0, 1, 2, 3, 4, 100};
    const FileSpec spec{.size = {3, 2, 1}, .type = type, .slope = 0.0031372549F, .intercept = -1024.25F};
    WriteFile(directory / "v.nii.gz", Gzip(NiftiHeader(spec) + EncodeSamples(type, values)));
    const LoadedVolume loaded = Read(directory / "v.nii.gz");
    const ScalarType kept[] = {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32};
    EXPECT_EQ(loaded.info.finest().type, kept[type == SampleType::kUint8 ? 0 : type == SampleType::kInt16 ? 1 : 2]);
    EXPECT_EQ(loaded.info.finest().mapping.scale, double(spec.slope));
    const std::vector<double> read = DataValues(*loaded.volume);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(read[i], values[i] * double(spec.slope) + double(spec.intercept), 1e-9);
  }
}

TEST(Nifti, TakesASlopeOfZeroOrNanAsNone) {
  const TemporaryDirectory directory;
  for (const float slope : {0.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    WriteFile(directory / "v.nii", NiftiHeader({.size = {2, 1, 1}, .slope = slope, .intercept = 7}) + "ab");
    EXPECT_EQ(Read(directory / "v.nii").info.finest().mapping, ValueMapping{});
  }
}

TEST(Nifti, TakesFurtherDimensionsOfOne) {
  const TemporaryDirectory directory;
  WriteFile(directory / "v.nii", NiftiHeader({.dimensions = {4, 3, 2, 1, 1}}) + std::string(24, 'x'));
  EXPECT_EQ(Read(directory / "v.nii").info.finest().geometry.size, (Index3{4, 3, 2}));
}

TEST(Geometry, TakesDistancesFromNegativeSpacingsAndOneFromZero) {
  const TemporaryDirectory directory;
  WriteFile(directory / "v.mha", MetaHeader({.spacing = {-2, 0.5, 0}}, "LOCAL") + std::string(24, 'x'));
  EXPECT_EQ(Read(directory / "v.mha").info.finest().geometry.spacing, (Vec3{2, 0.5, 1}));
  WriteFile(directory / "v.nrrd", NrrdHeader({.spacing = {-2, 0.5, 3}}, "raw") + std::string(24, 'x'));
  EXPECT_EQ(Read(directory / "v.nrrd").info.finest().geometry.spacing, (Vec3{2, 0.5, 3}));
}

TEST(Nrrd, SkipsBytesBeforeTheSamples) {
  const TemporaryDirectory directory;
  std::string samples;
  for (int i = 0; i < 24; ++i) samples += char('a' + i);
  for (const auto& [skip, before] : {std::pair{"5", "12345"}, {"-1", "any number"}, {"0", ""}}) {
    std::string header = NrrdHeader({}, "raw", "samples.raw");
    header += std::string("byte skip: ") + skip + "\n";
    WriteFile(directory / "v.nhdr", header);
    WriteFile(directory / "samples.raw", before + samples);
    EXPECT_EQ(DataValues(*Read(directory / "v.nhdr").volume).front(), 'a') << skip;
  }
}

TEST(Gzip, OfSeveralMembersIsOneStream) {
  const TemporaryDirectory directory;
  WriteFile(directory / "v.nii.gz", Gzip(NiftiHeader({})) + Gzip(std::string(10, 'x')) + Gzip(std::string(14, 'y')));
  EXPECT_EQ(DataValues(*Read(directory / "v.nii.gz").volume).back(), 'y');
}

TEST(TiffStack, IsReadInTheNaturalOrderOfItsNames) {
  const TemporaryDirectory directory;
  const std::vector<std::string> names = {"s1.tif", "s2.TIF", "s10.tiff", "s010b.tif", "s11.tif", "t0.tif"};
  for (std::size_t z = 0; z < names.size(); ++z) {
    WriteTiff(directory / names[z], {.size = {3, 2, 1}, .type = SampleType::kInt16},
              EncodeSamples(SampleType::kInt16, std::vector<double>(6, double(z) - 3)),
              {.compression = z % 2 == 0 ? 1 : 5});  // some with LZW
  }
  WriteFile(directory / "notes.txt", "not a slice");
  EXPECT_TRUE(LooksLikeVolume(directory.path()));
  const LoadedVolume loaded = Read(directory.path());
  EXPECT_EQ(loaded.info.format, "TIFF");
  EXPECT_EQ(loaded.info.finest().geometry.size, (Index3{3, 2, 6}));
  const std::vector<double> values = DataValues(*loaded.volume);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], double(i / 6) - 3);
}

TEST(Tiff, IsReadFromTilesCompressedOrNotInBothByteOrders) {
  const TemporaryDirectory directory;
  for (const SampleType type : {SampleType::kUint8, SampleType::kUint16, SampleType::kUint32, SampleType::kFloat64}) {
    std::vector<double> values;
    for (int i = 0; i < 37 * 21 * 2; ++i) values.push_back(i % 251);
    for (const bool big_endian : {false, true}) {
      for (const int compression : {1, 5, 8, 32773}) {  // none, LZW, deflate, PackBits
        for (const int tile : {0, 16}) {
          SCOPED_TRACE(testing::Message() << ToString(type) << " compression " << compression << " tile " << tile << " big " << big_endian);
          const FileSpec spec{.size = {37, 21, 2}, .type = type, .big_endian = big_endian};
          WriteTiff(directory / "v.tif", spec, EncodeSamples(type, values), {.compression = compression, .tile = tile});
          EXPECT_EQ(DataValues(*Read(directory / "v.tif").volume), values);
        }
      }
    }
  }
}

TEST(Tiff, TakesTheShapeOfPixelsFromTheResolution) {
  const TemporaryDirectory directory;
  WriteTiff(directory / "v.tif", {}, std::string(24, 'x'), {.y_resolution = 50});
  EXPECT_EQ(Read(directory / "v.tif").info.finest().geometry.spacing, (Vec3{1, 2, 1}));
}

TEST(WriteVolume, IsReadBackForEveryTypeAndEnding) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const char* file : {"v.nrrd", "v.mha", "v.mhd"}) {
    for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
      Volume volume = RandomVolume(random, {5, 4, 3}, type);
      volume.description.geometry.spacing = {0.25, 1.5, 2};
      for (const ValueMapping& mapping : {ValueMapping{}, ValueMapping{1, -128}, ValueMapping{1, -32768}, ValueMapping{0.5, 3}}) {
        volume.description.mapping = mapping;
        const Status status = WriteVolume(volume, directory / file);
        ASSERT_TRUE(status.ok()) << status.message();
        const LoadedVolume loaded = Read(directory / file);
        EXPECT_EQ(loaded.info.finest().geometry, volume.description.geometry);
        const std::vector<double> found = DataValues(*loaded.volume), expected = DataValues(volume);
        for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], double(float(expected[i])));
        const bool as_it_was = mapping == ValueMapping{} || (type == ScalarType::kUint8 && mapping.offset == -128) ||
                               (type == ScalarType::kUint16 && mapping.offset == -32768);
        if (as_it_was) {
          EXPECT_EQ(loaded.info.finest(), volume.description);
        }
      }
    }
  }
}

TEST(WriteVolume, SaysWhatItCannotWrite) {
  const TemporaryDirectory directory;
  const Volume volume = MakeTestVolume({2, 2, 2}, ScalarType::kUint8, [](const Index3&) { return 1; });
  const Status ending = WriteVolume(volume, directory / "v.png");
  EXPECT_EQ(ending.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(ending.message(), testing::AllOf(HasSubstr("v.png"), HasSubstr(".nrrd, .mha, .mhd")));
  const Status place = WriteVolume(volume, directory / "nowhere/v.nrrd");
  EXPECT_EQ(place.code(), StatusCode::kUnavailable);
  EXPECT_THAT(place.message(), testing::AllOf(HasSubstr("nowhere/v.nrrd"), HasSubstr("No such file or directory")));
}

TEST(WriteVolume, TellsAFullDiskAndKeepsTheOlderVolume) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const Volume small = RandomVolume(random, {4, 4, 4}, ScalarType::kUint8), large = RandomVolume(random, {40, 40, 40}, ScalarType::kUint8);
  for (const char* file : {"v.nrrd", "v.mha", "v.mhd"}) {
    ASSERT_TRUE(WriteVolume(small, directory / file).ok());
    for (const std::int64_t limit : {0, 1000, 40 * 40 * 40 - 1}) {
      const Status status = OnFullDisk(rlim_t(limit), [&] { return WriteVolume(large, directory / file); });
      EXPECT_EQ(status.code(), StatusCode::kUnavailable);
      EXPECT_THAT(status.message(), HasSubstr("File too large"));
      EXPECT_EQ(Read(directory / file).volume->block.bytes, small.block.bytes) << file;
    }
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory.path())) names.push_back(entry.path().filename());
    EXPECT_THAT(names, testing::Each(testing::Not(HasSubstr("tmp"))));
  }
}

}  // namespace
}  // namespace slabstream
