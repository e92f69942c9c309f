// What one format has written and another one reads: between all that are written, geometry and data values stay.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "data/open/read_volume.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_writer.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr ScalarType kKeptTypes[] = {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32};

struct Target {
  const VolumeFormat* format;
  std::string file;
};

std::vector<Target> Targets() {
  std::vector<Target> targets;
  for (const VolumeFormat& format : FileFormats()) {
    for (const std::string_view ending : format.written_endings) targets.push_back({&format, "v" + std::string(ending)});
  }
  return targets;
}

std::vector<double> DataValuesOf(const Volume& volume) {
  std::vector<double> values;
  VisitScalarType(volume.description.type, [&]<class T>(const T*) {
    for (std::size_t i = 0; i < CountIn(volume.description.geometry.size); ++i) {
      values.push_back(volume.description.mapping.FromStored(double(volume.block.samples<T>()[i])));
    }
  });
  return values;
}

// Axes that are turned by up to `degrees`: volumes in memory have axes near those of the world.
std::array<Vec3, 3> TurnedAxes(Random& random, double degrees) {
  const Vec3 axis = Normalized({random.Real(-1, 1), random.Real(-1, 1), random.Real(0.1, 1)});
  const double angle = random.Real(0, degrees) * std::numbers::pi / 180;
  const auto turn = [&](const Vec3& v) {  // Rodrigues
    return std::cos(angle) * v + std::sin(angle) * Cross(axis, v) + (1 - std::cos(angle)) * Dot(axis, v) * axis;
  };
  return {turn({1, 0, 0}), turn({0, 1, 0}), turn({0, 0, 1})};
}

Volume RandomScan(Random& random) {
  const Index3 size = {random.Integer(1, 7), random.Integer(1, 7), random.Integer(1, 7)};
  Volume volume = RandomVolume(random, size, kKeptTypes[random.Integer<std::size_t>(0, 2)]);
  VolumeGeometry& geometry = volume.description.geometry;
  geometry.spacing = {random.Real(0.01, 5), random.Real(0.01, 5), random.Real(0.01, 5)};
  const World world = World(random.Integer(1, 3));
  if (world != World::kVoxels) {
    geometry.orientation = {world,
                            {random.Real(-500, 500), random.Real(-500, 500), random.Real(-500, 500)},
                            random.Chance(0.3) ? Orientation{}.axes : TurnedAxes(random, 25)};
  }
  const ValueMapping mappings[] = {{}, {1, -1024}, {1, -32768}, {2, 7}, {-1, 0}, {0.5, 3.25}};
  volume.description.mapping = mappings[random.Integer<std::size_t>(0, 5)];
  return volume;
}

// Reads what was written of `before`, and checks what the format keeps.
std::shared_ptr<const Volume> ThroughFile(const Volume& before, const Target& target, const std::string& path) {
  const Status status = WriteVolume(before, path);
  EXPECT_TRUE(status.ok()) << status.message();
  const Result<LoadedVolume> loaded = ReadVolume(path, {}, true);
  if (!loaded.ok()) {
    ADD_FAILURE() << loaded.status().message();
    return nullptr;
  }
  const VolumeGeometry &was = before.description.geometry, &is = loaded->volume->description.geometry;
  const KeptGeometry& keeps = target.format->keeps;
  EXPECT_EQ(loaded->info.format, target.format->name);
  EXPECT_FALSE(loaded->info.stored->slanted);
  EXPECT_EQ(is.size, was.size);
  if (keeps.spacing) ExpectNear(is.spacing, was.spacing, 1e-6 * Length(was.spacing));
  if (keeps.axes) {
    ExpectNear(is.orientation.origin, was.orientation.origin, 1e-3);  // NIfTI has floats
    for (std::size_t i = 0; i < 3; ++i) ExpectNear(is.orientation.axes[i], was.orientation.axes[i], 1e-5);
  }
  const World world = was.orientation.world;
  if (WhatIsLost(*target.format, was).empty() && world != World::kVoxels) {
    EXPECT_EQ(is.orientation.world, world);
  }
  const std::vector<double> expected = DataValuesOf(before), found = DataValuesOf(*loaded->volume);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(float(found[i]), float(expected[i]));
  return loaded->volume;
}

TEST(Convert, KeepsVoxelsAndGeometryBetweenAllFormatsThatAreWritten) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  ASSERT_GE(Targets().size(), 7U);
  for (const Target& from : Targets()) {
    for (const Target& to : Targets()) {
      for (int round = 0; round < 8; ++round) {
        SCOPED_TRACE(from.file + " to " + to.file);
        const TemporaryDirectory first, second;
        const auto read = ThroughFile(RandomScan(random), from, first / from.file);
        ASSERT_NE(read, nullptr);
        ASSERT_NE(ThroughFile(*read, to, second / to.file), nullptr);
        ASSERT_FALSE(testing::Test::HasFailure());
      }
    }
  }
}

