// Which matrix places a NIfTI volume, and the other kinds of such files: NIfTI-2, pairs, Analyze 7.5, five dimensions, and FreeSurfer's
// MGH.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr Index3 kNiftiSize = {5, 6, 7};

// The samples are the numbers of the voxels.
FileBytes Numbered() {
  FileBytes samples;
  for (std::size_t i = 0; i < CountIn(kNiftiSize); ++i) samples += char(i);
  return samples;
}

// The fields of a header, in either version.
struct Fields {
  int version = 1;
  bool big_endian = false;
  std::vector<std::int64_t> dim = {3, 5, 6, 7};
  int type = 2, intent = 0, qform = 0, sform = 0;
  std::array<double, 4> pixdim = {1, 1, 1, 1};
  std::array<double, 3> quaternion{}, qoffset{};
  std::array<double, 12> srow{};
  double slope = 0, intercept = 0;
  bool pair = false;
};

template <class T>
void Put(FileBytes& bytes, std::size_t at, T value, bool big_endian) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  if (big_endian) std::ranges::reverse(raw);
  bytes.replace(at, raw.size(), raw.data(), raw.size());
}

FileBytes Header(const Fields& f) {
  const bool second = f.version == 2;
  FileBytes bytes(second ? 544 : 352, '\0');
  const auto put = [&](std::size_t at, auto value) { Put(bytes, at, value, f.big_endian); };
  const auto reals = [&](std::size_t first, std::size_t second_first, const auto& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      second ? put(second_first + 8 * i, double(values[i])) : put(first + 4 * i, float(values[i]));
    }
  };
  put(0, std::int32_t(second ? 540 : 348));
  for (std::size_t i = 0; i < f.dim.size(); ++i) second ? put(16 + 8 * i, f.dim[i]) : put(40 + 2 * i, std::int16_t(f.dim[i]));
  put(second ? 12 : 70, std::int16_t(f.type));
  reals(76, 104, f.pixdim);
  reals(256, 352, f.quaternion);
  reals(268, 376, f.qoffset);
  reals(280, 400, f.srow);
  reals(112, 176, std::array{f.slope, f.intercept});
  if (second) {
    put(168, std::int64_t(f.pair ? 0 : 544));
    put(344, std::int32_t(f.qform));
    put(348, std::int32_t(f.sform));
    put(500, std::int32_t(2));  // mm
    put(504, std::int32_t(f.intent));
    bytes.replace(4, 8, std::string(f.pair ? "ni2" : "n+2") + std::string("\0\r\n\x1a\n", 5));
  } else {
    put(108, f.pair ? 0.0F : 352.0F);
    put(252, std::int16_t(f.qform));
    put(254, std::int16_t(f.sform));
    bytes[123] = 2;
    put(68, std::int16_t(f.intent));
    bytes.replace(344, 4, std::string(f.pair ? "ni1" : "n+1") + '\0');
  }
  return bytes;
}

struct Placement {
  Steps steps;
  Vec3 origin;
};

// Each voxel lies where the placement has the stored voxel of its number.
void ExpectPlaced(const LoadedVolume& loaded, const Placement& placement) {
  const VolumeGeometry& geometry = loaded.volume->description.geometry;
  ASSERT_EQ(CountIn(geometry.size), CountIn(kNiftiSize));
  for (std::size_t i = 0; i < CountIn(kNiftiSize); ++i) {
    const Index3 at = PlaceIn(geometry.size, i), stored = PlaceIn(kNiftiSize, loaded.volume->block.samples<std::uint8_t>()[i]);
    const Vec3 place = geometry.orientation.origin + geometry.orientation.ToWorld(geometry.spacing * ToVec3(at));
    const Vec3 expected = placement.origin + double(stored.x) * placement.steps[0] + double(stored.y) * placement.steps[1] +
                          double(stored.z) * placement.steps[2];
    ExpectNear(place, expected, 1e-3);
    if (testing::Test::HasFailure()) return;
  }
}

Vec3 RandomDirection(Random& random) {
  Vec3 v;
  do v = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)};
  while (Length(v) > 1 || Length(v) < 0.1);
  return Normalized(v);
}

