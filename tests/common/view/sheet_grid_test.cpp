// The grid that splatting renders against the camera: pixel and ray belong together in every slice, and what a grid costs is bounded.
#include "common/view/sheet_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/view/view_limits.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

struct Scene {
  VolumeGeometry geometry;
  ImageSize size;
  ViewParameters view;
  Camera camera;
  SheetGrid grid;
};

// Cubes and slabs, voxels up to five times as long as wide, all zooms and fields of view.
Scene RandomScene(Random& random) {
  Scene scene;
  for (Axis axis : kAxes) {
    scene.geometry.size[axis] = random.Chance(0.1) ? 1 : int(std::exp(random.Real(0, 6.5)));
    scene.geometry.spacing[axis] = random.Chance(0.3) ? 1 : std::exp(random.Real(0, 1.6));
  }
  scene.size = {random.Integer(1, 700), random.Integer(1, 700)};
  scene.view.projection = random.Chance(0.3) ? Projection::kOrthographic : Projection::kPerspective;
  // Every fourth one along an axis or midway between two.
  const double step = random.Chance(0.25) ? 45 : 0;
  scene.view.azimuth_degrees = step > 0 ? step * random.Integer(0, 7) : random.Real(0, 360);
  scene.view.elevation_degrees = step > 0 ? step * random.Integer(-2, 2) : random.Real(-90, 90);
  scene.view.roll_degrees = random.Real(0, 360);
  scene.view.zoom = std::exp(random.Real(std::log(0.002), std::log(5000)));
  scene.view.fov_degrees = random.Real(kMinFovDegrees, kMaxFovDegrees);
  scene.camera = MakeCamera(scene.view, scene.size, scene.geometry);
  scene.grid = MakeSheetGrid(scene.camera, scene.geometry, random.Chance(0.5) ? 1 : random.Real(1, kMaxFootprint));
  return scene;
}

// How a scene may be made again.
std::string Describe(const Scene& scene) {
  const auto& [geometry, size, view, camera, grid] = scene;
  return ::testing::PrintToString(geometry.size.x) + " x " + std::to_string(geometry.size.y) + " x " + std::to_string(geometry.size.z) +
         " spacing " + std::to_string(geometry.spacing.x) + ' ' + std::to_string(geometry.spacing.y) + ' ' +
         std::to_string(geometry.spacing.z) + " picture " + std::to_string(size.width) + " x " + std::to_string(size.height) +
         (view.projection == Projection::kPerspective ? " perspective " : " orthographic ") + std::to_string(*view.azimuth_degrees) + ' ' +
         std::to_string(*view.elevation_degrees) + ' ' + std::to_string(view.roll_degrees) + " zoom " + std::to_string(view.zoom) +
         " fov " + std::to_string(view.fov_degrees) + " footprint " + std::to_string(grid.footprint) + " grid " +
         std::to_string(grid.width) + " x " + std::to_string(grid.height);
}

// Calls check(scene, random) for many scenes, until one fails.
template <class Check>
void ForRandomScenes(std::uint64_t seed, int count, Check&& check) {
  Random random(seed);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < count && !::testing::Test::HasFailure(); ++i) {
    const Scene scene = RandomScene(random);
    SCOPED_TRACE(Describe(scene));
    check(scene, random);
  }
}

Vec3 RandomPoint(const VolumeGeometry& geometry, Random& random) {
  Vec3 point;
  for (Axis axis : kAxes) point[axis] = random.Real(-0.5, geometry.size[axis] - 0.5);
  return point;
}

struct GridPoint {
  double x, y, w;
};
GridPoint FromPicture(const SheetGrid& grid, double x, double y) {
  const auto& m = grid.from_picture;
  const double w = m[6] * x + m[7] * y + m[8];
  return {(m[0] * x + m[1] * y + m[2]) / w, (m[3] * x + m[4] * y + m[5]) / w, w};
}

// The identity that ties picture and grid: a point of the volume projected into the picture and mapped to the grid lies where its slice has
// it.
TEST(SheetGrid, PictureAndSlicesAgreeOnEveryPoint) {
  ForRandomScenes(31, 2000, [&](const Scene& scene, Random& random) {
    const auto [c, u, v] = AxesOf(scene.camera.traversal_axis);
    for (int j = 0; j < 20; ++j) {
      const Vec3 point = RandomPoint(scene.geometry, random);
      const SlicePlacement slice = PlaceSlice(scene.grid, point[c]);
      const double column = slice.scale_u * point[u] + slice.offset_u, row = slice.scale_v * point[v] + slice.offset_v;
      const auto in_picture = scene.camera.Project(point);
      const GridPoint in_grid = FromPicture(scene.grid, in_picture.x, in_picture.y);
      ASSERT_GT(in_grid.w, 0);
      // Points of the picture are given to 1e-16 of their size, which grows with the zoom.
      const double tolerance = 1e-9 * (1 + std::hypot(in_picture.x, in_picture.y)) + 1e-9 * (std::abs(column) + std::abs(row));
      ASSERT_NEAR(in_grid.x, column, tolerance);
      ASSERT_NEAR(in_grid.y, row, tolerance);
    }
  });
}

