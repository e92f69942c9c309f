// The splatting pipeline against its definition and against analytic truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/parallel/task_arena.h"
#include "tests/support/renderers.h"
#include "tests/support/same_image.h"
#include "tests/worker/renderers/render_support.h"
#include "tests/worker/renderers/splat/reference_splatting.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Tables of footprints, opacities and normal codes are what the pipeline has and the definition has not.
constexpr float kTableError = 0.012F;

// Frame and picture.
void ExpectIsItsDefinition(const Volume& volume, const FrameSetup& setup) {
  const LocalImage frame = RenderWhole(volume, setup), expected = ReferenceSplatting(volume, setup);
  EXPECT_FALSE(frame.bounds.empty());
  EXPECT_TRUE(FrameBounds(setup).Contains(frame.bounds));
  EXPECT_LT(LargestDifference(frame, expected), kTableError);
  EXPECT_LT(LargestDifference(FinishPicture(frame, setup), ReferencePicture(expected, setup)), kTableError);
}

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
        if (type == ScalarType::kUint16) options.shading.model = ShadingModel::kNone;
        options.shading.lights = {{1, 2, 3}, {-1, 0, 0.5}};
        ExpectIsItsDefinition(volume, MakeSetup(volume, options));
      }
    }
  }
}

// From both projections and for each of the values; setup_at(volume, options, value).
template <class SetupAt>
void ExpectIsItsDefinitionAtEach(unsigned seed, const Index3& size, std::initializer_list<double> values, SetupAt&& setup_at) {
  std::mt19937 random(seed);
  const Volume volume = MakeBlobs({size, {1, 1, 1.5}}, ScalarType::kUint8, seed);
  for (Projection projection : kProjections) {
    for (const double value : values) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " at " << value);
      SetupOptions options;
      options.view = RandomView(projection, random);
      ExpectIsItsDefinition(volume, setup_at(volume, options, value));
    }
  }
}

// Footprints as wide as the grid's pixels at one end, at the finest grid at the other.
TEST(Splatting, IsItsDefinitionAtEveryZoom) {
  const auto setup = [](const Volume& volume, SetupOptions options, double zoom) {
    options.view.zoom = zoom;
    return MakeSetup(volume, options);
  };
  ExpectIsItsDefinitionAtEach(20, {19, 26, 23}, {0.1, 0.25, 0.6, 2.0, 8.0, 40.0}, setup);
}

TEST(Splatting, IsItsDefinitionAtEveryWidthOfFootprints) {
  ExpectIsItsDefinitionAtEach(40, {26, 19, 23}, {1.0, 1.3, 2.0, kMaxFootprint}, SplatSetup);
}

