// MetaImage and NRRD: which space their axes are in, which axes are those of space, and samples in several files.
#include <bzlib.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <set>

#include "data/open/read_volume.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

FileBytes Numbers(std::size_t count) {
  FileBytes samples;
  for (std::size_t i = 0; i < count; ++i) samples += char(i);
  return samples;
}

FileBytes Bzip2(FileBytes bytes) {
  FileBytes packed(2 * bytes.size() + 600, '\0');
  auto length = unsigned(packed.size());
  CHECK_EQ(BZ2_bzBuffToBuffCompress(packed.data(), &length, bytes.data(), unsigned(bytes.size()), 1, 0, 0), BZ_OK);
  packed.resize(length);
  return packed;
}

class TextVolumes : public testing::Test {
 protected:
  LoadedVolume Read(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    WriteFile(directory_ / name, bytes);
    Result<LoadedVolume> loaded = ReadVolume(directory_ / name, options);
    CHECK(loaded.ok()) << loaded.status().message();
    return *std::move(loaded);
  }
  std::string WhyNot(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    WriteFile(directory_ / name, bytes);
    const Result<LoadedVolume> loaded = ReadVolume(directory_ / name, options);
    EXPECT_FALSE(loaded.ok());
    EXPECT_THAT(loaded.status().message(), AllOf(HasSubstr(directory_ / name), Not(HasSubstr("\n"))));
    return loaded.status().message();
  }
  static int SampleAt(const LoadedVolume& loaded, const Index3& at) {
    return loaded.volume->block.samples<std::uint8_t>()[NumberIn(loaded.volume->description.geometry.size, at)];
  }

  TemporaryDirectory directory_;
};

// --- MetaImage

FileBytes Meta(const std::string& fields, std::size_t samples = 24) {
  return "ObjectType = Image\n" + fields + "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + Numbers(samples);
}

TEST_F(TextVolumes, MetaImagesAreAPatientsUnlessTheyAreVtks) {
  const std::string three = "NDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 3\n",
                    four = "NDims = 4\nDimSize = 4 3 2 2\nElementSpacing = 1 2 3 1\n", matrix3 = "TransformMatrix = 1 0 0 0 1 0 0 0 1\n",
                    matrix4 = "TransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
  const struct {
    std::string fields;
    World world;
    const char* note;  // part of it; "": there is none
  } cases[] = {
      {three + "Offset = 10 20 30\nAnatomicalOrientation = RAI\n", World::kPatient, ""},
      {three + "Offset = 10 20 30\nAnatomicalOrientation = ???\n", World::kScene, "as VTK writes it"},
      {three + matrix3 + "Position = 10 20 30\nAnatomicalOrientation = ???\n", World::kScene, "as VTK writes it"},
      {three + matrix3 + "Origin = 10 20 30\n", World::kPatient, "not stated: taken for a patient's space"},
      {three + "Offset = 10 20 30\n", World::kPatient, "not stated"},
      {four + matrix4 + "Offset = 10 20 30 0\nAnatomicalOrientation = ????\n", World::kPatient, "????: taken for a patient's space"},
      {four + matrix4 + "Offset = 10 20 30 7\nAnatomicalOrientation = RAI?\n", World::kPatient, ""},
      {four + "Offset = 10 20 30 0\n", World::kPatient, "not stated"},
  };
  for (const auto& [fields, world, note] : cases) {
    SCOPED_TRACE(fields);
    const bool times = fields.starts_with(four);
    const LoadedVolume loaded = Read("v.mha", Meta(fields, times ? 48 : 24), times ? ReadOptions{.time = TimeRange{1, 1}} : ReadOptions{});
    const VolumeGeometry& geometry = loaded.volume->description.geometry;
    EXPECT_EQ(geometry.orientation.world, world);
    EXPECT_EQ(geometry.spacing, (Vec3{1, 2, 3}));
    // Left and posterior become right and anterior: the first voxel comes last along x and y.
    const bool turned = world == World::kPatient;
    ExpectNear(geometry.orientation.origin, turned ? Vec3{-10 - 3, -20 - 4, 30} : Vec3{10, 20, 30}, 1e-9);
    EXPECT_EQ(SampleAt(loaded, turned ? Index3{3, 2, 0} : Index3{0, 0, 0}), times ? 24 : 0);
    if (std::string(note).empty()) {
      EXPECT_THAT(loaded.info.notes, IsEmpty());
    } else {
      EXPECT_THAT(loaded.info.notes, ElementsAre(HasSubstr(note)));
    }
  }
  EXPECT_EQ(Read("v.mha", Meta(three)).volume->description.geometry.orientation.world, World::kVoxels) << "nothing is stated";
}

