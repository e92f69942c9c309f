// The splatting pipeline against its definition and against analytic truth.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/render/reference_splatting.h"
#include "tests/render/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr Projection kProjections[] = {Projection::kOrthographic, Projection::kPerspective};

// Tables of footprint phases and normal codes are what the pipeline has and the definition has not.
constexpr float kTableError = 0.012F;

TEST(Splatting, IsItsDefinition) {
  unsigned seed = 1;
  for (Projection projection : kProjections) {
    for (ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
      for (Vec3 spacing : {Vec3{1, 1, 1}, Vec3{0.5, 1.25, 2}}) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed << " spacing " << spacing.z);
        std::mt19937 random(seed);
        const Volume volume = MakeBlobs({{37, 23, 18}, spacing}, type, seed++);
        SetupOptions options;
        options.view = RandomView(projection, random);
        options.transfer = Ramp(0.3);
        options.shading.phong = type != ScalarType::kUint16;
        options.shading.lights = {{1, 2, 3}, {-1, 0, 0.5}};
        const FrameSetup setup = MakeSetup(volume, options);
        const LocalImage image = RenderWhole(volume, setup);
        EXPECT_LT(LargestDifference(image, ReferenceSplatting(volume, setup), setup.camera), kTableError);
        EXPECT_FALSE(image.bounds.empty());
      }
    }
  }
}

// Length of the ray through the middle of a pixel within the volume, in physical units; 0: it misses or passes within `margin` voxels of an
// edge.
double LengthInside(const FrameSetup& setup, int x, int y, double margin) {
  const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
  const Index3& size = setup.description.geometry.size;
  const Axis c = setup.camera.traversal_axis;
  double enter = 0, exit = 1e30;
  for (Axis axis : kAxes) {
    // Rays must come in and go out through the two faces across the traversal, far from the others.
    const double inset = axis == c ? 0 : margin;
    const double low = (-0.5 + inset - ray.origin[axis]) / ray.direction[axis];
    const double high = (size[axis] - 0.5 - inset - ray.origin[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(low, high));
    exit = std::min(exit, std::max(low, high));
  }
  const double low = (-0.5 - ray.origin[c]) / ray.direction[c], high = (size[c] - 0.5 - ray.origin[c]) / ray.direction[c];
  if (exit < enter || enter > std::min(low, high) || exit < std::max(low, high)) return 0;
  return (exit - enter) * Length(setup.camera.spacing * ray.direction);
}

TEST(Splatting, HomogeneousBlockLooksTheSameFromEverySide) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  constexpr double kOpacity = 0.06;
  for (Projection projection : kProjections) {
    for (Vec3 spacing : {Vec3{1, 1, 1}, Vec3{1, 1.5, 0.7}}) {
      const Volume block = MakeBlock({{26, 20, 24}, spacing});
      int pixels = 0;
      for (int i = 0; i < 12; ++i) {
        SetupOptions options;
        options.view = RandomView(projection, random);
        options.view.zoom = 1.5;
        options.transfer = Uniform(kOpacity, {1, 1, 1});
        const FrameSetup setup = MakeSetup(block, options);
        const LocalImage image = RenderWhole(block, setup);
        const double voxel_length = std::min({spacing.x, spacing.y, spacing.z});
        for (int y = 0; y < setup.camera.height; ++y) {
          for (int x = 0; x < setup.camera.width; ++x) {
            const double length = LengthInside(setup, x, y, 4);
            if (length == 0) continue;
            ++pixels;
            const double expected = 1 - std::pow(1 - kOpacity, length / voxel_length);
            ASSERT_NEAR(PixelOf(image, x, y)[3], expected, 0.01 * expected)
                << "seed " << seed << " view " << i << " pixel " << x << ' ' << y;
          }
        }
      }
      EXPECT_GT(pixels, 1000);
    }
  }
}

// A filled block at any zoom: no pixel inside is fainter than those around it.
TEST(Splatting, HasNoHolesAtAnyZoom) {
  for (Projection projection : kProjections) {
    for (double zoom : {0.1, 0.3, 1.0, 6.0, 40.0}) {
      const Volume block = MakeBlock({{24, 24, 24}, {1, 1, 1}});
      SetupOptions options;
      options.view.projection = projection;
      options.view.azimuth_degrees = 20;
      options.view.elevation_degrees = 30;
      options.view.zoom = zoom;
      options.transfer = Uniform(0.1, {1, 1, 1});
      const FrameSetup setup = MakeSetup(block, options);
      const LocalImage image = RenderWhole(block, setup);
      for (int y = 1; y + 1 < setup.camera.height; ++y) {
        for (int x = 1; x + 1 < setup.camera.width; ++x) {
          if (LengthInside(setup, x, y, 5) == 0) continue;
          const float around =
              (PixelOf(image, x - 1, y)[3] + PixelOf(image, x + 1, y)[3] + PixelOf(image, x, y - 1)[3] + PixelOf(image, x, y + 1)[3]) / 4;
          ASSERT_NEAR(PixelOf(image, x, y)[3], around, 0.005) << "zoom " << zoom << " pixel " << x << ' ' << y;
        }
      }
    }
  }
}

