// Boxes that are read by position are those of the volume that is decoded as a whole.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <limits>
#include <thread>
#include <vector>

#include "data/positional/file_source.h"
#include "tests/data/positional/like_whole.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr SampleType kTypes[] = {SampleType::kInt8,   SampleType::kUint8, SampleType::kInt16,  SampleType::kUint16,  SampleType::kInt32,
                                 SampleType::kUint32, SampleType::kInt64, SampleType::kUint64, SampleType::kFloat32, SampleType::kFloat64};

TEST(Positional, ReadsEveryFormatAndTypeAsTheWholeReaderDoes) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const SampleType type : kTypes) {
    for (const bool big : {false, true}) {
      const FileSpec spec{.size = {random.Integer(1, 9), random.Integer(1, 9), random.Integer(1, 9)},
                          .type = type,
                          .big_endian = big,
                          .spacing = {0.5, 0.75, 2}};
      const FileBytes samples = EncodeSamples(type, RandomValues(random, type, CountIn(spec.size)), big);
      std::vector<std::pair<std::string, FileBytes>> files = {{"v.nii", NiftiHeader(spec) + samples},
                                                              {"v.nrrd", NrrdHeader(spec, "raw") + samples},
                                                              {"v.nhdr", NrrdHeader(spec, "raw", "samples")},
                                                              {"v.mha", MetaHeader(spec, "LOCAL") + samples},
                                                              {"v.mhd", MetaHeader(spec, "samples")},
                                                              {"v.vti", VtiFile(spec, samples)},
                                                              {"wide.vti", VtiFile(spec, samples, {.wide_header = true})}};
      if (!big) files.emplace_back("v.npy", NpyHeader(spec) + samples);
      WriteFile(directory / "samples", samples);
      for (const auto& [name, bytes] : files) {
        WriteFile(directory / name, bytes);
        ExpectLikeWhole(directory / name, {}, random);
      }
      WriteFile(directory / "v.raw", "12345" + samples + "behind");
      const ReadOptions options{.spacing = Vec3{1, 2, 3}, .dims = spec.size, .type = type, .big_endian = big, .offset = 5};
      ExpectLikeWhole(directory / "v.raw", options, random);
    }
  }
  EXPECT_THAT(Opened(directory / "v.mhd")->info().files, ElementsAre(directory / "v.mhd", directory / "samples"));
}

// What is decoded as a whole is given away to whoever wants all of it, while others read boxes.
TEST(Positional, BoxesOfADecodedVolumeAreRightWhileItIsTakenAway) {
  const TemporaryDirectory directory;
  const FileSpec spec{.size = {256, 256, 64}, .type = SampleType::kUint8};  // so large that copies overlap
  std::vector<double> values(CountIn(spec.size));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(i % 251);
  const std::string path = directory / "v.nrrd";
  WriteFile(path, NrrdHeader(spec, "raw") + EncodeSamples(spec.type, values, false));
  const auto source = OpenDecoded(*FindFormat(path, {}), path, {}).value();
  std::atomic<bool> reading = true;
  std::thread taker([&] {
    while (reading) EXPECT_TRUE(source->ReadLevel(0, nullptr, {}).ok());
  });
  const Box box{{0, 0, 0}, spec.size};
  for (int i = 0; i < 50; ++i) {
    std::vector<std::uint8_t> read(values.size());
    EXPECT_TRUE(source->ReadNow(0, box, BoxRoom::Dense(box, reinterpret_cast<std::byte*>(read.data()), true)).ok());
    EXPECT_TRUE(std::ranges::equal(read, values));
  }
  reading = false;
  taker.join();
}