TEST_F(TextVolumes, MetaImageSpacingIsTheElementsSpacingElseTheirSize) {
  const std::string three = "NDims = 3\nDimSize = 4 3 2\n";
  const auto spacing = [&](const std::string& fields) { return Read("v.mha", Meta(three + fields)).volume->description.geometry.spacing; };
  EXPECT_EQ(spacing("ElementSize = 2 3 4\n"), (Vec3{2, 3, 4}));
  EXPECT_EQ(spacing("ElementSize = 2 3 4\nElementSpacing = 5 6 7\n"), (Vec3{5, 6, 7}));
}

// --- NRRD

FileBytes Nrrd(const std::string& fields, const FileBytes& samples) {
  return "NRRD0004\ntype: uint8\nencoding: raw\n" + fields + "\n" + samples;
}

TEST_F(TextVolumes, NrrdsOfFourDimensionsByItkAreAPatientsSpaceWithTime) {
  const std::string fields =
      "dimension: 4\nspace dimension: 4\nsizes: 4 3 2 2\nspace directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,1)\n"
      "kinds: domain domain domain domain\nspace origin: (10,20,30,0)\n";
  const LoadedVolume loaded = Read("v.nrrd", Nrrd(fields, Numbers(48)), {.time = TimeRange{1, 1}});
  EXPECT_EQ(loaded.volume->description.geometry.orientation.world, World::kPatient);
  ExpectNear(loaded.volume->description.geometry.orientation.origin, {-13, -24, 30}, 1e-9);
  EXPECT_EQ(SampleAt(loaded, {3, 2, 0}), 24);
  EXPECT_THAT(loaded.info.notes, ElementsAre(HasSubstr("as ITK writes it")));
  EXPECT_THAT(WhyNot("v.nrrd", Nrrd(fields, Numbers(48))), HasSubstr("holds 2 volumes, of which --time takes one: 0 to 1"));
  std::string named = fields;
  named.replace(named.find("space dimension: 4"), 18, "space: right-anterior-superior-time");
  ExpectNear(Read("v.nrrd", Nrrd(named, Numbers(48)), {.time = TimeRange{}}).volume->description.geometry.orientation.origin, {10, 20, 30},
             0);
}

TEST_F(TextVolumes, NrrdTimesHaveAStep) {
  const auto times = [&](const std::string& fields) {
    return Read("v.nrrd", Nrrd("dimension: 4\nsizes: 4 3 2 2\n" + fields, Numbers(48)), {.time = TimeRange{}}).info.times;
  };
  const std::string with_time = "kinds: domain domain domain time\n", directions = "space directions: (1,0,0) (0,2,0) (0,0,3) none\n";
  EXPECT_EQ(times(with_time + "spacings: 1 1 1 0.5\nunits: \"mm\" \"mm\" \"mm\" \"ms\"\n"), (TimeAxis{2, 0.5, "ms"}));
  EXPECT_EQ(times(with_time + "spacings: 1 1 1 0.5\n"), (TimeAxis{2, 0.5, ""}));
  EXPECT_EQ(times(with_time + "spacings: 1 1 1 nan\n"), (TimeAxis{2}));
  EXPECT_EQ(times(with_time), (TimeAxis{2}));
  EXPECT_EQ(times("space: RAS\nspace units: \"mm\" \"mm\" \"mm\"\n" + with_time + directions), (TimeAxis{2}));
  EXPECT_EQ(times("space: RAST\nspace units: \"mm\" \"mm\" \"mm\" \"s\"\nspace directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,4)\n"),
            (TimeAxis{2, 4, "s"}));
  EXPECT_EQ(times("kinds: domain domain domain list\nspacings: 1 1 1 0.5\n"), (TimeAxis{2})) << "no times";
}

TEST_F(TextVolumes, MetaImageTimesHaveAStep) {
  const auto times = [&](const std::string& spacing) {
    return Read("v.mha", Meta("NDims = 4\nDimSize = 4 3 2 2\n" + spacing, 48), {.time = TimeRange{}}).info.times;
  };
  EXPECT_EQ(times("ElementSpacing = 1 2 3 2.5\n"), (TimeAxis{2, 2.5, ""}));
  EXPECT_EQ(times("ElementSpacing = 1 2 3 1\n"), (TimeAxis{2}));
  EXPECT_EQ(times("ElementSpacing = 1 2 3 -2\n"), (TimeAxis{2}));
  EXPECT_EQ(times(""), (TimeAxis{2})) << "no spacings";
}