// A pixel of the picture whose ray meets the volume finds the pixels of the grid that it is made of, within the grid.
TEST(SheetGrid, HoldsWhatThePictureSeesOfTheVolume) {
  int seen = 0;
  ForRandomScenes(32, 2000, [&](const Scene& scene, Random& random) {
    for (int j = 0; j < 20; ++j) {
      const Vec3 point = RandomPoint(scene.geometry, random);
      const auto in_picture = scene.camera.Project(point);
      if (in_picture.x < 0 || in_picture.x > scene.camera.width || in_picture.y < 0 || in_picture.y > scene.camera.height) continue;
      const GridPoint in_grid = FromPicture(scene.grid, in_picture.x, in_picture.y);
      ++seen;
      ASSERT_GE(in_grid.x, 0);
      ASSERT_LE(in_grid.x, scene.grid.width);
      ASSERT_GE(in_grid.y, 0);
      ASSERT_LE(in_grid.y, scene.grid.height);
    }
  });
  EXPECT_GT(seen, 5000);
}

TEST(SheetGrid, ResolutionIsThatOfThePictureWithinItsLimits) {
  ForRandomScenes(33, 1000, [&](const Scene& scene, Random&) {
    const auto [c, u, v] = AxesOf(scene.camera.traversal_axis);
    const Vec3 centre = 0.5 * (ToVec3(scene.geometry.size) - Vec3{1, 1, 1});
    const SlicePlacement slice = PlaceSlice(scene.grid, centre[c]);
    const auto expect_resolution = [&](Axis axis, double scale) {
      Vec3 low = centre, high = centre;
      low[axis] -= 0.001;
      high[axis] += 0.001;
      const auto a = scene.camera.Project(low), b = scene.camera.Project(high);
      const double pixels = std::hypot(b.x - a.x, b.y - a.y) / 0.002;
      EXPECT_NEAR(scale, std::clamp(pixels, kMinGridPixelsPerVoxel, kMaxGridPixelsPerVoxel), 1e-4);
    };
    expect_resolution(u, slice.scale_u);
    expect_resolution(v, slice.scale_v);
    EXPECT_EQ(scene.grid.width % kGridColumnStep, 0);
  });
}

// No view asks for more halo than workers keep: what a footprint reaches from a sample, which lies up to half a voxel outside of the box's
// outermost voxel centres, and a voxel for gradients.
TEST(SheetGrid, FootprintsOfAnyViewStayInTheHalo) {
  double widest = 0;
  ForRandomScenes(34, 20000, [&](const Scene& scene, Random&) {
    const Axis c = scene.camera.traversal_axis;
    for (double k : {0.0, scene.geometry.size[c] - 1.0}) {  // scales change monotonically
      const SlicePlacement slice = PlaceSlice(scene.grid, k);
      ASSERT_LE(std::max(slice.scale_u, slice.scale_v), kMaxSliceScale);
      const FootprintSigma sigma = FootprintIn(scene.grid, slice);
      widest = std::max(widest, kFootprintCut * std::max(sigma.u, sigma.v));
    }
  });
  EXPECT_LE(widest + 2, kHalo);
  RecordProperty("widest_footprint", std::to_string(widest));
}

// What a frame takes: a multiple of the picture (of a square round it, as it may be turned) or, where the view is minified, of the sheared
// volume at half a pixel a voxel. The worst cases are wide perspective views along a diagonal.
TEST(SheetGrid, SizeIsBoundedByThePictureOrTheVolume) {
  ForRandomScenes(35, 20000, [&](const Scene& scene, Random&) {
    const SheetGrid& grid = scene.grid;
    ASSERT_LE(grid.width, kMaxGridSide);
    ASSERT_LE(grid.height, kMaxGridSide);
    const auto [c, u, v] = AxesOf(scene.camera.traversal_axis);
    constexpr double kBorder = 20;  // pixels: footprints and filters reach beyond
    const double side = std::max(scene.size.width, scene.size.height) + kBorder;
    const auto sheared = [&, k = scene.geometry.size[c]](Axis axis, double shear) {
      return kMinGridPixelsPerVoxel * (scene.geometry.size[axis] + std::abs(shear) * k) + kBorder;
    };
    const double bound = 8 * std::max(side * side, sheared(u, grid.shear_u) * sheared(v, grid.shear_v));
    ASSERT_LE(double(grid.width) * grid.height, bound);
  });
}

}  // namespace
}  // namespace slabstream
