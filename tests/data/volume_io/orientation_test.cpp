// Where voxels lie: the same object stored in any order is the same volume, slanted slices are straightened, and broken matrices are
// errors.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>

#include "data/open/read_volume.h"
#include "data/volume_io/volume_writer.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
FileBytes MetaFile(const Stored& stored) {
  constexpr Vec3 kLps = {-1, -1, 1};
  const auto axis = [&](std::size_t i) { return Text(kLps * Normalized(stored.steps[i]), " "); };
  return fmt::format(
             "ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix = {} {} {}\nOffset = {}\nAnatomicalOrientation = RAI\n"
             "ElementSpacing = {} {} {}\nDimSize = {} {} {}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n",
             axis(0), axis(1), axis(2), Text(kLps * stored.origin, " "), Length(stored.steps[0]), Length(stored.steps[1]),
             Length(stored.steps[2]), stored.size.x, stored.size.y, stored.size.z) +
         stored.samples;
}

FileBytes NiftiFile(const Stored& stored) {
  FileSpec spec{.size = stored.size, .sform = 1};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t i = 0; i < 3; ++i) spec.matrix[4 * row + i] = float(stored.steps[i][int(row)]);
    spec.matrix[4 * row + 3] = float(stored.origin[int(row)]);
  }
  return NiftiHeader(spec) + stored.samples;
}

LoadedVolume ReadBytes(const TemporaryDirectory& directory, const std::string& name, const FileBytes& bytes) {
  WriteFile(directory / name, bytes);
  Result<LoadedVolume> loaded = ReadVolume(directory / name);
  CHECK(loaded.ok()) << loaded.status().message();
  return *std::move(loaded);
}

Steps Rotated(Random& random, double most_degrees, const Steps& steps) {
  const Vec3 axis = Normalized({random.Real(-1, 1), random.Real(-1, 1), random.Real(0.1, 1)});
  const double angle = random.Real(0, most_degrees) * std::numbers::pi / 180;
  const auto turn = [&](const Vec3& v) {  // Rodrigues
    return std::cos(angle) * v + std::sin(angle) * Cross(axis, v) + (1 - std::cos(angle)) * Dot(axis, v) * axis;
  };
  return {turn(steps[0]), turn(steps[1]), turn(steps[2])};
}

TEST(Orientation, OfAnyOfThe48StoragesIsTheSameInEveryFormat) {
  Random random(21);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const double oblique : {0.0, 25.0}) {
    Object object;
    object.steps = Rotated(random, oblique, object.steps);
    const std::vector<std::pair<std::string, std::function<FileBytes(const Stored&)>>> formats = {
        {"ras.nrrd",
         [](const Stored& stored) {
           return NrrdFile(stored, "right-anterior-superior", {1, 1, 1});
         }},
        {"lps.nrrd",
         [](const Stored& stored) {
           return NrrdFile(stored, "LPS", {-1, -1, 1});
         }},
        {"las.nrrd",
         [](const Stored& stored) {
           return NrrdFile(stored, "left-anterior-superior-time", {-1, 1, 1});
         }},
        {"v.mha", MetaFile},
        {"v.nii", NiftiFile},
    };
    for (const auto& [name, file] : formats) {
      const LoadedVolume first = ReadBytes(directory, name, file(StoredAs(object, AllStorages().front())));
      const VolumeGeometry& geometry = first.volume->description.geometry;
      EXPECT_EQ(geometry.size, object.size);
      EXPECT_EQ(geometry.orientation.world, World::kPatient);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(geometry.spacing[int(i)], Length(object.steps[i]), 1e-6);
        ExpectNear(geometry.orientation.axes[i], Normalized(object.steps[i]), 1e-6);
      }
      for (const Storage& storage : AllStorages()) {
        SCOPED_TRACE(name + ": " + Text(storage));
        const LoadedVolume loaded = ReadBytes(directory, name, file(StoredAs(object, storage)));
        const VolumeGeometry& found = loaded.volume->description.geometry;
        EXPECT_EQ(found.size, geometry.size);
        EXPECT_EQ(found.spacing, geometry.spacing);
        EXPECT_EQ(found.orientation.axes, geometry.orientation.axes);
        ExpectNear(found.orientation.origin, object.origin, 1e-5);
        EXPECT_TRUE(std::ranges::equal(loaded.volume->block.bytes, first.volume->block.bytes));
        EXPECT_EQ(loaded.volume->block.box, found.bounds());
        EXPECT_FALSE(loaded.info.stored->slanted);
      }
      const std::uint8_t* sample = first.volume->block.samples<std::uint8_t>();
      for (std::size_t i = 0; i < CountIn(object.size); ++i) EXPECT_EQ(sample[i], i);
    }
  }
}