class NiftiTest : public testing::Test {
 protected:
  Result<LoadedVolume> Read(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    WriteFile(directory_ / name, bytes);
    return ReadVolume(directory_ / name, options);
  }
  LoadedVolume ReadWell(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    Result<LoadedVolume> loaded = Read(name, bytes, options);
    CHECK(loaded.ok()) << loaded.status().message();
    return *std::move(loaded);
  }
  std::string WhyNot(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    const Result<LoadedVolume> loaded = Read(name, bytes, options);
    EXPECT_EQ(loaded.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(loaded.status().message(), AllOf(HasSubstr(directory_ / name), Not(HasSubstr("\n"))));
    return loaded.status().message();
  }

  TemporaryDirectory directory_;
};

TEST_F(NiftiTest, TheSformCountsIfItIsStatedElseTheQform) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 200; ++round) {
    Fields f{
        .version = random.Integer(1, 2), .big_endian = random.Chance(0.5), .qform = random.Integer(0, 5), .sform = random.Integer(0, 5)};
    if (random.Chance(0.1)) f.qform = -1;
    const Vec3 spacing = {random.Real(0.5, 3), random.Real(0.5, 3), random.Real(0.5, 3)};
    // The quaternion of a rotation by Rodrigues' formula.
    const auto turn = [](const Vec3& axis, double angle, const Vec3& v) {
      return std::cos(angle) * v + std::sin(angle) * Cross(axis, v) + (1 - std::cos(angle)) * Dot(axis, v) * axis;
    };
    const Vec3 axis = RandomDirection(random), other = RandomDirection(random);
    const double angle = random.Real(0, std::numbers::pi), other_angle = random.Real(0, std::numbers::pi);
    const double qfac = std::array{-1.0, 0.0, 1.0}[random.Integer<std::size_t>(0, 2)], sign = qfac < 0 ? -1 : 1;
    f.pixdim = {qfac, spacing.x, spacing.y, spacing.z};
    Placement qform{{spacing.x * turn(axis, angle, {1, 0, 0}), spacing.y * turn(axis, angle, {0, 1, 0}),
                     sign * spacing.z * turn(axis, angle, {0, 0, 1})},
                    {random.Real(-99, 99), random.Real(-99, 99), random.Real(-99, 99)}};
    // The sform is another one, mirrored or not.
    Placement sform{{1.5 * turn(other, other_angle, {random.Chance(0.5) ? 1.0 : -1.0, 0, 0}), 0.75 * turn(other, other_angle, {0, 0, 1}),
                     2 * turn(other, other_angle, {0, 1, 0})},
                    {random.Real(-99, 99), random.Real(-99, 99), random.Real(-99, 99)}};
    for (std::size_t i = 0; i < 3; ++i) {
      f.quaternion[i] = std::sin(angle / 2) * axis[int(i)];
      f.qoffset[i] = qform.origin[int(i)];
      for (std::size_t j = 0; j < 3; ++j) f.srow[4 * i + j] = sform.steps[j][int(i)];
      f.srow[4 * i + 3] = sform.origin[int(i)];
    }
    SCOPED_TRACE(fmt::format("round {}: version {}, qform_code {}, sform_code {}", round, f.version, f.qform, f.sform));
    const LoadedVolume loaded = ReadWell("v.nii", Header(f) + Numbered());
    ASSERT_EQ(loaded.info.notes.size(), 1U);
    const std::string& note = loaded.info.notes[0];
    if (f.sform <= 0 && f.qform <= 0) {
      EXPECT_EQ(loaded.volume->description.geometry.orientation.world, World::kVoxels);
      EXPECT_THAT(note, HasSubstr("states the spacing alone"));
      continue;
    }
    ExpectPlaced(loaded, f.sform > 0 ? sform : qform);
    EXPECT_THAT(note, HasSubstr(fmt::format("placed by the {} (code {}: ", f.sform > 0 ? "sform" : "qform",
                                            std::max(f.sform, f.sform > 0 ? 0 : f.qform))));
    if (f.sform > 0 && f.qform > 0) {
      EXPECT_THAT(note, HasSubstr("mm away: --matrix qform takes it"));
      ExpectPlaced(ReadWell("v.nii", Header(f) + Numbered(), {.matrix = "qform"}), qform);
      ExpectPlaced(ReadWell("v.nii.gz", Gzip(Header(f) + Numbered()), {.matrix = "sform"}), sform);
    } else {
      const std::string missing = f.sform > 0 ? "qform" : "sform";
      EXPECT_THAT(WhyNot("v.nii", Header(f) + Numbered(), {.matrix = missing}),
                  HasSubstr("matrix is " + missing + ", but the file states none"));
    }
    if (HasFailure()) return;
  }
}