TEST(Convert, SaysWhatAFormatDoesNotKeep) {
  VolumeGeometry patient{{2, 2, 2}, {0.5, 1, 2}, {World::kPatient, {1, 2, 3}, Orientation{}.axes}}, scene = patient, voxels{{2, 2, 2}};
  scene.orientation.world = World::kScene;
  const auto lost = [](const char* file, const VolumeGeometry& geometry) { return WhatIsLost(*FindWritableFormat(file), geometry); };
  for (const char* file : {"v.nrrd", "v.mha", "v.mhd"}) {
    for (const VolumeGeometry* geometry : {&patient, &scene, &voxels}) EXPECT_EQ(lost(file, *geometry), "");
  }
  EXPECT_EQ(lost("v.npy", voxels), "");
  EXPECT_EQ(lost("v.npy", patient), "the spacing 0.5,1,2, nor the origin and the directions of the axes");
  EXPECT_EQ(lost("v.nii.gz", patient), "");
  EXPECT_EQ(lost("v.nii", scene), "that the axes are not a patient's");
  EXPECT_EQ(lost("v.vti", scene), "");
  EXPECT_EQ(lost("v.vti", patient), "that the axes are a patient's: right, anterior, superior");
}

// The samples of one volume never lie beside the header of another.
TEST(Convert, AHeaderThatCannotTakeItsPlaceLeavesNone) {
  const TemporaryDirectory directory;
  const Volume small = MakeTestVolume({2, 2, 2}, ScalarType::kUint8, [](const Index3&) { return 1; }),
               large = MakeTestVolume({4, 4, 4}, ScalarType::kUint8, [](const Index3&) { return 2; });
  ASSERT_TRUE(WriteVolume(small, directory / "v.mhd").ok());
  ASSERT_TRUE(WriteVolume(large, directory / "v.mhd").ok());
  EXPECT_EQ(ReadVolume(directory / "v.mhd")->volume->description.geometry.size, (Index3{4, 4, 4}));
  // A folder in place of the samples is as good as a program that ends between the two files.
  std::filesystem::remove(directory / "v.raw");
  std::filesystem::create_directories(directory / "v.raw/in the way");
  EXPECT_FALSE(WriteVolume(small, directory / "v.mhd").ok());
  EXPECT_FALSE(std::filesystem::exists(directory / "v.mhd"));
}

TEST(Convert, KeepsTheUnitWhereAFileCanStateIt) {
  const TemporaryDirectory directory;
  Volume volume = MakeTestVolume({2, 2, 2}, ScalarType::kUint8, [](const Index3&) { return 1; });
  VolumeGeometry& geometry = volume.description.geometry;
  geometry.spacing = {0.5, 1, 2};
  const auto unit_after = [&](const std::string& file) {
    EXPECT_TRUE(WriteVolume(volume, directory / file).ok());
    return ReadVolume(directory / file)->volume->description.geometry.orientation.unit;
  };
  for (const World world : {World::kVoxels, World::kScene}) {
    geometry.orientation.world = world;
    for (int unit = int(LengthUnit::kMillimetre); unit <= int(LengthUnit::kMetre); ++unit) {
      geometry.orientation.unit = LengthUnit(unit);
      for (const char* file : {"v.nrrd", "v.mha", "v.mhd"}) {
        EXPECT_EQ(unit_after(file), LengthUnit(unit)) << file;
        EXPECT_EQ(WhatIsLost(*FindWritableFormat(file), geometry), "");
      }
    }
  }
  // NIfTI is read in mm, and has no name for others.
  geometry.orientation = {.unit = LengthUnit::kMicrometre};
  EXPECT_EQ(unit_after("v.nii"), LengthUnit::kMillimetre);
  ExpectNear(ReadVolume(directory / "v.nii")->volume->description.geometry.spacing, {0.0005, 0.001, 0.002}, 1e-9);
  geometry.orientation.unit = LengthUnit::kAngstrom;
  for (const char* file : {"v.nii", "v.vti"}) {
    EXPECT_EQ(WhatIsLost(*FindWritableFormat(file), geometry), "the unit \u00c5");
    EXPECT_EQ(unit_after(file), std::nullopt) << file;
  }
}