TEST(Orientation, OfAQuaternionIsThatOfItsMatrix) {
  const TemporaryDirectory directory;
  const Stored stored = StoredAs({}, AllStorages().front());
  // A half turn about z, and a left-handed z axis: x to the left, y to posterior, z to inferior.
  FileSpec spec{.size = stored.size, .spacing = {0.5, 1.25, 3}, .qform = 1, .quaternion = {0, 0, 1, 10, 20, 30}, .qfac = -1};
  const VolumeGeometry geometry = ReadBytes(directory, "v.nii", NiftiHeader(spec) + stored.samples).volume->description.geometry;
  EXPECT_EQ(geometry.spacing, (Vec3{0.5, 1.25, 3}));
  EXPECT_EQ(geometry.orientation.axes, Orientation{}.axes);
  ExpectNear(geometry.orientation.origin, {10 - 1.5, 20 - 2.5, 30 - 3}, 1e-6);
}

TEST(Orientation, WithoutAPatientStaysThatOfTheFile) {
  const TemporaryDirectory directory;
  const Stored stored = StoredAs({}, AllStorages().front());
  const auto world = [&](const std::string& name, const FileBytes& bytes) {
    return ReadBytes(directory, name, bytes).volume->description.geometry.orientation.world;
  };
  EXPECT_EQ(world("v.nrrd", NrrdFile(stored, "3D-right-handed", {1, 1, 1})), World::kScene);
  EXPECT_EQ(world("v.nrrd", NrrdHeader({.size = stored.size}, "raw") + stored.samples), World::kVoxels);
  EXPECT_EQ(world("v.mha", MetaHeader({.size = stored.size}, "LOCAL") + stored.samples), World::kVoxels);
  EXPECT_EQ(world("v.nii", NiftiHeader({.size = stored.size}) + stored.samples), World::kVoxels);
  // As VTK writes it.
  FileBytes meta = MetaFile(stored);
  meta.replace(meta.find("RAI"), 3, "???");
  EXPECT_EQ(world("v.mha", meta), World::kScene);
}

TEST(Orientation, OfALeftHandedSpaceIsNoMirrorImage) {
  const TemporaryDirectory directory;
  Object object;
  const LoadedVolume loaded =
      ReadBytes(directory, "v.nrrd", NrrdFile(StoredAs(object, AllStorages().front()), "3D-left-handed", {1, 1, 1}));
  // x of the file runs to the left of a right-handed space.
  EXPECT_EQ(loaded.volume->block.samples<std::uint8_t>()[0], object.size.x - 1);
  EXPECT_EQ(loaded.volume->description.geometry.orientation.axes, Orientation{}.axes);
}

// A linear function of the world, sampled on slices that are slanted like those of a tilted gantry: straightened, it is the same function.
TEST(Orientation, OfSlantedSlicesIsStraightened) {
  Random random(22);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (int round = 0; round < 20; ++round) {
    Object object{.size = {14, 13, 12}};
    const double tilt = random.Real(-25, 25) * std::numbers::pi / 180;
    object.steps = {Vec3{0.5, 0, 0}, Vec3{round % 2 == 0 ? 0 : 0.1, 0.75, 0}, Vec3{0, 3 * std::sin(tilt), 3 * std::cos(tilt)}};
    object.steps = Rotated(random, 10, object.steps);
    const Vec3 slope = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)};
    const auto value = [&](const Vec3& world) { return 1000 + Dot(slope, world); };
    const Storage storage = AllStorages()[random.Integer<std::size_t>(0, 47)];
    const Stored stored = StoredAs(object, storage);
    std::vector<double> values;
    for (int z = 0; z < stored.size.z; ++z) {
      for (int y = 0; y < stored.size.y; ++y) {
        for (int x = 0; x < stored.size.x; ++x) {
          values.push_back(value(stored.origin + double(x) * stored.steps[0] + double(y) * stored.steps[1] + double(z) * stored.steps[2]));
        }
      }
    }
    Stored with_values = stored;
    with_values.samples = EncodeSamples(SampleType::kFloat32, values);
    FileBytes file = NrrdFile(with_values, "right-anterior-superior", {1, 1, 1});
    file.replace(file.find("uint8"), 5, "float");
    const LoadedVolume loaded = ReadBytes(directory, "v.nrrd", file);
    EXPECT_TRUE(loaded.info.stored->slanted);
    const VolumeGeometry& geometry = loaded.volume->description.geometry;
    const double outside = *std::ranges::min_element(values);
    int inside = 0;
    for (int z = 0; z < geometry.size.z; ++z) {
      for (int y = 0; y < geometry.size.y; ++y) {
        for (int x = 0; x < geometry.size.x; ++x) {
          const Vec3 world =
              geometry.orientation.origin + geometry.orientation.ToWorld(geometry.spacing * Vec3{double(x), double(y), double(z)});
          const float found = loaded.volume->block.samples<float>()[NumberIn(geometry.size, {x, y, z})];
          // In the object's voxels, by Cramer's rule.
          const Vec3 from = world - object.origin;
          const auto& [a, b, c] = object.steps;
          const double all = Dot(Cross(a, b), c);
          const Vec3 voxel = {Dot(Cross(from, b), c) / all, Dot(Cross(a, from), c) / all, Dot(Cross(a, b), from) / all};
          bool within = true, beyond = false;
          for (int i = 0; i < 3; ++i) {
            within = within && voxel[i] > -1e-6 && voxel[i] < object.size[i] - 1 + 1e-6;
            beyond = beyond || voxel[i] < -1 - 1e-6 || voxel[i] > object.size[i] + 1e-6;
          }
          if (within) {
            EXPECT_NEAR(found, value(world), 1e-2) << Text(voxel);
          }
          if (beyond) {
            EXPECT_EQ(found, float(outside)) << Text(voxel);
          }
          inside += within ? 1 : 0;
        }
      }
    }
    EXPECT_GT(inside, 14 * 13 * 12 * 8 / 10);
  }
}