TEST(Splatting, TerminationChangesNothingAboveItsThreshold) {
  const Volume volume = MakeBlobs({{40, 40, 40}, {1, 1, 1}}, ScalarType::kUint8, 3);
  for (Projection projection : kProjections) {
    SetupOptions options;
    options.view.projection = projection;
    options.view.azimuth_degrees = 70;
    options.transfer = Ramp(0.9);
    const LocalImage exact = RenderWhole(volume, MakeSetup(volume, options));
    for (double threshold : {1.0 / 1024, 0.05, 0.5}) {
      options.termination = threshold;
      const FrameSetup setup = MakeSetup(volume, options);
      EXPECT_LE(LargestDifference(RenderWhole(volume, setup), exact, setup.camera), threshold + 1e-6);
    }
  }
}

TEST(Splatting, TerminationSkipsVoxelsBehindAnOpaqueFront) {
  const Volume block = MakeBlock({{48, 48, 48}, {1, 1, 1}});
  SetupOptions options;
  options.transfer = Uniform(0.9, {1, 1, 1});
  options.view.zoom = 1.5;
  options.size = {256, 256};
  options.termination = 1.0 / 1024;
  const FrameSetup setup = MakeSetup(block, options);
  const auto slab = CutSlab(block, block.block.box);
  RankReport report;
  ASSERT_TRUE(MakeRenderer(RendererKind::kSplat)->Render(*slab, block.block.box, setup, std::atomic<bool>(false), report).ok());
  EXPECT_EQ(report.occupied_voxels, 48U * 48 * 48);
  EXPECT_LT(report.drawn_voxels, report.occupied_voxels / 2);
}

TEST(Splatting, DrawsThinAndTinyVolumes) {
  for (Index3 size : {Index3{1, 1, 1}, Index3{30, 20, 1}, Index3{1, 30, 20}, Index3{30, 1, 20}, Index3{40, 1, 1}}) {
    for (Projection projection : kProjections) {
      for (double azimuth : {0.0, 33.0, 90.0}) {
        const Volume volume = MakeBlock({size, {1, 1, 1}});
        SetupOptions options;
        options.view.projection = projection;
        options.view.azimuth_degrees = azimuth;
        options.view.elevation_degrees = 25;
        options.transfer = Uniform(0.5, {1, 0.5F, 0.25F});
        const FrameSetup setup = MakeSetup(volume, options);
        const LocalImage image = RenderWhole(volume, setup);
        EXPECT_FALSE(image.bounds.empty());
        EXPECT_LT(LargestDifference(image, ReferenceSplatting(volume, setup), setup.camera), kTableError)
            << size.x << ' ' << size.y << ' ' << size.z;
      }
    }
  }
}

// One voxel covers a million pictures: neither tables nor coordinates may grow with the zoom.
TEST(Splatting, DrawsAtTheLargestZoom) {
  for (Projection projection : kProjections) {
    const Volume block = MakeBlock({{3, 3, 3}, {1, 1, 1}});
    SetupOptions options;
    options.view.projection = projection;
    options.view.zoom = kMaxZoom;
    options.size = {24, 24};
    options.transfer = Uniform(0.2, {1, 1, 1});
    FrameSetup setup = MakeSetup(block, options);
    // As on the largest picture, of which the frame is a part.
    for (auto* row : {&setup.camera.x_row, &setup.camera.y_row}) {
      for (std::size_t i = 0; i < 4; ++i) (*row)[i] = 600 * ((*row)[i] - 12 * setup.camera.w_row[i]) + 12 * setup.camera.w_row[i];
    }
    const LocalImage image = RenderWhole(block, setup);
    EXPECT_NEAR(PixelOf(image, 12, 12)[3], 1 - std::pow(0.8, 3), 0.05);
  }
}

TEST(Splatting, SamplesThatAreNotFiniteAreEmpty) {
  const VolumeGeometry geometry = {{12, 12, 12}, {1, 1, 1}};
  const auto plain = [](const Index3& v) { return v.x == 5 ? 0.0 : 100.0; };
  const Volume holed = MakeVolume(geometry, ScalarType::kFloat32, [&](const Index3& v) { return v.x == 5 ? std::nan("") : plain(v); });
  const Volume empty = MakeVolume(geometry, ScalarType::kFloat32, plain);
  SetupOptions options;
  options.transfer = Uniform(0.5, {1, 1, 1});
  options.shading.phong = false;
  FrameSetup setup = MakeSetup(empty, options);
  EXPECT_EQ(LargestDifference(RenderWhole(holed, setup), RenderWhole(empty, setup), setup.camera), 0);
}

}  // namespace
}  // namespace slabstream