TEST(Positional, ReadsMapsAndArraysInAnyOrderOfAxes) {
  Random random(32);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::pair<int, SampleType> modes[] = {
      {0, SampleType::kInt8}, {1, SampleType::kInt16}, {2, SampleType::kFloat32}, {6, SampleType::kUint16}};
  for (const auto& [mode, type] : modes) {
    Index3 axes = {1, 2, 3};
    do {
      const MrcSpec spec{.size = {5, 4, 3}, .mode = mode, .big_endian = random.Chance(0.5), .axes = axes, .extension = 7};
      const FileBytes samples = EncodeSamples(type, RandomValues(random, type, 60), spec.big_endian);
      WriteFile(directory / "v.mrc", MrcHeader(spec) + samples);
      ExpectLikeWhole(directory / "v.mrc", {}, random);
      std::array<int, 3> next = {axes.x, axes.y, axes.z};
      std::ranges::next_permutation(next);
      axes = {next[0], next[1], next[2]};
    } while (axes != Index3{1, 2, 3});
  }
  for (const bool fortran : {false, true}) {
    const FileBytes samples = EncodeSamples(SampleType::kUint16, RandomValues(random, SampleType::kUint16, 60), true);
    WriteFile(directory / "v.npy", NpyHeader(">u2", "(3, 4, 5)", fortran) + samples);
    ExpectLikeWhole(directory / "v.npy", {}, random);
  }
}

TEST(Positional, TurnsVoxelsOfEachOfThe48Storages) {
  Random random(33);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const Storage& storage : AllStorages()) {
    SCOPED_TRACE(Text(storage));
    WriteFile(directory / "v.nrrd", NrrdFile(StoredAs({.size = {7, 5, 6}}, storage)));
    ExpectLikeWhole(directory / "v.nrrd", {}, random, 20);
    WriteFile(directory / "long.nrrd", NrrdFile(StoredAs({.size = {70, 41, 66}}, storage)));
    ExpectLikeWhole(directory / "long.nrrd", {}, random, 4);
  }
}

TEST(Positional, TakesOneOfSeveralTimesAndComponents) {
  Random random(34);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const FileSpec spec{.type = SampleType::kInt16, .dimensions = {4, 3, 2, 5}};
  WriteFile(directory / "v.nii", NiftiHeader(spec) + EncodeSamples(spec.type, RandomValues(random, spec.type, 120)));
  for (int time = 0; time < 5; ++time) {
    ExpectLikeWhole(directory / "v.nii", {.time = TimeRange{time, time}}, random);
    EXPECT_EQ(Opened(directory / "v.nii", {.time = TimeRange{time, time}})->info().times.count, 5);
  }
  EXPECT_THAT(Open(directory / "v.nii").status().message(), HasSubstr("holds 5 volumes"));
  EXPECT_THAT(Open(directory / "v.nii", {.time = TimeRange{5, 5}}).status().message(), HasSubstr("time is 5, must be in [0, 4]"));

  for (const int components : {3, 4, 700}) {
    const FileBytes header = fmt::format(
        "NRRD0004\ntype: float\ndimension: 4\nsizes: {} 5 4 3\nkinds: vector domain domain domain\n"
        "endian: big\nencoding: raw\n\n",
        components);
    WriteFile(directory / "v.nrrd",
              header + EncodeSamples(SampleType::kFloat32, RandomValues(random, SampleType::kFloat32, 60 * std::size_t(components)), true));
    for (const int channel : {0, 1, components - 1}) ExpectLikeWhole(directory / "v.nrrd", {.channel = channel}, random);
    EXPECT_EQ(Opened(directory / "v.nrrd", {.channel = 1})->info().channels.size(), std::size_t(components));
    EXPECT_THAT(Open(directory / "v.nrrd").status().message(), HasSubstr("components a voxel, of which --channel takes one"));
  }
  WriteFile(directory / "v.nrrd", "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\nencoding: raw\n\n" + std::string(24, 'x'));
  EXPECT_TRUE(Opened(directory / "v.nrrd", {.channel = kLuminance})->info().whole);
}