TEST_F(TextVolumes, NrrdAxesThatAreNoneOfSpaceAreComponentsOrVolumes) {
  const std::string space = "dimension: 4\nspace: RAS\n", in_front = space + "sizes: 3 4 3 2\n", behind = space + "sizes: 4 3 2 3\n";
  for (const char* none : {"none", "NONE", "(nan,nan,nan)", "( NaN, nan, nan )"}) {
    for (const char* kinds :
         {"", "kinds: vector domain domain domain\n", "kinds: list domain domain domain\n", "kinds: ??? space space space\n"}) {
      const FileBytes file = Nrrd(fmt::format("{}space directions: {} (1,0,0) (0,2,0) (0,0,3)\n{}", in_front, none, kinds), Numbers(72));
      EXPECT_THAT(WhyNot("v.nrrd", file), HasSubstr("has 3 components a voxel, of which --channel takes one"));
      EXPECT_THAT(WhyNot("v.nrrd", file, {.time = TimeRange{2, 2}}), HasSubstr("time is 2, must be in [0, 0]"));
      const LoadedVolume loaded = Read("v.nrrd", file, {.channel = 2});
      EXPECT_EQ(loaded.volume->description.geometry.size, (Index3{4, 3, 2}));
      EXPECT_EQ(SampleAt(loaded, {1, 0, 0}), 3 + 2);
    }
    const FileBytes file = Nrrd(fmt::format("{}space directions: (1,0,0) (0,2,0) (0,0,3) {}\n", behind, none), Numbers(72));
    EXPECT_EQ(SampleAt(Read("v.nrrd", file, {.time = TimeRange{2, 2}}), {1, 0, 0}), 2 * 24 + 1);
    EXPECT_THAT(WhyNot("v.nrrd", Nrrd(fmt::format("{}space directions: (1,0,0) {} (0,2,0) (0,0,3)\n", behind, none), Numbers(72))),
                HasSubstr("axis 2 of 4 lies between axes of space, but is none of them: not supported"));
  }
  const LoadedVolume channels =
      Read("v.nrrd", Nrrd(behind + "space directions: (1,0,0) (0,2,0) (0,0,3) none\nkinds: domain domain domain vector\n", Numbers(72)),
           {.channel = 1});
  EXPECT_EQ(SampleAt(channels, {1, 0, 0}), 24 + 1);
  EXPECT_EQ(channels.info.channels.size(), 3U);
  // An axis of one sample is no obstacle anywhere.
  EXPECT_EQ(
      SampleAt(Read("v.nrrd", Nrrd(space + "sizes: 4 1 3 2\nspace directions: (1,0,0) none (0,2,0) (0,0,3)\n", Numbers(24))), {1, 1, 1}),
      17);
}

// As ITK writes pictures.
TEST_F(TextVolumes, AFileOfTwoDimensionsIsASlice) {
  const auto geometry = [&](const LoadedVolume& loaded) { return loaded.info.finest().geometry; };
  const VolumeGeometry plain = geometry(Read("v.nrrd", Nrrd("dimension: 2\nsizes: 4 6\nspacings: 0.5 2\n", Numbers(24))));
  EXPECT_EQ(plain.size, (Index3{4, 6, 1}));
  EXPECT_EQ(plain.spacing, (Vec3{0.5, 2, 0.5}));
  const VolumeGeometry placed = geometry(Read(
      "v.nrrd", Nrrd("dimension: 2\nsizes: 4 6\nspace dimension: 2\nspace directions: (0.5,0) (0,2)\nspace origin: (7,8)\n", Numbers(24))));
  EXPECT_EQ(placed.size, (Index3{4, 6, 1}));
  EXPECT_EQ(placed.spacing, (Vec3{0.5, 2, 0.5}));
  EXPECT_EQ(placed.orientation.origin, (Vec3{7, 8, 0}));
}