TEST(Convert, ToATypeHoldsEveryValueOrNamesTheOneThatDoesNotFit) {
  const TemporaryDirectory directory;
  Volume volume = MakeTestVolume({4, 3, 2}, ScalarType::kUint16, [](const Index3& v) { return v == Index3{2, 1, 1} ? 3071 : v.x; });
  const auto write = [&](SampleType type) { return WriteVolume(volume, directory / "v.nrrd", {type, {}}); };
  const Status small = write(SampleType::kUint8);
  EXPECT_EQ(small.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(small.message(), HasSubstr("the value 3071 of voxel 2,1,1 does not fit uint8, which holds whole numbers from 0 to 255"));
  EXPECT_FALSE(std::filesystem::exists(directory / "v.nrrd"));
  for (const SampleType type : {SampleType::kInt16, SampleType::kUint16, SampleType::kInt32, SampleType::kUint32, SampleType::kInt64,
                                SampleType::kUint64, SampleType::kFloat32, SampleType::kFloat64}) {
    for (const Target& target : Targets()) {
      ASSERT_TRUE(WriteVolume(volume, directory / target.file, {type, {}}).ok());
      const Result<LoadedVolume> loaded = ReadVolume(directory / target.file);
      ASSERT_TRUE(loaded.ok()) << loaded.status().message();
      EXPECT_EQ(loaded->info.file_type, ToString(type)) << target.file;
      EXPECT_EQ(DataValuesOf(*loaded->volume), DataValuesOf(volume));
    }
  }
  volume.description.mapping = {1, -1024};
  EXPECT_THAT(write(SampleType::kUint16).message(), HasSubstr("the value -1024 of voxel 0,0,0 does not fit uint16"));
  volume.description.mapping = {0.5, 0};
  EXPECT_THAT(write(SampleType::kInt32).message(), HasSubstr("the value 0.5 of voxel 1,0,0 does not fit int32"));
  volume = MakeTestVolume({2, 1, 1}, ScalarType::kFloat32, [](const Index3& v) { return v.x == 0 ? 1.0 : std::nan(""); });
  EXPECT_THAT(write(SampleType::kInt16).message(), HasSubstr("the value nan of voxel 1,0,0 does not fit int16"));
  EXPECT_TRUE(write(SampleType::kFloat64).ok());
}

TEST(Convert, TakesTheSmallestTypeThatHoldsMappedIntegers) {
  const TemporaryDirectory directory;
  const auto type_of = [&](ScalarType type, const ValueMapping& mapping, double low, double high) {
    Volume volume = MakeTestVolume({2, 1, 1}, type, [&](const Index3& v) { return v.x == 0 ? low : high; });
    volume.description.mapping = mapping;
    EXPECT_TRUE(WriteVolume(volume, directory / "v.nrrd").ok());
    return ReadVolume(directory / "v.nrrd")->info.file_type;
  };
  EXPECT_EQ(type_of(ScalarType::kUint8, {}, 0, 5), "uint8");
  EXPECT_EQ(type_of(ScalarType::kUint16, {}, 0, 5), "uint16");
  EXPECT_EQ(type_of(ScalarType::kUint16, {1, -32768}, 0, 65535), "int16");
  EXPECT_EQ(type_of(ScalarType::kUint16, {1, -1024}, 0, 4095), "int16");
  EXPECT_EQ(type_of(ScalarType::kUint16, {1, -1024}, 0, 65535), "int32");
  EXPECT_EQ(type_of(ScalarType::kUint8, {-1, 0}, 0, 100), "int8");
  EXPECT_EQ(type_of(ScalarType::kUint8, {1000, 0}, 0, 255), "uint32");
  EXPECT_EQ(type_of(ScalarType::kUint8, {0.5, 0}, 0, 255), "float32");
}

TEST(Convert, TellsHowMuchIsWritten) {
  const TemporaryDirectory directory;
  const Volume volume = MakeTestVolume({200, 100, 100}, ScalarType::kUint16, [](const Index3& v) { return v.x; });
  for (const Target& target : Targets()) {
    std::vector<std::int64_t> told;
    const WriteProgress progress = [&](std::int64_t done, std::int64_t all) {
      EXPECT_EQ(all, 4000000);
      told.push_back(done);
    };
    ASSERT_TRUE(WriteVolume(volume, directory / target.file, {std::nullopt, progress}).ok());
    EXPECT_GE(told.size(), 4U);
    EXPECT_TRUE(std::ranges::is_sorted(told));
    EXPECT_EQ(told.back(), 4000000);
  }
}

TEST(Convert, NiftiHoldsNoMoreThanItsHeaderCanSay) {
  const TemporaryDirectory directory;
  const Volume volume = MakeTestVolume({40000, 1, 1}, ScalarType::kUint8, [](const Index3&) { return 1; });
  EXPECT_THAT(WriteVolume(volume, directory / "v.nii").message(),
              HasSubstr("NIfTI-1 holds at most 32767 voxels, but there are 40000 along x"));
  Volume huge = MakeTestVolume({1, 1, 1}, ScalarType::kUint8, [](const Index3&) { return 1; });
  huge.description.geometry.spacing.y = 1e300;
  EXPECT_THAT(WriteVolume(huge, directory / "v.nii").message(), HasSubstr("do not hold the spacing 1e+300"));
}

}  // namespace
}  // namespace slabstream
