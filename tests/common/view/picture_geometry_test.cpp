// Whoever has a picture and its geometry finds the world behind it: compared with the camera that made it.
#include "common/view/picture_geometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/view/named_view.h"
#include "tests/common/view/random_view.h"
#include "tests/support/expect_near.h"

namespace slabstream {
namespace {

constexpr ImageSize kSize{320, 200};

// As the header says.
Vec3 PointAt(const PictureGeometry& g, ImageSize size, double x, double y, double depth) {
  const double k = g.projection == Projection::kPerspective ? depth / g.target_depth : 1;
  return g.target + (depth - g.target_depth) * g.forward +
         k * g.pixel_size * ((x - 0.5 * size.width) * g.right - (y - 0.5 * size.height) * g.up);
}

TEST(PictureGeometryTest, FindsThePointThatTheCameraHasProjected) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 500; ++i) {
    const VolumeGeometry volume = RandomGeometry(random);
    const ViewParameters view = RandomViewOf(volume, random);
    const bool supersampled = random.Chance(0.5);
    const Camera camera = MakeCamera(view, kSize, volume, supersampled);
    const PictureGeometry geometry = GeometryOf(camera, volume);
    const Vec3 voxel = {random.Real(0, volume.size.x), random.Real(0, volume.size.y), random.Real(0, volume.size.z)};
    const auto [x, y, depth] = camera.Project(voxel);
    const Vec3 world = volume.orientation.origin + volume.orientation.ToWorld(volume.spacing * voxel);
    const double length = Length(ToVec3(volume.size) * volume.spacing) + geometry.target_depth;
    ExpectNear(PointAt(geometry, kSize, x / camera.supersample, y / camera.supersample, depth), world, 1e-9 * length);
  }
}

TEST(PictureGeometryTest, TheCentreShowsTheTarget) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const VolumeGeometry volume = RandomGeometry(random);
    ViewParameters view = RandomViewOf(volume, random);
    const Vec3 centre =
        volume.orientation.origin + volume.orientation.ToWorld(volume.spacing * (0.5 * (ToVec3(volume.size) - Vec3{1, 1, 1})));
    const double length = Length(ToVec3(volume.size) * volume.spacing);
    ExpectNear(GeometryOf(MakeCamera(view, kSize, volume), volume).target, view.look_at.value_or(centre), 1e-8 * length);
  }
}

TEST(PictureGeometryTest, APixelOfTheWholeVolumeIsItsDiagonalOverTheShorterSide) {
  const VolumeGeometry volume = {{30, 40, 120}, {1, 1, 1}};
  for (const bool supersampled : {false, true}) {
    const PictureGeometry geometry = GeometryOf(MakeCamera({}, {26, 13}, volume, supersampled), volume);
    EXPECT_NEAR(geometry.pixel_size, 130 / 13.0, 1e-12);
    EXPECT_EQ(geometry.projection, Projection::kOrthographic);
  }
  ViewParameters perspective;
  perspective.projection = Projection::kPerspective;
  perspective.distance = 200;
  perspective.fov_degrees = 53.13010235415598;  // the half of it has the tangent 1/2
  const PictureGeometry geometry = GeometryOf(MakeCamera(perspective, {100, 100}, volume), volume);
  EXPECT_NEAR(geometry.pixel_size, 2 * 0.5 * 200 / 100, 1e-9);
  EXPECT_NEAR(geometry.target_depth, 200, 1e-9);
}

TEST(PictureGeometryTest, UnitsFollowFromWhatTheFileStates) {
  const auto unit = [](World world, const Vec3& spacing) {
    const VolumeGeometry volume = {{8, 8, 8}, spacing, {.world = world}};
    return GeometryOf(MakeCamera({}, kSize, volume), volume).unit;
  };
  EXPECT_EQ(unit(World::kPatient, {1, 1, 1}), LengthUnit::kMillimetre);
  EXPECT_EQ(unit(World::kScene, {1, 1, 1}), LengthUnit::kFile);
  EXPECT_EQ(unit(World::kVoxels, {1, 1, 2}), LengthUnit::kFile);
  EXPECT_EQ(unit(World::kVoxels, {1, 1, 1}), LengthUnit::kVoxel);
  for (const World world : {World::kVoxels, World::kScene, World::kPatient}) {
    const VolumeGeometry stated = {{8, 8, 8}, {1, 1, 1}, {.world = world, .unit = LengthUnit::kMicrometre}};
    EXPECT_EQ(GeometryOf(MakeCamera({}, kSize, stated), stated).unit, LengthUnit::kMicrometre);
  }
}

}  // namespace
}  // namespace slabstream
