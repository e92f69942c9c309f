// Visibility order against rays: none may enter a later box before an earlier one.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "common/decomposition/decomposition.h"
#include "tests/common/decomposition/random_partition.h"
#include "tests/common/view/view_limits.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

const VolumeGeometry kGeometry = {{24, 17, 31}, {1, 2, 0.5}};

// The part of the ray's half line t >= 0 that lies in the box, if it is longer than rounding.
struct Stretch {
  double begin, end;
};

std::optional<Stretch> Cross(const Camera::Ray& ray, const Box& box) {
  Stretch stretch = {0, std::numeric_limits<double>::infinity()};
  for (Axis axis : kAxes) {
    const double low = box.begin[axis] - 0.5, high = box.end[axis] - 0.5;
    if (ray.direction[axis] == 0) {
      if (ray.origin[axis] < low || ray.origin[axis] > high) return std::nullopt;
      continue;
    }
    const double a = (low - ray.origin[axis]) / ray.direction[axis], b = (high - ray.origin[axis]) / ray.direction[axis];
    stretch = {std::max(stretch.begin, std::min(a, b)), std::min(stretch.end, std::max(a, b))};
  }
  constexpr double kRounding = 1e-9;
  if (stretch.end - stretch.begin <= kRounding) return std::nullopt;
  return stretch;
}

void ExpectNoRayEntersALaterBoxFirst(const Partition& partition, const Camera& camera, Random& random, int rays) {
  const std::vector<BoxId> order = VisibilityOrder(partition, camera);
  std::vector<BoxId> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  ASSERT_EQ(sorted.size(), partition.boxes().size());
  for (std::size_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);

  for (int i = 0; i < rays; ++i) {
    // Through a random voxel, so that most rays meet the volume; any direction will do for an eye inside.
    const Index3 size = kGeometry.size;
    const Vec3 target = {random.Real(-0.5, size.x - 0.5), random.Real(-0.5, size.y - 0.5), random.Real(-0.5, size.z - 0.5)};
    Camera::Ray ray = {camera.eye, target - camera.eye};
    if (camera.projection == Projection::kOrthographic) {
      const auto at = camera.Project(target);
      ray = camera.RayAt(at.x, at.y);
    }
    double reached = 0;
    for (BoxId id : order) {
      const std::optional<Stretch> stretch = Cross(ray, partition.boxes()[id]);
      if (!stretch) continue;
      ASSERT_GE(stretch->begin, reached - 1e-6) << "box " << id;
      reached = stretch->end;
    }
  }
}

// Slabs on each axis and random kd-trees.
std::vector<Partition> SomePartitions(Random& random) {
  const WorkField voxels = WorkField::Uniform(kGeometry.size);
  std::vector<Partition> partitions;
  for (const DecompositionEntry& entry : Decompositions()) partitions.push_back(entry.make({.work = &voxels, .boxes = 11}));
  for (Axis axis : kAxes) partitions.push_back(MakeSlabs({.work = &voxels, .boxes = 7, .axis = axis}));
  for (int i = 0; i < 5; ++i) partitions.push_back(RandomPartition(random, kGeometry.bounds(), 25));
  return partitions;
}

TEST(VisibilityOrder, HoldsForAllOctantsAndAxes) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  for (const Partition& partition : SomePartitions(random)) {
    for (Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      for (double azimuth = 0; azimuth < 360; azimuth += 22.5) {
        for (double elevation : {-90.0, -45.0, -20.0, 0.0, 20.0, 45.0, 90.0}) {
          ViewParameters view;
          view.projection = projection;
          view.azimuth_degrees = azimuth;
          view.elevation_degrees = elevation;
          view.fov_degrees = kMaxFovDegrees;
          ExpectNoRayEntersALaterBoxFirst(partition, MakeCamera(view, {64, 64}, kGeometry), random, 20);
        }
      }
    }
  }
}

TEST(VisibilityOrder, HoldsForRandomViews) {
  Random random(83);
  SCOPED_TRACE(random.trace());
  for (const Partition& partition : SomePartitions(random)) {
    for (int i = 0; i < 100; ++i) {
      ViewParameters view;
      view.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
      // Every other one nearly along a plane.
      view.azimuth_degrees = i % 2 == 0 ? random.Real(0, 360) : 90 * random.Integer(0, 3) + random.Real(-2, 2);
      view.elevation_degrees = random.Real(-90, 90);
      ExpectNoRayEntersALaterBoxFirst(partition, MakeCamera(view, {64, 64}, kGeometry), random, 20);
    }
  }
}

TEST(VisibilityOrder, HoldsForEyesInsideTheVolumeAndOnPlanes) {
  Random random(82);
  SCOPED_TRACE(random.trace());
  ViewParameters view;
  view.projection = Projection::kPerspective;
  Camera camera = MakeCamera(view, {64, 64}, kGeometry);
  for (const Partition& partition : SomePartitions(random)) {
    for (int i = 0; i < 100; ++i) {
      camera.eye = {random.Real(-5, 30), random.Real(-5, 22), random.Real(-5, 36)};
      if (i % 2 == 1) camera.eye.z = random.Integer(0, 31) - 0.5;  // on a plane
      ExpectNoRayEntersALaterBoxFirst(partition, camera, random, 30);
    }
  }
}

TEST(VisibilityOrder, TurningRoundReversesTheOrderOfSlabs) {
  const WorkField voxels = WorkField::Uniform(kGeometry.size);
  const Partition slabs = MakeSlabs({.work = &voxels, .boxes = 6, .axis = Axis::kY});
  ViewParameters view;
  const std::vector<BoxId> there = VisibilityOrder(slabs, MakeCamera(view, {64, 64}, kGeometry));
  EXPECT_EQ(there, (std::vector<BoxId>{0, 1, 2, 3, 4, 5}));  // along +y
  view.azimuth_degrees = 180;
  const std::vector<BoxId> back = VisibilityOrder(slabs, MakeCamera(view, {64, 64}, kGeometry));
  EXPECT_EQ(back, (std::vector<BoxId>{5, 4, 3, 2, 1, 0}));
}

TEST(VisibilityOrder, LowerSideComesFirstWhereNoRayCrosses) {
  const WorkField voxels = WorkField::Uniform(kGeometry.size);
  const Partition slabs = MakeSlabs({.work = &voxels, .boxes = 4, .axis = Axis::kX});
  for (double azimuth : {0.0, 180.0, 360.0}) {  // rays parallel to the planes
    ViewParameters view;
    view.azimuth_degrees = azimuth;
    EXPECT_EQ(VisibilityOrder(slabs, MakeCamera(view, {64, 64}, kGeometry)), (std::vector<BoxId>{0, 1, 2, 3}));
  }
}

}  // namespace
}  // namespace slabstream