TEST_F(NiftiTest, TheNoteMeasuresTheLargestDistanceOfCorners) {
  Fields f{.qform = 1, .sform = 4};
  f.srow = {2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_THAT(ReadWell("v.nii", Header(f) + Numbered()).info.notes,
              ElementsAre("placed by the sform (code 4: MNI 152); the qform (code 1: scanner) places corners up to 4 mm away: "
                          "--matrix qform takes it"));
  f.pixdim[1] = 2;
  EXPECT_THAT(ReadWell("v.nii", Header(f) + Numbered()).info.notes,
              ElementsAre("placed by the sform (code 4: MNI 152); the qform (code 1: scanner) agrees"));
}

TEST_F(NiftiTest, QformsThatAreNotQuiteRightAreTakenAsInNibabel) {
  Fields f{.qform = 1};
  f.pixdim = {0, 2, 0, -3};
  f.quaternion = {0, 0, 0.70710682};  // with a: 1 + 1e-7
  f.quaternion[1] = 0.70710682;
  const LoadedVolume loaded = ReadWell("v.nii", Header(f) + Numbered());
  ExpectPlaced(loaded, {{Vec3{-2, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 3, 0}}, {0, 0, 0}});
  EXPECT_THAT(loaded.info.notes, ElementsAre(HasSubstr("placed by the qform"), HasSubstr("0 is taken as 1")));
  f.quaternion = {0.9, 0.9, 0};
  EXPECT_THAT(WhyNot("v.nii", Header(f) + Numbered()), HasSubstr("squares must add up to at most 1"));
  f.sform = 2;
  EXPECT_THAT(WhyNot("v.nii", Header(f) + Numbered()),
              HasSubstr("v.nii: sform (--matrix qform takes the other one): the step along x is (0, 0, 0)"));
  f.srow = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_THAT(ReadWell("v.nii", Header(f) + Numbered()).info.notes[0], HasSubstr("has no valid quaternion"));
}

TEST_F(NiftiTest, APairIsReadByEitherNamePackedOrNot) {
  for (const int version : {1, 2}) {
    for (const bool big_endian : {false, true}) {
      for (const auto& [header, samples] :
           {std::pair{"v.hdr", "v.img"}, {"w.hdr.gz", "w.img.gz"}, {"x.hdr", "x.img.gz"}, {"Y.HDR", "Y.IMG"}}) {
        const FileBytes head = Header({.version = version, .big_endian = big_endian, .pair = true}), body = Numbered();
        const auto write = [&](const std::string& name, const FileBytes& bytes) {
          WriteFile(directory_ / name, name.ends_with("gz") ? Gzip(bytes) : bytes);
        };
        write(header, head);
        write(samples, body);
        for (const char* name : {header, samples}) {
          const Result<LoadedVolume> loaded = ReadVolume(directory_ / name);
          ASSERT_TRUE(loaded.ok()) << loaded.status().message();
          EXPECT_EQ(loaded->volume->description.geometry.size, kNiftiSize);
          EXPECT_EQ(loaded->volume->block.samples<std::uint8_t>()[100], 100);
        }
        EXPECT_THAT(CheckVolumeHeaders(directory_ / header).value(), ElementsAre(directory_ / header, directory_ / samples));
      }
    }
  }
  EXPECT_THAT(WhyNot("alone.hdr", Header({.pair = true})), HasSubstr("the samples are in an .img file beside"));
  EXPECT_THAT(WhyNot("v.nii", Header({.pair = true}) + Numbered()), HasSubstr("the samples are in an .img file beside"));
  WriteFile(directory_ / "other.hdr", "#?RADIANCE");
  EXPECT_FALSE(LooksLikeVolume(directory_ / "other.hdr"));
  // Raw samples, although there is a header.
  EXPECT_TRUE(ReadVolume(directory_ / "v.img", {.dims = kNiftiSize, .type = SampleType::kUint8}).ok());
}

TEST_F(NiftiTest, AnalyzeHasSpacingAndScaleFactorAlone) {
  FileBytes header = Header({.intent = 1002, .qform = 1, .sform = 1, .pixdim = {0, 1, 2, 3}, .slope = 0.5, .intercept = 7, .pair = true});
  header.replace(344, 4, std::string(4, '\0'));
  WriteFile(directory_ / "v.img", Numbered());
  const LoadedVolume loaded = ReadWell("v.hdr", header);
  EXPECT_EQ(loaded.volume->description.geometry.orientation.world, World::kVoxels);
  EXPECT_EQ(loaded.volume->description.geometry.spacing, (Vec3{1, 2, 3}));
  EXPECT_EQ(loaded.volume->description.mapping, (ValueMapping{0.5, 0}));
  EXPECT_FALSE(loaded.info.labels);
  EXPECT_THAT(loaded.info.notes, ElementsAre(HasSubstr("Analyze 7.5 states the spacing alone"), HasSubstr("scaled by 0.5")));
  EXPECT_THAT(WhyNot("v.nii", header + Numbered()), HasSubstr("not a NIfTI volume"));
}

TEST_F(NiftiTest, TheFifthDimensionCountsChannels) {
  const Fields f{.dim = {5, 5, 6, 7, 2, 3}};
  FileBytes samples;
  for (int volume = 0; volume < 6; ++volume) samples += FileBytes(CountIn(kNiftiSize), char(volume));
  for (const int time : {0, 1}) {
    for (const int channel : {0, 1, 2}) {
      const LoadedVolume loaded = ReadWell("v.nii.gz", Gzip(Header(f) + samples), {.time = TimeRange{time, time}, .channel = channel});
      EXPECT_EQ(loaded.volume->block.samples<std::uint8_t>()[0], 2 * channel + time);
      EXPECT_EQ(loaded.info.channels.size(), 3U);
      EXPECT_EQ(loaded.info.channel, channel);
      EXPECT_EQ(loaded.info.times.count, 2);
      EXPECT_EQ(loaded.info.time, time);
    }
  }
  EXPECT_THAT(WhyNot("v.nii", Header(f) + samples, {.time = TimeRange{}, .channel = 3}), HasSubstr("channel must be 0 to 2"));
  EXPECT_THAT(WhyNot("v.nii", Header({.dim = {6, 5, 6, 7, 1, 1, 2}}) + samples), HasSubstr("has 6 dimensions, must have 3 to 5"));
  EXPECT_THAT(WhyNot("v.nii", Header({.dim = {9, 5, 6, 7}}) + samples), HasSubstr("has 9 dimensions"));
  EXPECT_THAT(WhyNot("v.nii", Header({.dim = {5, 5, 6, 7, 1, 2}, .type = 128}) + samples + samples + samples),
              HasSubstr("2 channels of 3 components"));
  EXPECT_THAT(WhyNot("v.nii", Header({.type = 1792}) + samples), HasSubstr("NIfTI-1 data type 1792 (complex128) is not supported"));
  EXPECT_THAT(WhyNot("v.nii", Header({.slope = 2, .intercept = NAN}) + samples), HasSubstr("scl_inter is nan"));
}

TEST_F(NiftiTest, TimesHaveAStep) {
  const auto times = [&](int version, double step, int unit) {
    FileBytes header = Header({.version = version, .dim = {4, 5, 6, 7, 2}});
    if (version == 1) Put(header, 76 + 4 * 4, float(step), false);
    if (version == 2) Put(header, 104 + 8 * 4, step, false);
    header[version == 1 ? 123 : 500] = char(unit);
    return ReadWell("v.nii", header + Numbered() + Numbered(), {.time = TimeRange{}}).info.times;
  };
  constexpr int kMillimetres = 2, kSeconds = 8, kMilliseconds = 16, kMicroseconds = 24, kHertz = 32;
  for (const int version : {1, 2}) {
    EXPECT_EQ(times(version, 2.5, kMillimetres + kSeconds), (TimeAxis{2, 2.5, "s"}));
    EXPECT_EQ(times(version, 750, kMilliseconds), (TimeAxis{2, 750, "ms"}));
    EXPECT_EQ(times(version, 750, kMicroseconds), (TimeAxis{2, 750, "us"}));
    EXPECT_EQ(times(version, 2.5, kMillimetres), (TimeAxis{2, 2.5, ""}));
    EXPECT_EQ(times(version, 1, kMillimetres), (TimeAxis{2}));
    EXPECT_EQ(times(version, 2.5, kHertz), (TimeAxis{2}));
    for (const double step : {0.0, -2.0, double(NAN), double(INFINITY)}) EXPECT_EQ(times(version, step, kSeconds), (TimeAxis{2}));
  }
}

TEST_F(NiftiTest, MghIsPlacedByItsCentreInTheScannersSpace) {
  const std::array<float, 15> fields = {2, 3, 4, -1, 0, 0, 0, 0, -1, 0, 1, 0, 10, 20, 30};
  const FileBytes header = MghHeader(kNiftiSize, 0, fields);
  const Placement placement{{Vec3{-2, 0, 0}, Vec3{0, 0, -3}, Vec3{0, 4, 0}}, {10 + 5, 20 - 14, 30 + 9}};
  for (const auto& [name, bytes] : {std::pair{"v.mgh", header + Numbered()}, {"v.mgz", Gzip(header + Numbered() + "tags")}}) {
    const LoadedVolume loaded = ReadWell(name, bytes);
    ExpectPlaced(loaded, placement);
    EXPECT_THAT(loaded.info.notes, ElementsAre(HasSubstr("not in that of FreeSurfer's surfaces")));
  }
  const LoadedVolume usual = ReadWell("v.mgh", MghHeader(kNiftiSize, 0, fields, false) + Numbered());
  ExpectPlaced(usual, {{Vec3{-1, 0, 0}, Vec3{0, 0, -1}, Vec3{0, 1, 0}}, {2.5, -3.5, 3}});
  EXPECT_THAT(usual.info.notes, ElementsAre(HasSubstr("ras_good_flag is 0")));
  EXPECT_THAT(WhyNot("v.mgh", MghHeader(kNiftiSize, 5, fields) + Numbered()), HasSubstr("MGH type 5 is not supported"));
}

}  // namespace
}  // namespace slabstream
