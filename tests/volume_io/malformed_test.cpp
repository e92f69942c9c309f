// Files that are not what they claim to be: every one ends in a Status of one line that names the path, none in a crash or in memory taken
// on the word of a header.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/volume_io/volume_reader.h"
#include "tests/support/random.h"
#include "tests/volume_io/volume_files.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

// One line that names the path, and the code.
void ExpectFailure(const Status& status, StatusCode code, const std::string& path, const std::string& why) {
  EXPECT_EQ(status.code(), code) << status.message();
  EXPECT_THAT(status.message(), testing::AllOf(HasSubstr(path), HasSubstr(why), testing::Not(HasSubstr("\n"))));
}

FileBytes Samples(std::size_t bytes) {
  FileBytes samples;
  for (std::size_t i = 0; i < bytes; ++i) samples += char(i * 37 + i / 7);
  return samples;
}

FileBytes TiffBytes(const FileSpec& spec, const TiffOptions& options = {}) {
  const TemporaryDirectory directory;
  WriteTiff(directory / "v.tif", spec, Samples(24 * BytesPerSample(spec.type)), options);
  return ReadFile(directory / "v.tif");
}

struct Good {
  const char* file;
  FileBytes bytes;
};

std::vector<Good> GoodFiles() {
  const FileSpec spec{.type = SampleType::kInt16};
  const FileBytes samples = Samples(48);
  return {
      {"v.nii", NiftiHeader(spec) + samples},
      {"v.nii.gz", Gzip(NiftiHeader(spec) + samples)},
      {"v.nrrd", NrrdHeader(spec, "raw") + samples},
      {"v.nrrd", NrrdHeader(spec, "gzip") + Gzip(samples)},
      {"v.mha", MetaHeader(spec, "LOCAL") + samples},
      {"v.mha", MetaHeader(spec, "LOCAL", std::int64_t(Zlib(samples).size())) + Zlib(samples)},
      {"v.tif", TiffBytes(spec)},
      {"v.tif", TiffBytes(spec, {.compression = 5, .tile = 16})},
  };
}

TEST(Malformed, FilesThatAreCutOffAnywhereFail) {
  for (const Good& good : GoodFiles()) {
    const TemporaryDirectory directory;
    const std::string path = directory / good.file;
    WriteFile(path, good.bytes);
    ASSERT_TRUE(ReadVolume(path).ok()) << good.file << ": " << ReadVolume(path).status().message();
    for (std::size_t length = 0; length < good.bytes.size(); length += length < 352 && good.bytes.size() - length > 60 ? 7 : 1) {
      WriteFile(path, good.bytes.substr(0, length));
      const Result<LoadedVolume> loaded = ReadVolume(path);
      EXPECT_TRUE(CheckVolumeHeaders(path).ok() || !loaded.ok()) << "headers refuse what can be read";
      // The end of a TIFF directory and its trailing padding may be missing without harm.
      if (loaded.ok() && std::string(good.file) == "v.tif") continue;
      ASSERT_FALSE(loaded.ok()) << good.file << " cut to " << length << " of " << good.bytes.size();
      EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(path), testing::Not(HasSubstr("\n"))));
      // NotFound: what is left of a MetaImage header may name another file for the samples.
      EXPECT_THAT(loaded.status().code(), testing::AnyOf(StatusCode::kDataLoss, StatusCode::kInvalidArgument, StatusCode::kNotFound))
          << loaded.status().message();
    }
  }
}

TEST(Malformed, AlteredBytesNeverDoHarm) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  for (const Good& good : GoodFiles()) {
    const TemporaryDirectory directory;
    const std::string path = directory / good.file;
    for (int i = 0; i < 400; ++i) {
      FileBytes bytes = good.bytes;
      for (int flips = random.Integer(1, 3); flips > 0; --flips) {
        // Mostly in the header, where it matters.
        const std::size_t at =
            random.Integer<std::size_t>(0, random.Chance(0.8) ? std::min<std::size_t>(bytes.size() - 1, 300) : bytes.size() - 1);
        bytes[at] = random.Chance(0.3) ? char(random.Integer(0, 255)) : char(bytes[at] ^ (1 << random.Integer(0, 7)));
      }
      WriteFile(path, bytes);
      const Result<LoadedVolume> loaded = ReadVolume(path);
      EXPECT_TRUE(CheckVolumeHeaders(path).ok() || !loaded.ok()) << "headers refuse what can be read";
      if (loaded.ok()) {
        EXPECT_EQ(std::int64_t(loaded->volume->block.bytes.size()), loaded->info.description.voxel_bytes());
      } else {
        EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(directory.path()), testing::Not(HasSubstr("\n"))));
      }
    }
  }
}