TEST_F(TextVolumes, NrrdDirectionsThatDoNotSuitAreNamed) {
  const auto why = [&](const std::string& directions) {
    return WhyNot("v.nrrd", Nrrd("dimension: 3\nspace: RAS\nsizes: 4 3 2\nspace directions: " + directions + "\n", Numbers(24)));
  };
  EXPECT_THAT(why("(1,0,0) (0,1,0)"), HasSubstr("must have a vector or none for each of 3 axes"));
  EXPECT_THAT(why("(1,0,0) (0,1,0) (0,0,x)"), HasSubstr("must have a vector or none"));
  EXPECT_THAT(why("(1,0,0) (0,1,0) (0,0,1"), HasSubstr("must have a vector or none"));
  EXPECT_THAT(why("(1,0) (0,1) (1,1)"), HasSubstr("must have vectors of 3 numbers"));
  EXPECT_THAT(why("(1,0,0) (0,1,0) none"), HasSubstr("has 2 axes of space, must have 3, or 2 of a slice"));
  EXPECT_THAT(why("(1,0,0,0) (0,1,0,1) (0,0,1,0)"), HasSubstr("an axis that runs along space and time"));
}

TEST_F(TextVolumes, ANrrdKeyWithAValueIsNoField) {
  EXPECT_FALSE(Read("v.nrrd", Nrrd("type:=double\nsizes:=9\ndimension: 3\nsizes: 4 3 2\n", Numbers(24))).info.labels);
  EXPECT_TRUE(Read("v.nrrd", Nrrd("dimension: 3\nsizes: 4 3 2\nSegment0_ID:=Segment_1\n", Numbers(24))).info.labels);
}

// --- Samples in several files, and what lies in front of them

struct Packed {
  const char* encoding;
  FileBytes (*pack)(const FileBytes&);
};

TEST_F(TextVolumes, SamplesMayLieInSeveralFiles) {
  const FileBytes samples = Numbers(48);
  const Packed packings[] = {{"raw", [](const FileBytes& bytes) { return bytes; }}, {"gzip", Gzip}, {"bzip2", [](const FileBytes& bytes) {
                                                                                                       return Bzip2(bytes);
                                                                                                     }}};
  for (const auto& [encoding, pack] : packings) {
    for (const int files : {1, 2, 4, 8}) {  // from volumes to halves of slices
      SCOPED_TRACE(fmt::format("{} {}", encoding, files));
      std::string list;
      for (int i = 0; i < files; ++i) {
        list += fmt::format("s{:03}.raw\n", i * 2);
        WriteFile(directory_ / fmt::format("s{:03}.raw", i * 2),
                  "line\nline\n" + pack(samples.substr(std::size_t(i * 48 / files), std::size_t(48 / files))));
      }
      const std::string head = fmt::format(
          "NRRD0004\ntype: uint8\nencoding: {}\ndimension: 4\nsizes: 4 3 2 2\nkinds: domain domain domain time\nline skip: 2\ndata file: ",
          encoding);
      for (const std::string& file :
           {"LIST\n" + list, fmt::format("s%03d.raw 0 {} 2\n", 2 * files - 2), fmt::format("LIST 3\n\n{}\n", list)}) {
        const std::string path = directory_ / "v.nhdr";
        for (const int time : {0, 1}) {
          const LoadedVolume loaded = Read("v.nhdr", head + file, {.time = TimeRange{time, time}});
          for (int i = 0; i < 24; ++i) EXPECT_EQ(loaded.volume->block.samples<std::uint8_t>()[i], 24 * time + i);
        }
        EXPECT_EQ(CheckVolumeHeaders(path, {.time = TimeRange{}})->size(), 1U + std::size_t(files));
      }
    }
  }
  WriteFile(directory_ / "s000.raw", "line\n");
  EXPECT_THAT(WhyNot("v.nhdr", "NRRD0004\ntype: uint8\nencoding: raw\ndimension: 3\nsizes: 4 3 2\nline skip: 2\ndata file: s000.raw\n"),
              HasSubstr("s000.raw: has no more lines to skip"));
}