// A bright voxel in a clear volume: footprints twice as wide spread the same opacity over a larger area.
TEST(Splatting, WiderFootprintsSpreadTheSameOpacity) {
  const Volume volume = MakeVolume({{31, 31, 31}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) {
    return v == Index3{15, 15, 15} ? 200.0 : 0.0;
  });
  SetupOptions options;
  options.transfer = Ramp(0.3);
  options.size = {96, 96};
  const auto alpha = [&](double footprint) {
    const FrameSetup setup = SplatSetup(volume, options, footprint);
    const LocalImage image = RenderPicture(volume, setup);
    double sum = 0, most = 0;
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        sum += PixelOf(image, x, y)[3];
        most = std::max<double>(most, PixelOf(image, x, y)[3]);
      }
    }
    return std::pair{sum, most};
  };
  const auto [sum, most] = alpha(1);
  const auto [wide_sum, wide_most] = alpha(2);
  EXPECT_NEAR(wide_sum, sum, 0.02 * sum);
  EXPECT_GT(most / wide_most, 2.5) << "4, but for what resampling spreads of the narrow one";
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
  const auto length = [](const FrameSetup& setup, int x, int y) { return LengthInside(setup, x, y, 4); };
  for (Projection projection : kProjections) {
    for (Vec3 spacing : {Vec3{1, 1, 1}, Vec3{1, 1.5, 0.7}}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed);
      const Volume block = MakeBlock({{26, 20, 24}, spacing});
      const auto setup = [&](const SetupOptions& options, int) { return MakeSetup(block, options); };
      ExpectOpacityOfLength(block, RandomViews(projection, 12, random), {.setup = setup, .length = length});
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
      const LocalImage image = RenderPicture(block, setup);
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
    const FrameSetup unlimited = MakeSetup(volume, options);
    const LocalImage exact = RenderWhole(volume, unlimited);
    for (double threshold : {1.0 / 1024, 0.05, 0.5}) {
      options.termination = threshold;
      const FrameSetup setup = MakeSetup(volume, options);
      const LocalImage frame = RenderWhole(volume, setup);
      EXPECT_LE(LargestDifference(frame, exact), threshold + 1e-6);
      EXPECT_LE(LargestDifference(FinishPicture(frame, setup), FinishPicture(exact, unlimited)), threshold + 1e-6);
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
  const auto data = CutBox(block, block.block.box);
  RankReport report;
  ASSERT_TRUE(MakeRenderer(*Splatting())->Render(*data, block.block.box, setup, {}, RenderControl(), report).ok());
  EXPECT_EQ(report.occupied_voxels, 48U * 48 * 48);
  EXPECT_LT(report.drawn_voxels, report.occupied_voxels / 2);
}

// Pixels outside of hidden tiles are the same bits; what is hidden wholly costs nothing.
TEST(Splatting, HiddenTilesChangeNothingElse) {
  const unsigned seed = 30;
  std::mt19937 random(seed);
  const Volume volume = MakeBlobs({{50, 45, 40}, {1, 1, 1}}, ScalarType::kUint8, seed);
  for (Projection projection : kProjections) {
    for (double part : {0.1, 0.6, 1.0}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " hidden " << part);
      SetupOptions options;
      options.view = RandomView(projection, random);
      options.size = {90, 80};
      const FrameSetup setup = MakeSetup(volume, options);
      ExpectHiddenTilesChangeNothingElse(volume, setup, part, random);
    }
  }
}

TEST(Splatting, IsTheSameBitsForAnyNumberOfThreads) {
  const unsigned seed = 31;
  std::mt19937 random(seed);
  const Volume volume = MakeBlobs({{60, 70, 50}, {1, 1, 1.2}}, ScalarType::kUint8, seed);
  for (Projection projection : kProjections) {
    SetupOptions options;
    options.view = RandomView(projection, random);
    options.size = {200, 180};  // several bands of rows
    options.termination = 1.0 / 1024;
    const FrameSetup setup = MakeSetup(volume, options);
    LocalImage frame, picture;
    for (int threads : {1, 2, 3, 4}) {
      TaskArena arena(threads);
      LocalImage other_frame, other_picture;
      arena.Run([&] {
        other_frame = RenderWhole(volume, setup);
        other_picture = FinishPicture(other_frame, setup);
      });
      if (threads == 1) {
        frame = other_frame, picture = other_picture;
        continue;
      }
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " threads " << threads);
      ExpectSameBits(other_frame, frame);
      ExpectSameBits(other_picture, picture);
    }
  }
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
        SCOPED_TRACE(::testing::Message() << size.x << ' ' << size.y << ' ' << size.z << " azimuth " << azimuth);
        ExpectIsItsDefinition(volume, MakeSetup(volume, options));
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
    setup.sheets = MakeSheetGrid(setup.camera, block.description.geometry);
    EXPECT_NEAR(PixelOf(RenderPicture(block, setup), 12, 12)[3], 1 - std::pow(0.8, 3), 0.05);
  }
}

TEST(Splatting, SamplesThatAreNotFiniteAreEmpty) {
  const VolumeGeometry geometry = {{12, 12, 12}, {1, 1, 1}};
  const auto plain = [](const Index3& v) { return v.x == 5 ? 0.0 : 100.0; };
  const Volume holed = MakeVolume(geometry, ScalarType::kFloat32, [&](const Index3& v) { return v.x == 5 ? std::nan("") : plain(v); });
  const Volume empty = MakeVolume(geometry, ScalarType::kFloat32, plain);
  SetupOptions options;
  options.transfer = Uniform(0.5, {1, 1, 1});
  options.shading.model = ShadingModel::kNone;
  const FrameSetup setup = MakeSetup(empty, options);
  EXPECT_EQ(LargestDifference(RenderWhole(holed, setup), RenderWhole(empty, setup)), 0);
}

}  // namespace
}  // namespace slabstream