TEST(Malformed, DamageInsideCompressedSamplesIsFound) {
  Random random(13);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.nii.gz";
  FileBytes samples;
  for (int i = 0; i < 60 * 60 * 60; ++i)
    samples += char(random.Integer(0, 255));  // does not compress: the samples lie far behind the header
  const FileBytes good = Gzip(NiftiHeader({.size = {60, 60, 60}}) + samples);
  for (int i = 0; i < 10; ++i) {
    FileBytes bytes = good;
    const std::size_t at = i == 0 ? bytes.size() - 6 /* the checksum */ : random.Integer<std::size_t>(bytes.size() / 2, bytes.size() - 1);
    bytes[at] ^= 1;
    WriteFile(path, bytes);
    ExpectFailure(ReadVolume(path).status(), StatusCode::kDataLoss, path, "damaged");
  }
}

TEST(Headers, AreEnoughToFindMostOfWhatIsWrongAndTheFiles) {
  const TemporaryDirectory directory;
  for (const Good& good : GoodFiles()) {
    const std::string path = directory / good.file;
    WriteFile(path, good.bytes);
    const Result<std::vector<std::string>> files = CheckVolumeHeaders(path);
    ASSERT_TRUE(files.ok()) << files.status().message();
    EXPECT_THAT(*files, testing::ElementsAre(path));
  }
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 3\nencoding: raw\nsizes: 2 3 4\ndata file: samples.raw\n\n";
  const std::string path = directory / "v.nhdr", samples = directory / "samples.raw";
  WriteFile(path, header);
  ExpectFailure(CheckVolumeHeaders(path).status(), StatusCode::kNotFound, path, "samples.raw");
  WriteFile(samples, Samples(23));
  ExpectFailure(CheckVolumeHeaders(path).status(), StatusCode::kDataLoss, path, "truncated");
  WriteFile(samples, Samples(24));
  EXPECT_THAT(CheckVolumeHeaders(path).value(), testing::ElementsAre(path, samples));
  WriteFile(path, "a letter");
  ExpectFailure(CheckVolumeHeaders(path).status(), StatusCode::kInvalidArgument, path, "not a NRRD volume");
  ExpectFailure(CheckVolumeHeaders(directory / "nothing.nii").status(), StatusCode::kNotFound, directory / "nothing.nii", "no such file");
}

TEST(Malformed, NamesThatAreNoVolumesFail) {
  const TemporaryDirectory directory;
  ExpectFailure(ReadVolume(directory / "nothing.nii").status(), StatusCode::kNotFound, directory / "nothing.nii", "no such file");
  ExpectFailure(ReadVolume(directory.path()).status(), StatusCode::kInvalidArgument, directory.path(), "without TIFF files");
  EXPECT_FALSE(LooksLikeVolume(directory.path()));
  WriteFile(directory / "v.png", "x");
  ExpectFailure(ReadVolume(directory / "v.png").status(), StatusCode::kInvalidArgument, directory / "v.png", "must end in .nii");
  EXPECT_FALSE(LooksLikeVolume(directory / "v.png"));
  ExpectFailure(ReadVolume("/dev/zero").status(), StatusCode::kInvalidArgument, "/dev/zero", "not a file");
  for (const char* file : {"v.nii", "v.nii.gz", "v.nrrd", "v.nhdr", "v.mha", "v.mhd", "v.tif"}) {
    const std::string path = directory / file;
    WriteFile(path, "This is a letter and no volume.\nWith kind regards\n" + std::string(500, '.'));
    ExpectFailure(ReadVolume(path).status(), StatusCode::kInvalidArgument, path, "not a");
    WriteFile(path, "");
    EXPECT_FALSE(ReadVolume(path).ok());
  }
  std::filesystem::create_directory(directory / "folder.nii");
  ExpectFailure(ReadVolume(directory / "folder.nii").status(), StatusCode::kInvalidArgument, directory / "folder.nii",
                "without TIFF files");
}