TEST_F(TextVolumes, AMetaImageCountsItsSlices) {
  for (int z = 0; z < 2; ++z) WriteFile(directory_ / fmt::format("s{}.raw", z), "header" + Numbers(24).substr(std::size_t(z) * 12, 12));
  const std::string head = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nHeaderSize = -1\nElementDataFile = ";
  for (const char* file : {"LIST\ns0.raw\ns1.raw\n", "LIST 2\ns0.raw\ns1.raw\n", "s%d.raw 0 1 1\n", "s%01d.raw 0 1\n", "s%d.raw 0\n"}) {
    const LoadedVolume loaded = Read("v.mhd", head + file);
    for (int i = 0; i < 24; ++i) EXPECT_EQ(loaded.volume->block.samples<std::uint8_t>()[i], i) << file;
  }
  EXPECT_THAT(WhyNot("v.mhd", head + "s%d.raw 0 4 1\n"), HasSubstr("24 bytes of samples do not divide into 5 files"));
  EXPECT_THAT(WhyNot("v.mhd", head + "s%d.raw 0 2 1\n"), HasSubstr("s2.raw"));
  EXPECT_THAT(WhyNot("v.mhd", head + "LIST\n"), HasSubstr("no names of files follow"));
  for (const char* file : {"s%s.raw 0 1 1\n", "s%d%d.raw 0 1 1\n", "s%n.raw\n", "s%99999d.raw 0 1 1\n", "s%d.raw 0 1 0\n",
                           "s%d.raw 1 0 1\n", "s%d.raw x\n", "s%d.raw 0 2000000000 1\n", "s%\n", "s%d.raw -5 -1\n"}) {
    EXPECT_THAT(WhyNot("v.mhd", head + file), HasSubstr("must be NAME FIRST LAST STEP")) << file;
  }
  // Bytes of the header's own file.
  FileBytes local = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nHeaderSize = 300\nElementDataFile = LOCAL\n";
  local.resize(300, ' ');
  EXPECT_EQ(SampleAt(Read("v.mha", local + Numbers(24)), {1, 1, 1}), 17);
}

TEST_F(TextVolumes, TheLastBytesAreThoseOfAllVolumes) {
  WriteFile(directory_ / "v.raw", "something" + Numbers(48));
  const std::string fields =
      "NRRD0004\ntype: uint8\nencoding: raw\ndimension: 4\nsizes: 4 3 2 2\nkinds: space space space time\nbyte skip: -1\ndata file: "
      "v.raw\n";
  EXPECT_EQ(SampleAt(Read("v.nhdr", fields, {.time = TimeRange{1, 1}}), {0, 0, 0}), 24);
}

TEST_F(TextVolumes, DamagedBzip2IsFound) {
  const std::string head = "NRRD0004\ntype: uint8\nencoding: bzip2\ndimension: 3\nsizes: 4 3 2\n\n";
  const FileBytes packed = Bzip2(Numbers(24));
  EXPECT_EQ(SampleAt(Read("v.nrrd", head + packed), {1, 1, 1}), 17);
  FileBytes joined = Bzip2(Numbers(12)) + Bzip2(Numbers(24).substr(12));
  EXPECT_EQ(SampleAt(Read("v.nrrd", head + joined), {1, 1, 1}), 17);
  int found = 0;
  for (std::size_t at = 0; at < packed.size(); ++at) {
    FileBytes damaged = packed;
    damaged[at] = char(damaged[at] ^ 0x10);
    WriteFile(directory_ / "v.nrrd", head + damaged);
    const Result<LoadedVolume> loaded = ReadVolume(directory_ / "v.nrrd");
    if (loaded.ok()) {  // some bits have no meaning
      EXPECT_EQ(SampleAt(*loaded, {1, 1, 1}), 17) << at;
    } else {
      EXPECT_THAT(loaded.status().message(), testing::AnyOf(HasSubstr("damaged"), HasSubstr("truncated"))) << at;
      ++found;
    }
  }
  EXPECT_GT(found, int(packed.size()) - 5);
  EXPECT_THAT(WhyNot("v.nrrd", head + packed.substr(0, packed.size() / 2)), HasSubstr("truncated"));
}

// --- Labels

TEST_F(TextVolumes, SlantedLabelsKeepTheirNumbers) {
  Random random(33);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 20; ++round) {
    FileBytes samples;
    for (int i = 0; i < 9 * 8 * 7; ++i) samples += char(std::array{0, 7, 40, 200}[random.Integer<std::size_t>(0, 3)]);
    const std::string fields = fmt::format("dimension: 3\nspace: RAS\nsizes: 9 8 7\nspace directions: (1,0,0) ({},1,0) ({},{},2)\n",
                                           random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1));
    const auto values = [&](const LoadedVolume& loaded) {
      EXPECT_TRUE(loaded.info.stored->slanted);
      std::set<int> found;
      for (const std::byte sample : loaded.volume->block.bytes) found.insert(std::to_integer<int>(sample));
      return found;
    };
    EXPECT_THAT(values(Read("v.nrrd", Nrrd(fields + "Segment0_ID:=one\n", samples))), ElementsAre(0, 7, 40, 200));
    EXPECT_THAT(values(Read("v.nrrd", Nrrd(fields, samples), {.labels = true})), ElementsAre(0, 7, 40, 200)) << "of --labels";
    EXPECT_GT(values(Read("v.nrrd", Nrrd(fields, samples))).size(), 4U) << "measurements are interpolated";
  }
}

