// The ray caster as a renderer: analytic truth, what may be hidden or left out, and padded boxes that are rendered in pieces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/planning/brick_visibility.h"
#include "common/renderers/renderer_kind.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/rays/ray_volume.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

TEST(Raycast, HomogeneousBlockLooksTheSameFromEverySide) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  constexpr double kOpacity = 0.06;
  for (const Projection projection : kProjections) {
    for (const Vec3 spacing : {Vec3{1, 1, 1}, Vec3{1, 1.5, 0.7}}) {
      for (const double rate : {1.0, 0.7, 3.0}) {
        const Volume block = MakeBlock({{26, 20, 24}, spacing});
        const double voxel_length = std::min({spacing.x, spacing.y, spacing.z});
        int pixels = 0;
        for (int i = 0; i < 6; ++i) {
          SetupOptions options;
          options.view = RandomView(projection, random);
          options.view.zoom = 1.5;
          options.transfer = Uniform(kOpacity, {1, 1, 1});
          const FrameSetup setup = RaycastSetup(block, options, rate, i % 3 * 0.5);
          const LocalImage image = RenderPicture(block, setup);
          for (int y = 0; y < setup.camera.height; ++y) {
            for (int x = 0; x < setup.camera.width; ++x) {
              const double length = LengthInside(setup, x, y) / voxel_length;
              if (length < 1.1 / rate) continue;  // shorter rays may pass between samples
              ++pixels;
              const double expected = 1 - std::pow(1 - kOpacity, length);
              ASSERT_NEAR(PixelOf(image, x, y)[3], expected, 0.01 * expected)
                  << "seed " << seed << " view " << i << " pixel " << x << ' ' << y << " rate " << rate;
            }
          }
        }
        EXPECT_GT(pixels, 1000);
      }
    }
  }
}

TEST(Raycast, PicturesConvergeAsTheSamplingRateRises) {
  std::mt19937 random(8);
  const Volume volume = MakeBlobs({{40, 36, 44}, {1, 1, 1}}, ScalarType::kFloat32, 8);
  for (const Projection projection : kProjections) {
    SetupOptions options;
    options.view = RandomView(projection, random);
    const auto picture = [&](double rate) { return RenderPicture(volume, RaycastSetup(volume, options, rate)); };
    const LocalImage fine = picture(16);
    EXPECT_LT(LargestDifference(picture(4), fine), LargestDifference(picture(0.5), fine));
  }
}

TEST(Raycast, HiddenTilesChangeNothingElse) {
  const unsigned seed = 30;
  std::mt19937 random(seed);
  const Volume volume = MakeBlobs({{50, 45, 40}, {1, 1, 1}}, ScalarType::kUint8, seed);
  for (const Projection projection : kProjections) {
    for (const double part : {0.3, 1.0}) {
      SetupOptions options;
      options.view = RandomView(projection, random);
      options.size = {90, 80};
      const FrameSetup setup = RaycastSetup(volume, options);
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " part " << part);
      ExpectHiddenTilesChangeNothingElse(volume, setup, part, random);
    }
  }
}

// Between a clear low value and a clear high one lies a visible value. Boxes that the planner leaves out do not show it.
TEST(Raycast, BoxesWithoutDrawnVoxelsShowNothing) {
  const unsigned seed = 9;
  std::mt19937 random(seed);
  const Volume volume = MakeVolume({{64, 64, 64}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) { return v.x + v.y < 64 ? 0 : 200; });
  SetupOptions options;
  options.view = RandomView(Projection::kPerspective, random);
  options.transfer = Ramp(0);
  options.transfer.opacities = {{50, 0, 0.5, 0}, {100, 0.5, 0.5, 0}, {150, 0, 0.5, 0}};
  const FrameSetup setup = RaycastSetup(volume, options);
  const VolumeSummary summary = Summarize(volume);
  const BrickVisibility bricks(summary, setup.renderer->DrawnTable(setup.transfer, summary));
  const Partition partition = CutIntoSlabs(volume, 16, Axis::kX);
  int left_out = 0;
  for (const Box& box : partition.boxes()) {
    if (bricks.AnyVisible(PaddedBox(box, setup))) continue;
    ++left_out;
    RankReport report;
    const auto data = CutBox(volume, PaddedBox(box, setup));
    (void)MakeRenderer(*setup.renderer)->Render(*data, box, setup, {}, RenderControl(), report).value();
    EXPECT_EQ(report.drawn_voxels, 0U);
  }
  RankReport report;
  const auto data = CutBox(volume, volume.block.box);
  (void)MakeRenderer(*setup.renderer)->Render(*data, volume.block.box, setup, {}, RenderControl(), report).value();
  EXPECT_GT(report.drawn_voxels, 0U);
  EXPECT_LT(left_out, 16);
}

TEST(RayVolume, LayersTileTheBoxAndKeepTheLimit) {
  const Box box = {{3, 4, 5}, {40, 30, 70}};
  for (const std::size_t most : {std::size_t{1}, std::size_t{20000}, std::size_t{100000}, std::size_t{1} << 40}) {
    const std::vector<Box> layers = CutIntoLayers(box, ScalarType::kUint16, most);
    std::int32_t z = box.begin.z;
    for (const Box& layer : layers) {
      EXPECT_EQ(layer.begin, (Index3{3, 4, z}));
      EXPECT_GT(layer.end.z, z);
      z = layer.end.z;
      EXPECT_EQ(layer.end, (Index3{40, 30, z}));
      const std::size_t bytes = std::size_t(37 + 2 * kPad) * (26 + 2 * kPad) * std::size_t(layer.size().z + 2 * kPad) * 2;
      EXPECT_TRUE(bytes <= most || layer.size().z == 1) << bytes;
    }
    EXPECT_EQ(z, box.end.z);
  }
  EXPECT_EQ(CutIntoLayers(box, ScalarType::kUint16, std::size_t{1} << 40).size(), 1U);
}

TEST(RayVolume, PiecesAreOrderedFromTheEye) {
  const VolumeGeometry geometry{{10, 10, 30}, {1, 1, 1}};
  std::vector<RayPiece> pieces(3);
  for (std::size_t i = 0; i < 3; ++i) pieces[i].voxels.box = {{0, 0, std::int32_t(10 * i)}, {10, 10, std::int32_t(10 * i + 10)}};
  const auto order = [&](Projection projection, double elevation) {
    return NearestFirst(pieces, MakeCamera({.projection = projection, .elevation_degrees = elevation}, {64, 64}, geometry));
  };
  for (const Projection projection : kProjections) {
    EXPECT_EQ(order(projection, 80), (std::vector<std::size_t>{2, 1, 0}));
    EXPECT_EQ(order(projection, -80), (std::vector<std::size_t>{0, 1, 2}));
  }
  EXPECT_EQ(order(Projection::kPerspective, 0)[0], 1U);
}

}  // namespace
}  // namespace slabstream