TEST(Malformed, OtherNumbersOfDimensionsAndComponentsFail) {
  const TemporaryDirectory directory;
  const auto expect = [&](const char* file, const FileBytes& bytes, const std::string& why) {
    WriteFile(directory / file, bytes);
    ExpectFailure(ReadVolume(directory / file).status(), StatusCode::kInvalidArgument, directory / file, why);
  };
  expect("v.nii", NiftiHeader({.dimensions = {4, 6}}) + Samples(24), "has 2 dimensions");
  expect("v.nii", NiftiHeader({.dimensions = {4, 3, 2, 5}}) + Samples(120), "has 4 dimensions");
  expect("v.nii", NiftiHeader({.dimensions = {4, 3, -2}}) + Samples(24), "size along z is -2");
  FileBytes rgb = NiftiHeader({});
  rgb[70] = char(128);
  expect("v.nii", rgb + Samples(72), "data type 128");

  const auto nrrd = [](const std::string& fields) { return "NRRD0004\ntype: uchar\n" + fields + "encoding: raw\n\n" + Samples(240); };
  expect("v.nrrd", nrrd("dimension: 2\nsizes: 4 6\n"), "has 2 dimensions");
  expect("v.nrrd", nrrd("dimension: 4\nsizes: 4 3 2 5\n"), "has 4 dimensions");
  expect("v.nrrd", nrrd("dimension: 4\nsizes: 3 4 3 2\nkinds: vector domain domain domain\n"), "3 components");
  WriteFile(directory / "v.nrrd", nrrd("dimension: 4\nsizes: 4 3 2 1\n"));
  EXPECT_TRUE(ReadVolume(directory / "v.nrrd").ok()) << "a fourth dimension of one";

  const auto meta = [](const std::string& fields) {
    return "ObjectType = Image\n" + fields + "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + Samples(240);
  };
  expect("v.mha", meta("NDims = 2\nDimSize = 4 6\n"), "has 2 dimensions");
  expect("v.mha", meta("NDims = 4\nDimSize = 4 3 2 5\n"), "has 4 dimensions");
  expect("v.mha", meta("NDims = 3\nDimSize = 4 3 2\nElementNumberOfChannels = 3\n"), "3 components");
  expect("v.mha", meta("NDims = 3\nDimSize = 4 3\n"), "DimSize is '4 3'");
  expect("v.mha", meta("NDims = 50\nDimSize = 4 3 2\n"), "NDims is '50'");
  expect("v.mha", meta("NDims = 3\n"), "DimSize is missing");

  WriteTiff(directory / "one.tif", {.size = {4, 3, 1}}, Samples(12));
  ExpectFailure(ReadVolume(directory / "one.tif").status(), StatusCode::kInvalidArgument, "one.tif", "has 2 dimensions");
}

TEST(Malformed, HeadersCannotMakeItTakeMemory) {
  const TemporaryDirectory directory;
  const auto expect = [&](const char* file, const FileBytes& bytes, StatusCode code, const std::string& why) {
    WriteFile(directory / file, bytes);
    ExpectFailure(ReadVolume(directory / file).status(), code, directory / file, why);
  };
  // 2^47 bytes and more: whoever allocates before looking fails here.
  const FileSpec huge{.size = {65535, 65535, 32767}, .type = SampleType::kInt16};
  const FileSpec large{.size = {30000, 30000, 30000}, .type = SampleType::kInt16};
  expect("v.nii", NiftiHeader(large) + Samples(48), StatusCode::kDataLoss, "truncated");
  expect("v.nii.gz", Gzip(NiftiHeader(large) + Samples(48)), StatusCode::kDataLoss, "truncated");
  expect("v.nrrd", NrrdHeader(huge, "raw") + Samples(48), StatusCode::kDataLoss, "truncated");
  expect("v.nrrd", NrrdHeader(huge, "gzip") + Gzip(Samples(48)), StatusCode::kDataLoss, "truncated");
  expect("v.mha", MetaHeader(huge, "LOCAL") + Samples(48), StatusCode::kDataLoss, "truncated");
  expect("v.mha", MetaHeader(huge, "LOCAL", 20) + Zlib(Samples(48)), StatusCode::kDataLoss, "truncated");
  expect("v.nrrd", NrrdHeader({.size = {70000, 1, 1}}, "raw") + Samples(70000), StatusCode::kInvalidArgument, "size along x is 70000");
  expect("v.mha", MetaHeader({.size = {4, 70000, 1}}, "LOCAL") + Samples(48), StatusCode::kInvalidArgument, "must be");

  // A TIFF page that claims 60000 x 60000.
  FileBytes tiff = TiffBytes({.type = SampleType::kUint16});
  for (const char tag : {char(0), char(1)}) {
    for (std::size_t at = tiff.find(std::string{tag, 1, 3, 0, 1, 0, 0, 0}); at != FileBytes::npos;
         at = tiff.find(std::string{tag, 1, 3, 0, 1, 0, 0, 0}, at + 1)) {
      tiff.replace(at + 8, 2, std::string{char(0x60), char(0xea)});
    }
  }
  expect("v.tif", tiff, StatusCode::kDataLoss, "truncated");
}