class BovTest : public testing::Test {
 protected:
  // 4 x 3 x 2 numbers from 0 behind eight bytes, and a header of these lines.
  Result<LoadedVolume> Read(const std::string& lines, bool big = false) const {
    std::vector<double> values;
    for (int i = 0; i < 24; ++i) values.push_back(i);
    WriteFile(directory_ / "v.dat", FileBytes(8, 'x') + EncodeSamples(SampleType::kFloat32, values, big));
    WriteFile(directory_ / "v.bov", lines);
    return ReadVolume(directory_ / "v.bov");
  }
  std::string WhyNot(const std::string& lines) const { return Read(lines).status().message(); }

  static constexpr const char* kLines =
      "TIME: 1.5\n# a comment: of VisIt\n\nDATA_FILE: v.dat\nDATA_SIZE: 4 3 2\nDATA_FORMAT: FLOAT\nVARIABLE: \"rho\"\nBYTE_OFFSET: 8\n"
      "BRICK_ORIGIN: 10. 20. 30.\nBRICK_SIZE: 12. 6. 4.\n";
  const TemporaryDirectory directory_;
};

TEST_F(BovTest, NodesLieOnTheBordersAndCellsBetweenThem) {
  for (const bool cells : {false, true}) {
    for (const bool big : {false, true}) {
      const auto read = Read(std::string(kLines) + (cells ? "CENTERING: zonal\n" : "") + (big ? "DATA_ENDIAN: BIG\n" : ""), big);
      ASSERT_TRUE(read.ok()) << read.status().message();
      const VolumeGeometry& geometry = read->volume->description.geometry;
      EXPECT_EQ(geometry.size, (Index3{4, 3, 2}));
      EXPECT_EQ(geometry.spacing, cells ? (Vec3{3, 2, 2}) : (Vec3{4, 3, 4}));
      EXPECT_EQ(geometry.ToWorld({}), cells ? (Vec3{11.5, 21, 31}) : (Vec3{10, 20, 30}));
      const std::span<const std::byte> bytes(read->volume->block.bytes);
      for (int i = 0; i < 24; ++i) {
        const double value = bytes.size() == 24 ? double(bytes[std::size_t(i)]) : double(read->volume->block.samples<float>()[i]);
        EXPECT_EQ(value, i);
      }
    }
  }
}

TEST_F(BovTest, WhatIsWrongIsSaidInOneLine) {
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string lines = kLines;
    return WhyNot(lines.replace(lines.find(from), from.size(), to));
  };
  EXPECT_THAT(with("DATA_FILE: v.dat", ""), HasSubstr("v.bov: not a BOV volume: data_file is missing"));
  EXPECT_THAT(with("v.dat", "v%05d.dat"), HasSubstr("its samples lie in several files, v%05d.dat, which is not supported"));
  EXPECT_THAT(with("v.dat", "w.dat"), HasSubstr("w.dat: No such file"));
  EXPECT_THAT(with("FLOAT", "HALF"), HasSubstr("DATA_FORMAT is 'half', must be BYTE, SHORT, INT, FLOAT or DOUBLE"));
  EXPECT_THAT(with("4 3 2", "4 3"), HasSubstr("data_size is '4 3', must be 3 numbers"));
  EXPECT_THAT(with("4 3 2", "4 3 20"), HasSubstr("truncated"));
  EXPECT_THAT(with("BYTE_OFFSET: 8", "BYTE_OFFSET: x"), HasSubstr("BYTE_OFFSET is 'x'"));
  EXPECT_THAT(with("TIME", "DATA_COMPONENTS: 0\nTIME"), HasSubstr("DATA_COMPONENTS is '0', must be in [1, 1024]"));
  EXPECT_THAT(with("TIME", "CENTERING: face\nTIME"), HasSubstr("centering is 'face', must be nodal or zonal"));
  EXPECT_THAT(with("12. 6. 4.", "0 6 4"), HasSubstr("BRICK_SIZE"));
}

}  // namespace
}  // namespace slabstream