// Larger than what one part of a read takes, by slices, by rows, and by columns.
TEST(Positional, ReadsLargeBoxesInParts) {
  Random random(35);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const auto file = [&](const Index3& size, SampleType type, bool big, const std::string& directions) {
    FileBytes samples(CountIn(size) * BytesPerSample(type), '\0');
    for (char& byte : samples) byte = char(random.Integer(0, 255));
    const std::string name = type == SampleType::kUint8 ? "uint8" : type == SampleType::kUint16 ? "uint16" : "int16";
    WriteFile(directory / "v.nrrd", fmt::format("NRRD0004\ntype: {}\ndimension: 3\nsizes: {} {} {}\nendian: {}\nencoding: raw\n{}\n", name,
                                                size.x, size.y, size.z, big ? "big" : "little", directions) +
                                        samples);
  };
  const std::string flipped = "space: right-anterior-superior\nspace directions: (1,0,0) (0,-1,0) (0,0,-1)\n",
                    turned = "space: right-anterior-superior\nspace directions: (0,0,-1) (1,0,0) (0,1,0)\n";
  for (const std::string& directions : {std::string(), flipped, turned}) {
    file({300, 200, 60}, SampleType::kUint16, false, directions);
    ExpectLikeWhole(directory / "v.nrrd", {}, random, 6);
    file({300, 200, 60}, SampleType::kInt16, true, directions);
    ExpectLikeWhole(directory / "v.nrrd", {}, random, 6);
    file({9000, 400, 2}, SampleType::kUint8, false, directions);  // rows with much between them
    ExpectLikeWhole(directory / "v.nrrd", {}, random, 6);
  }
  WriteFile(directory / "v.nrrd",
            "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 100 60000 1 2\nkinds: vector domain domain domain\n"
            "encoding: raw\n\n");
  FileBytes samples(std::size_t{12000000}, '\0');
  for (char& byte : samples) byte = char(random.Integer(0, 255));
  WriteFile(directory / "v.nrrd", ReadFile(directory / "v.nrrd") + samples);
  ExpectLikeWhole(directory / "v.nrrd", {.channel = 57}, random, 4);
}

TEST(Positional, ReadsOnlyWhatABoxNeeds) {
  const TemporaryDirectory directory;
  WriteFile(directory / "v.raw", std::string(std::size_t{100} * 100 * 100, 'x'));
  const auto source = Opened(directory / "v.raw", {.dims = Index3{100, 100, 100}, .type = SampleType::kUint8});
  ReadBox(*source, 0, {{0, 0, 7}, {100, 100, 9}});
  EXPECT_EQ(source->counts().stored_bytes, 20000U);
  ReadBox(*source, 0, {{99, 99, 99}, {100, 100, 100}});
  EXPECT_EQ(source->counts().stored_bytes, 20001U);
  EXPECT_EQ(source->info().levels[0].block, (Index3{100, 1, 1})) << "a row lies together";
}

TEST(Positional, KnowsHowEachFileIsRead) {
  const TemporaryDirectory directory;
  for (const SampleFile& file : OneOfEachFormat()) {
    WriteFile(directory / file.file, file.bytes);
    const auto source = Open(directory / file.file);
    ASSERT_TRUE(source.ok()) << source.status().message();
    const SourceInfo& info = (*source)->info();
    EXPECT_EQ(info.in_parts() + info.slices.has_value() + info.whole, 1) << file.file;
    // However it is read, each box is that of the whole.
    Random random(38);
    ExpectLikeWhole(directory / file.file, {}, random, 3);
  }
  EXPECT_TRUE(Opened(directory / "v.nii")->info().in_parts());
  EXPECT_TRUE(Opened(directory / "v.nii.gz")->info().slices.has_value());
}

TEST(Positional, HalfFloatsAreReadInParts) {
  Random random(37);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const FileBytes halves = EncodeSamples(SampleType::kFloat16, {0, -2, 0.5, 65504, 0x1p-24, 1, 3, 4}, false);
  WriteFile(directory / "v.npy", NpyHeader("<f2", "(2, 2, 2)") + halves);
  ExpectLikeWhole(directory / "v.npy", {}, random);
}