TEST(Orientation, ThatIsBrokenIsAnErrorThatNamesTheMatrix) {
  const TemporaryDirectory directory;
  const auto message = [&](const std::string& name, const FileBytes& bytes) {
    WriteFile(directory / name, bytes);
    const Result<LoadedVolume> loaded = ReadVolume(directory / name);
    EXPECT_FALSE(loaded.ok());
    EXPECT_EQ(loaded.status().code(), StatusCode::kInvalidArgument);
    return loaded.status().message();
  };
  const Stored good = StoredAs({}, AllStorages().front());
  Stored zero = good, plane = good, nan = good, far = good;
  zero.steps[1] = {0, 0, 0};
  plane.steps[2] = plane.steps[0] + plane.steps[1];
  nan.steps[2].z = std::nan("");
  far.origin.y = HUGE_VAL;
  constexpr Vec3 kRas = {1, 1, 1};
  EXPECT_THAT(message("v.nrrd", NrrdFile(zero, "RAS", kRas)), HasSubstr("v.nrrd: space directions: the step along y is (0, 0, 0)"));
  EXPECT_THAT(message("v.nrrd", NrrdFile(nan, "RAS", kRas)), HasSubstr("space directions: the step along z is (0, 0, nan)"));
  EXPECT_THAT(message("v.nrrd", NrrdFile(plane, "RAS", kRas)), HasSubstr("lie in a plane, so the matrix has no inverse"));
  EXPECT_THAT(message("v.nrrd", NrrdFile(far, "RAS", kRas)), HasSubstr("the origin is (-20, inf, 7)"));
  EXPECT_THAT(message("v.nii", NiftiFile(zero)), HasSubstr("v.nii: sform: the step along y is (0, 0, 0)"));
  EXPECT_THAT(message("v.nii", NiftiHeader({.size = good.size, .qform = 1, .quaternion = {0, 0, std::nanf(""), 0, 0, 0}}) + good.samples),
              HasSubstr("v.nii: qform: the step along x is"));
  EXPECT_THAT(message("v.mha", MetaFile(plane)), HasSubstr("v.mha: TransformMatrix: the steps"));
}

TEST(Orientation, IsWrittenAndReadBack) {
  Random random(23);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const World world : {World::kVoxels, World::kScene, World::kPatient}) {
    Volume volume = RandomVolume(random, {5, 4, 3}, ScalarType::kUint8);
    VolumeGeometry& geometry = volume.description.geometry;
    geometry.spacing = {0.25, 1.5, 2};
    for (const auto& [file, oblique] : {std::pair{"v.nrrd", true}, {"v.mha", true}, {"v.mhd", true}, {"v.nrrd", false}, {"v.mha", false}}) {
      SCOPED_TRACE(fmt::format("{} {} {}", file, int(world), oblique));
      if (world != World::kVoxels) {
        geometry.orientation = {world, {1.5, -2, 300}, Rotated(random, oblique ? 20 : 0, Orientation{}.axes)};
      }
      ASSERT_TRUE(WriteVolume(volume, directory / file).ok());
      const Result<LoadedVolume> loaded = ReadVolume(directory / file);
      ASSERT_TRUE(loaded.ok()) << loaded.status().message();
      const VolumeGeometry& found = loaded->volume->description.geometry;
      EXPECT_EQ(found.orientation.world, world);
      ExpectNear(found.spacing, geometry.spacing, 1e-12);
      ExpectNear(found.orientation.origin, geometry.orientation.origin, 1e-9);
      for (std::size_t i = 0; i < 3; ++i) ExpectNear(found.orientation.axes[i], geometry.orientation.axes[i], 1e-12);
      EXPECT_TRUE(std::ranges::equal(loaded->volume->block.bytes, volume.block.bytes));
    }
  }
}

}  // namespace
}  // namespace slabstream