TEST(Malformed, DetachedSamplesThatAreMissingOrShortFail) {
  const TemporaryDirectory directory;
  const FileSpec spec{};
  for (const auto& [file, header] :
       {std::pair{"v.nhdr", NrrdHeader(spec, "raw", "samples.raw")}, {"v.mhd", MetaHeader(spec, "samples.raw")}}) {
    std::filesystem::remove(directory / "samples.raw");
    WriteFile(directory / file, header);
    const Status missing = ReadVolume(directory / file).status();
    EXPECT_THAT(missing.code(), testing::AnyOf(StatusCode::kNotFound, StatusCode::kInvalidArgument));
    EXPECT_THAT(missing.message(), testing::AllOf(HasSubstr("samples.raw"), testing::Not(HasSubstr("\n"))));
    WriteFile(directory / "samples.raw", Samples(23));
    ExpectFailure(ReadVolume(directory / file).status(), StatusCode::kDataLoss, directory / "samples.raw",
                  "24 bytes of samples, the file has 23");
  }
}

TEST(Malformed, EncodingsThatAreNotReadAreNamed) {
  const TemporaryDirectory directory;
  const auto expect = [&](const char* file, const FileBytes& bytes, const std::string& why) {
    WriteFile(directory / file, bytes);
    ExpectFailure(ReadVolume(directory / file).status(), StatusCode::kInvalidArgument, directory / file, why);
  };
  expect("v.nrrd", NrrdHeader({}, "ascii") + "1 2 3\n", "encoding 'ascii'");
  FileBytes as_text = MetaHeader({}, "LOCAL");
  as_text.replace(as_text.find("BinaryData = True"), 17, "BinaryData = False");
  expect("v.mha", as_text + "1 2 3\n", "BinaryData");
  expect("v.mhd", MetaHeader({}, "s%03d.raw 1 2 1"), "several files");
  FileBytes two_files = NiftiHeader({});
  two_files[345] = 'i';
  expect("v.nii", two_files + Samples(24), "NIfTI-1 in one file");
}

TEST(Malformed, TiffSlicesThatDifferFail) {
  const TemporaryDirectory directory;
  WriteTiff(directory / "1.tif", {.size = {4, 3, 1}}, Samples(12));
  WriteTiff(directory / "2.tif", {.size = {3, 4, 1}}, Samples(12));
  ExpectFailure(ReadVolume(directory.path()).status(), StatusCode::kInvalidArgument, directory / "2.tif",
                "is 3 x 4 uint8, must be 4 x 3 uint8");
  WriteTiff(directory / "2.tif", {.size = {4, 3, 1}, .type = SampleType::kInt16}, Samples(24));
  ExpectFailure(ReadVolume(directory.path()).status(), StatusCode::kInvalidArgument, directory / "2.tif", "int16");
  WriteTiff(directory / "2.tif", {.size = {4, 3, 2}}, Samples(24));
  ExpectFailure(ReadVolume(directory.path()).status(), StatusCode::kInvalidArgument, directory / "2.tif", "has 2 pages");
}

}  // namespace
}  // namespace slabstream