TEST(Positional, WhatDoesNotLieInOnePieceIsDecodedAsAWhole) {
  const TemporaryDirectory directory;
  const auto is_whole = [&](const std::string& name, const FileBytes& bytes) {
    WriteFile(directory / name, bytes);
    Random random(39);
    ExpectLikeWhole(directory / name, {}, random, 3);
    return Opened(directory / name)->info().whole;
  };
  const FileSpec spec;
  EXPECT_TRUE(is_whole("v.nrrd",
                       "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nspace: RAS\n"
                       "space directions: (1,0,0) (0,1,0) (0,0.3,1)\n\n12345678"));
  EXPECT_TRUE(is_whole("v.vti", VtiFile(spec, AsText(std::vector<double>(24, 7)), {.format = "ascii"})));
  EXPECT_TRUE(is_whole("v.vtk", VtkFile(spec, std::string(24, 'x'), true)));
}

TEST(Positional, NamesAFileThatIsOrBecomesTooShort) {
  const TemporaryDirectory directory;
  const FileSpec spec{.size = {50, 40, 30}};
  const std::string path = directory / "v.mhd", samples = directory / "v.raw";
  WriteFile(path, MetaHeader(spec, "v.raw"));
  WriteFile(samples, std::string(59999, 'x'));
  const Status before = Open(path).status();
  EXPECT_EQ(before.code(), StatusCode::kDataLoss);
  EXPECT_THAT(before.message(), AllOf(HasSubstr("v.mhd"), HasSubstr("v.raw"), HasSubstr("truncated")));
  WriteFile(samples, std::string(60000, 'x'));
  const auto source = Opened(path);
  std::filesystem::resize_file(samples, 30001);
  std::vector<std::byte> bytes(2000);
  const auto read = [&](std::int32_t z) { return source->ReadNow(0, {{0, 0, z}, {50, 40, z + 1}}, bytes); };
  EXPECT_TRUE(read(14).ok());
  EXPECT_EQ(read(15).code(), StatusCode::kDataLoss);
  EXPECT_THAT(read(15).message(), AllOf(HasSubstr("v.raw"), HasSubstr("ends before byte 30002")));
  std::filesystem::remove(samples);
  EXPECT_EQ(Open(path).status().code(), StatusCode::kNotFound);
}

TEST(Positional, EndsOnceWhenItIsStopped) {
  const TemporaryDirectory directory;
  WriteFile(directory / "v.raw", std::string(std::size_t{256} * 256 * 256, 'x'));
  const auto source = Opened(directory / "v.raw", {.dims = Index3{256, 256, 256}, .type = SampleType::kUint8});
  std::stop_source stop;
  stop.request_stop();
  std::vector<std::byte> bytes(std::size_t{256} * 256 * 256);
  EXPECT_EQ(source->ReadNow(0, {{0, 0, 0}, {256, 256, 256}}, bytes, stop.get_token()).code(), StatusCode::kCancelled);
  EXPECT_EQ(source->counts().stored_bytes, 0U);
}

// Whatever a header says, a file is refused, or read as the whole reader reads it.
TEST(Positional, BearsDamagedFiles) {
  Random random(36);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const SampleFile& file : OneOfEachFormat()) {
    for (int i = 0; i < 60; ++i) {
      FileBytes bytes = file.bytes;
      const std::size_t within = std::min(bytes.size(), std::max<std::size_t>(file.header, 1));
      for (int hits = random.Integer(1, 3); hits > 0; --hits) Damage(bytes[random.Integer<std::size_t>(0, within - 1)], random);
      if (random.Chance(0.2)) bytes.resize(random.Integer<std::size_t>(0, bytes.size()));
      WriteFile(directory / file.file, bytes);
      const auto source = Open(directory / file.file);
      if (!source.ok() || !(*source)->info().in_parts()) continue;
      SCOPED_TRACE(fmt::format("{}, {}", file.file, i));
      ASSERT_LT((*source)->info().levels[0].description.geometry.bounds().voxel_count(), 10000);
      ExpectLikeWhole(directory / file.file, {}, random, 3);
    }
  }
}

}  // namespace
}  // namespace slabstream
