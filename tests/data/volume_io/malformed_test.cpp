// Files that are not what they claim to be: every one ends in a Status of one line that names the path, none in a crash or in memory taken
// on the word of a header.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/volume_io/formats.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"

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

std::vector<SampleFile> GoodFiles() {
  std::vector<SampleFile> files = OneOfEachFormat();
  const FileSpec spec{.type = SampleType::kInt16};
  for (const TiffOptions& options : {TiffOptions{}, TiffOptions{.compression = 5, .tile = 16}}) {
    files.push_back({"v.tif", TiffBytes(spec, options)});
  }
  return files;
}

TEST(Malformed, FilesThatAreCutOffAnywhereFail) {
  for (const SampleFile& good : GoodFiles()) {
    const TemporaryDirectory directory;
    const std::string path = directory / good.file;
    WriteFile(path, good.bytes);
    const Result<LoadedVolume> whole = ReadVolume(path);
    ASSERT_TRUE(whole.ok()) << good.file << ": " << whole.status().message();
    // Nobody sees that the last number of a text has lost digits.
    const bool ends_in_number = good.bytes.find("ASCII") != FileBytes::npos;
    for (std::size_t length = 0; length < good.bytes.size() - (ends_in_number ? 6 : 0); ++length) {
      WriteFile(path, good.bytes.substr(0, length));
      const Result<LoadedVolume> loaded = ReadVolume(path);
      EXPECT_TRUE(CheckVolumeHeaders(path).ok() || !loaded.ok()) << good.file << ": headers refuse what can be read";
      if (loaded.ok()) {
        // The end of a TIFF directory, and what stands behind the samples of VTK, may be missing without harm.
        EXPECT_THAT(good.file, testing::AnyOf("v.tif", "v.vtk", "v.vti")) << "cut to " << length << " of " << good.bytes.size();
        EXPECT_TRUE(std::ranges::equal(loaded->volume->block.bytes, whole->volume->block.bytes)) << good.file << " cut to " << length;
        continue;
      }
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
  for (const SampleFile& good : GoodFiles()) {
    const TemporaryDirectory directory;
    const std::string path = directory / good.file;
    for (int i = 0; i < 400; ++i) {
      FileBytes bytes = good.bytes;
      for (int flips = random.Integer(1, 3); flips > 0; --flips) {
        // Mostly in the header, where it matters.
        const std::size_t at =
            random.Integer<std::size_t>(0, random.Chance(0.8) ? std::min<std::size_t>(bytes.size() - 1, 300) : bytes.size() - 1);
        Damage(bytes[at], random);
      }
      WriteFile(path, bytes);
      const Result<LoadedVolume> loaded = ReadVolume(path);
      EXPECT_TRUE(CheckVolumeHeaders(path).ok() || !loaded.ok()) << "headers refuse what can be read";
      if (loaded.ok()) {
        EXPECT_EQ(std::int64_t(loaded->volume->block.bytes.size()), loaded->info.finest().voxel_bytes());
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
  for (const SampleFile& good : GoodFiles()) {
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

TEST(Headers, OfAStackAreThoseOfAllItsSlices) {
  const TemporaryDirectory directory;
  const Index3 size = {3, 4, 1};
  WritePng(directory / "1.png", size, 8, 0, Samples(12));
  WritePng(directory / "2.png", size, 8, 0, Samples(12));
  EXPECT_THAT(CheckVolumeHeaders(directory.path()).value(), testing::ElementsAre(directory.path()));
  WritePng(directory / "3.png", size, 16, 0, Samples(24));
  ExpectFailure(CheckVolumeHeaders(directory.path()).status(), StatusCode::kInvalidArgument, directory / "3.png", "like the first one");
}

TEST(Headers, AreJudgedByTheOptionsForReading) {
  const TemporaryDirectory directory;
  const std::string path = directory / "v.raw";
  WriteFile(path, Samples(24));
  ReadOptions options{.dims = Index3{2, 3, 4}, .type = SampleType::kUint8};
  EXPECT_TRUE(CheckVolumeHeaders(path, options).ok());
  options.offset = 1;
  ExpectFailure(CheckVolumeHeaders(path, options).status(), StatusCode::kDataLoss, path, "truncated");
  ExpectFailure(CheckVolumeHeaders(path).status(), StatusCode::kInvalidArgument, path, "need --dims");
}

TEST(Malformed, NamesThatAreNoVolumesFail) {
  const TemporaryDirectory directory;
  ExpectFailure(ReadVolume(directory / "nothing.nii").status(), StatusCode::kNotFound, directory / "nothing.nii", "no such file");
  ExpectFailure(ReadVolume(directory.path()).status(), StatusCode::kInvalidArgument, directory.path(), "not a volume");
  EXPECT_FALSE(LooksLikeVolume(directory.path()));
  WriteFile(directory / "v.png", "x");
  ExpectFailure(ReadVolume(directory / "v.png").status(), StatusCode::kInvalidArgument, directory / "v.png", "not a PNG");
  ExpectFailure(ReadVolume("/dev/zero").status(), StatusCode::kInvalidArgument, "/dev/zero", "not a file");
  std::vector<std::string> endings;
  for (const VolumeFormat& format : FileFormats()) {
    if (format.required.empty()) endings.insert(endings.end(), format.endings.begin(), format.endings.end());
  }
  EXPECT_GE(endings.size(), 16U);
  for (const std::string& ending : endings) {
    const std::string path = directory / ("v" + ending);
    WriteFile(path, "This is a letter and no volume.\nWith kind regards\n" + std::string(2000, '.'));
    ExpectFailure(ReadVolume(path).status(), StatusCode::kInvalidArgument, path, "not a");
    WriteFile(path, "");
    EXPECT_FALSE(ReadVolume(path).ok());
  }
  std::filesystem::create_directory(directory / "folder.nii");
  ExpectFailure(ReadVolume(directory / "folder.nii").status(), StatusCode::kInvalidArgument, directory / "folder.nii", "not a volume");
}

TEST(Malformed, OtherNumbersOfDimensionsAndComponentsFail) {
  const TemporaryDirectory directory;
  const auto expect = [&](const char* file, const FileBytes& bytes, const std::string& why) {
    WriteFile(directory / file, bytes);
    ExpectFailure(ReadVolume(directory / file).status(), StatusCode::kInvalidArgument, directory / file, why);
  };
  expect("v.nii", NiftiHeader({.dimensions = {24}}) + Samples(24), "has 1 dimensions");
  expect("v.nii", NiftiHeader({.dimensions = {4, 3, 2, 5}}) + Samples(120), "holds 5 volumes, of which --time takes one: 0 to 4");
  expect("v.nii", NiftiHeader({.dimensions = {4, 3, -2}}) + Samples(24), "size along z is -2");
  FileBytes complex = NiftiHeader({});
  complex[70] = char(32);
  expect("v.nii", complex + Samples(192), "data type 32");

  const auto nrrd = [](const std::string& fields) { return "NRRD0004\ntype: uchar\n" + fields + "encoding: raw\n\n" + Samples(240); };
  expect("v.nrrd", nrrd("dimension: 1\nsizes: 24\n"), "has 1 axes of space");
  expect("v.nrrd", nrrd("dimension: 4\nsizes: 5 3 2 4\n"), "holds 4 volumes");
  expect("v.nrrd", nrrd("dimension: 4\nsizes: 3 4 3 2\nkinds: vector domain domain domain\n"), "3 components");
  WriteFile(directory / "v.nrrd", nrrd("dimension: 4\nsizes: 5 3 2 1\n"));
  EXPECT_TRUE(ReadVolume(directory / "v.nrrd").ok()) << "a fourth dimension of one";

  const auto meta = [](const std::string& fields) {
    return "ObjectType = Image\n" + fields + "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + Samples(240);
  };
  expect("v.mha", meta("NDims = 1\nDimSize = 24\n"), "has 1 dimensions");
  expect("v.mha", meta("NDims = 4\nDimSize = 4 3 2 5\n"), "holds 5 volumes");
  expect("v.mha", meta("NDims = 3\nDimSize = 4 3 2\nElementNumberOfChannels = 3\n"), "3 components");
  expect("v.mha", meta("NDims = 3\nDimSize = 4 3\n"), "DimSize is '4 3'");
  expect("v.mha", meta("NDims = 50\nDimSize = 4 3 2\n"), "NDims is '50'");
  expect("v.mha", meta("NDims = 3\n"), "DimSize is missing");
}

TEST(Slices, AFileOfOneIsAVolume) {
  const TemporaryDirectory directory;
  WriteFile(directory / "v.nii", NiftiHeader({.dimensions = {4, 6}}) + Samples(24));
  WriteFile(directory / "v.mha",
            "ObjectType = Image\nNDims = 2\nDimSize = 4 6\nElementSpacing = 0.5 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
                Samples(24));
  WriteTiff(directory / "v.tif", {.size = {4, 6, 1}}, Samples(24));
  for (const char* file : {"v.nii", "v.mha", "v.tif"}) {
    const Result<LoadedVolume> loaded = ReadVolume(directory / file);
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    EXPECT_EQ(loaded->info.finest().geometry.size, (Index3{4, 6, 1})) << file;
  }
  EXPECT_EQ(ReadVolume(directory / "v.mha")->info.finest().geometry.spacing, (Vec3{0.5, 2, 0.5}));
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

  expect("v.mrc", MrcHeader({.size = large.size, .mode = 1}) + Samples(48), StatusCode::kDataLoss, "truncated");
  expect("v.map.gz", Gzip(MrcHeader({.size = large.size, .mode = 1}) + Samples(48)), StatusCode::kDataLoss, "truncated");
  expect("v.npy", NpyHeader(large) + Samples(48), StatusCode::kDataLoss, "truncated");
  expect("v.npy", NpyHeader("<f8", "(1000000, 65535, 65535, 65535)") + Samples(48), StatusCode::kInvalidArgument, "holds 1000000 volumes");
  const auto vtk = [&](bool binary) {
    FileBytes file = VtkFile({.size = {1000, 1000, 1000}, .type = SampleType::kInt16}, Samples(48), binary);
    file.replace(file.find("DIMENSIONS 1000 1000 1000"), 25, "DIMENSIONS 30000 30000 30000");
    file.replace(file.find("POINT_DATA 1000000000"), 21, "POINT_DATA 27000000000000");
    return file;
  };
  expect("v.vtk", vtk(true), StatusCode::kDataLoss, "truncated");
  expect("v.vtk", vtk(false), StatusCode::kDataLoss, "truncated");
  for (const std::size_t block : {0, 16}) {
    for (const char* format : {"appended", "binary", "ascii"}) {
      expect("v.vti", VtiFile(large, std::string(format) == "ascii" ? "1 2 3" : Samples(48), {.format = format, .block = block}),
             StatusCode::kDataLoss, "truncated");
    }
  }
  WriteFile(directory / "v.raw", Samples(48));
  ExpectFailure(ReadVolume(directory / "v.raw", {.dims = large.size, .type = SampleType::kInt16}).status(), StatusCode::kDataLoss,
                directory / "v.raw", "truncated");

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

// Blocks of zlib whose sizes do not fit: too many, too large, or such that products run over.
TEST(Malformed, BlocksOfVtkThatDoNotFitFail) {
  const TemporaryDirectory directory;
  const FileBytes samples = Samples(24);
  const FileBytes good = VtiFile({}, samples, {.wide_header = true, .block = 8});
  const std::size_t header = good.find('_', good.find("<AppendedData")) + 1;
  WriteFile(directory / "v.vti", good);
  ASSERT_TRUE(ReadVolume(directory / "v.vti").ok());
  const std::uint64_t numbers[] = {0, 1, 2, 4, 7, 9, 24, 25, 1 << 20, std::uint64_t{1} << 32, std::uint64_t{1} << 63, ~std::uint64_t{0}};
  for (std::size_t word = 0; word < 6; ++word) {
    for (const std::uint64_t number : numbers) {
      FileBytes bytes = good;
      std::memcpy(bytes.data() + header + 8 * word, &number, 8);
      WriteFile(directory / "v.vti", bytes);
      const Result<LoadedVolume> loaded = ReadVolume(directory / "v.vti");
      if (bytes == good) continue;
      // The last block may be stated as whole.
      const bool same_sizes = word == 2 && number == 8;
      EXPECT_EQ(loaded.ok(), same_sizes) << "word " << word << " is " << number;
      if (!loaded.ok()) ExpectFailure(loaded.status(), StatusCode::kDataLoss, directory / "v.vti", "array density");
    }
  }
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
