// Intensity projections as a renderer: what a pixel shows, in every mode, and that no partition changes a bit of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/renderers/mip/projection_mode.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support
using mip::ProjectionMode;

constexpr ProjectionMode kModes[] = {ProjectionMode::kMaximum, ProjectionMode::kMinimum, ProjectionMode::kMean};

FrameSetup ProjectionSetup(const Volume& volume, SetupOptions options, ProjectionMode mode, double samples_per_voxel = 1) {
  options.renderer = FindRenderer("mip");
  FrameSetup setup = MakeSetup(volume, options);
  SetParameters({samples_per_voxel, double(mode), 0}, setup);
  return setup;
}

// Opacity is the value by 200, colour is white.
TransferFunction Gray() {
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0, 0.5, 0}, {200, 1, 0.5, 0}};
  return transfer;
}

TEST(Mip, AllPartitionsMakeTheSameBits) {
  const unsigned seed = 3;
  std::mt19937 random(seed);
  for (const ProjectionMode mode : kModes) {
    for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
        const Volume volume = MakeBlobs({{44, 38, 41}, {1, 0.8, 1.2}}, type, seed);
        SetupOptions options;
        options.view = RandomView(projection, random);
        const FrameSetup setup = ProjectionSetup(volume, options, mode);
        const LocalImage one = RenderPicture(volume, setup);
        const LocalImage many = FinishPicture(RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, 7, random)), setup);
        EXPECT_EQ(LargestDifference(one, many), 0) << "seed " << seed << " mode " << int(mode) << " type " << int(type);
      }
    }
  }
}

// A ray along y through a row of known values: the centre of the picture looks along +y.
TEST(Mip, ShowsTheExtremeOrTheMeanOfItsRay) {
  const Volume volume = MakeVolume({{16, 16, 16}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) {
    return v.y == 5 ? 180 : v.y == 11 ? 20 : v.y == 0 ? 0 : v.y == 15 ? 200 : 100;
  });
  SetupOptions options;
  options.transfer = Gray();
  const auto alpha = [&](ProjectionMode mode) {
    return PixelOf(RenderPicture(volume, ProjectionSetup(volume, options, mode, 16)), 32, 32)[3];
  };
  EXPECT_NEAR(alpha(ProjectionMode::kMaximum), 1, 0.02);
  EXPECT_NEAR(alpha(ProjectionMode::kMinimum), 0, 0.02);
  EXPECT_NEAR(alpha(ProjectionMode::kMean), 0.5, 0.02);
  EXPECT_EQ(PixelOf(RenderPicture(volume, ProjectionSetup(volume, options, ProjectionMode::kMinimum)), 1, 1)[3], 0);
}

// A voxel without a value leaves a hole of its own size, and what lies beside it stays.
TEST(Mip, AMissingVoxelIsAHoleOfOneVoxel) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Volume volume = MakeVolume({{16, 16, 16}, {1, 1, 1}}, ScalarType::kFloat32, [&](const Index3& v) {
    return v == Index3{8, 8, 8} || v.y < 4 || v.y > 9 ? nan : 200.0F;
  });
  for (const double interpolation : {0.0, 1.0}) {
    for (const ProjectionMode mode : kModes) {
      for (const int slice : {3, 4, 7, 8, 9, 10}) {
        SetupOptions options;
        options.renderer = FindRenderer("mip");
        options.transfer = Gray();
        options.size = {128, 128};
        options.clipping.slab = ClipSlab{.normal = {0, 1, 0}, .index = slice};
        FrameSetup setup = MakeSetup(volume, options);
        SetParameters({1, double(mode), interpolation}, setup);
        const LocalImage picture = RenderPicture(volume, setup);
        double area = 0;  // of the picture's pixels that show a value
        for (int y = 0; y < 128; ++y) {
          for (int x = 0; x < 128; ++x) area += PixelOf(picture, x, y)[3] > 0 ? 1 : 0;
        }
        const double pixel = setup.camera.PixelSizeAt(1), whole = 16 * 16;
        const double expected = slice < 4 || slice > 9 ? 0 : slice == 8 ? whole - 1 : whole;
        EXPECT_NEAR(area * pixel * pixel, expected, slice == 8 ? 0.6 : 6) << slice << ' ' << interpolation << ' ' << int(mode);
      }
    }
  }
}

// Where data values fall as stored samples rise, the largest value is that of the least sample.
TEST(Mip, ProjectsDataValues) {
  Volume rising = MakeBlobs({{30, 30, 30}, {1, 1, 1}}, ScalarType::kUint8, 4), falling = rising;
  falling.description.mapping = {.scale = -1, .offset = 200};
  for (std::byte& sample : falling.block.bytes) sample = std::byte(200 - int(sample));
  SetupOptions options;
  options.transfer = Gray();
  for (const ProjectionMode mode : kModes) {
    const LocalImage a = RenderPicture(rising, ProjectionSetup(rising, options, mode));
    const LocalImage b = RenderPicture(falling, ProjectionSetup(falling, options, mode));
    EXPECT_LE(LargestDifference(a, b), 2e-4F) << "mode " << int(mode);
  }
}

}  // namespace
}  // namespace slabstream
