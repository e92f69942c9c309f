#include "coordinator/probe/plane_shape.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace slabstream {
namespace {

// A volume whose value is linear in the world, which trilinear samples keep.
struct LinearVolume {
  VolumeDescription description;
  VoxelBlock block;
  Vec3 slope;
  double offset = 0;

  double ValueAt(const Vec3& world) const { return Dot(slope, world) + offset; }
};

LinearVolume RandomVolume(Random& random) {
  LinearVolume volume;
  VolumeGeometry& geometry = volume.description.geometry;
  geometry.size = {random.Integer(2, 60), random.Integer(2, 60), random.Integer(2, 60)};
  geometry.spacing = {random.Real(0.3, 2), random.Real(0.3, 2), random.Real(0.3, 2)};
  const double angle = random.Real(0, 3), c = std::cos(angle), s = std::sin(angle);
  geometry.orientation = {.origin = {random.Real(-1000, 1000), 5, -7}, .axes = {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}};
  volume.description.type = ScalarType::kFloat32;
  volume.description.mapping = {.scale = random.Real(0.1, 3), .offset = random.Real(-9, 9)};
  volume.slope = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)};
  volume.offset = -Dot(volume.slope, geometry.orientation.origin);
  volume.block = MakeVoxelBlock(geometry.bounds(), ScalarType::kFloat32);
  for (std::size_t i = 0; i < CountIn(geometry.size); ++i) {
    const double value = volume.ValueAt(geometry.ToWorld(ToVec3(PlaceIn(geometry.size, i))));
    volume.block.samples<float>()[i] = float((value - volume.description.mapping.offset) / volume.description.mapping.scale);
  }
  return volume;
}

Vec3 PositionOf(const Shape& shape, std::size_t i) {
  return {double(shape.positions[i][0]), double(shape.positions[i][1]), double(shape.positions[i][2])};
}

double SampleOf(const PlaneValues& plane, const Vec3& p) {
  const double column = std::clamp(Apply(plane.column, p), 0.0, plane.columns - 1.0);
  const double row = std::clamp(Apply(plane.row, p), 0.0, plane.rows - 1.0);
  const std::uint32_t c = std::min(std::uint32_t(column), plane.columns - 2), r = std::min(std::uint32_t(row), plane.rows - 2);
  const auto at = [&](std::uint32_t x, std::uint32_t y) { return double(plane.samples[std::size_t{y} * plane.columns + x]); };
  const double s = column - c, t = row - r;
  return (1 - t) * ((1 - s) * at(c, r) + s * at(c + 1, r)) + t * ((1 - s) * at(c, r + 1) + s * at(c + 1, r + 1));
}

TEST(PlaneShape, ShowsALinearVolumeAsItIs) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const LinearVolume volume = RandomVolume(random);
    const VolumeGeometry& geometry = volume.description.geometry;
    const Vec3 inside = random.Real(0.2, 0.8) * ToVec3(geometry.size - Uniform(1));
    ClipSlab slab{.normal = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)}, .through = geometry.ToWorld(inside)};
    if (i % 3 == 0) slab.normal = geometry.orientation.axes[std::size_t(i / 3 % 3)];
    std::atomic<int> most = 0;
    const auto read = [&](const Box& box) -> Result<VoxelBlock> {
      EXPECT_TRUE(geometry.bounds().Contains(box));
      most = std::max(most.load(), int(box.voxel_count()));
      return CutBlock(volume.block, box);
    };
    const Shape shape = PlaneShape(slab, volume.description, read).value();
    ASSERT_GE(shape.positions.size(), 3U);
    EXPECT_EQ(shape.triangles.size(), shape.positions.size() - 2);
    EXPECT_LT(most, 70 * 70 * 70) << "boxes of voxels are small";
    const Vec3 low = {-0.5, -0.5, -0.5}, high = ToVec3(geometry.size) + low;
    for (std::size_t v = 0; v < shape.positions.size(); ++v) {
      const Vec3 world = shape.origin + PositionOf(shape, v);
      EXPECT_NEAR(Dot(world - *slab.through, Normalized(slab.normal)), 0, 1e-4);
      const Vec3 p = geometry.orientation.FromWorld(world - geometry.orientation.origin) / geometry.spacing;
      for (const Axis axis : kAxes) {
        EXPECT_GE(p[axis], low[axis] - 1e-4);
        EXPECT_LE(p[axis], high[axis] + 1e-4);
      }
    }
    for (int k = 0; k < 20; ++k) {  // points of the polygon, among the centres of voxels
      double weights = 0;
      Vec3 p;
      for (std::size_t v = 0; v < shape.positions.size(); ++v) {
        const double weight = random.Real(0, 1);
        p = p + weight * PositionOf(shape, v);
        weights += weight;
      }
      p = (1 / weights) * p;
      const Vec3 voxel = geometry.orientation.FromWorld(shape.origin + p - geometry.orientation.origin) / geometry.spacing;
      const auto within = [&](Axis axis) { return voxel[axis] >= 1 && voxel[axis] <= geometry.size[axis] - 2; };
      if (!std::ranges::all_of(kAxes, within)) continue;
      EXPECT_NEAR(SampleOf(shape.plane, p), volume.ValueAt(shape.origin + p), 2e-3) << i;
    }
  }
}

TEST(PlaneShape, ASliceHasASampleForEachVoxel) {
  VolumeDescription description{.geometry = {{5, 4, 3}}};
  VoxelBlock block = MakeVoxelBlock(description.geometry.bounds(), ScalarType::kUint8);
  for (std::size_t i = 0; i < 60; ++i) block.samples<std::uint8_t>()[i] = std::uint8_t(i);
  const auto read = [&](const Box& box) { return Result<VoxelBlock>(CutBlock(block, box)); };
  const Shape shape = PlaneShape({.index = 2}, description, read).value();
  ASSERT_EQ(shape.plane.columns, 5U);
  ASSERT_EQ(shape.plane.rows, 4U);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(shape.plane.samples[i], float(40 + i));
  EXPECT_EQ(shape.positions.size(), 4U);
}

TEST(PlaneShape, OneBesideTheVolumeIsEmptyAndTellsWhyItCannotBeRead) {
  const VolumeDescription description{.geometry = {{5, 4, 3}}};
  const auto fail = [](const Box&) { return Result<VoxelBlock>(Status::Unavailable("the disk is gone")); };
  const Result<Shape> beside = PlaneShape({.through = Vec3{0, 0, 9}}, description, fail);
  ASSERT_TRUE(beside.ok());
  EXPECT_TRUE(beside->positions.empty());
  EXPECT_EQ(PlaneShape({}, description, fail).status().message(), "the disk is gone");
}

TEST(PlaneShape, HasNoSampleBesideAValueThatIsNotFinite) {
  VolumeDescription description{.geometry = {{8, 8, 8}}, .type = ScalarType::kFloat32};
  VoxelBlock block = MakeVoxelBlock(description.geometry.bounds(), ScalarType::kFloat32);
  block.samples<float>()[block.Offset({3, 3, 4})] = std::numeric_limits<float>::quiet_NaN();
  block.samples<float>()[block.Offset({5, 5, 4})] = std::numeric_limits<float>::infinity();
  const auto read = [&](const Box& box) { return Result<VoxelBlock>(CutBlock(block, box)); };
  const Shape shape = PlaneShape({.index = 4}, description, read).value();
  for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(std::isnan(shape.plane.samples[i]), i == 3 * 8 + 3 || i == 5 * 8 + 5) << i;
}

}  // namespace
}  // namespace slabstream
