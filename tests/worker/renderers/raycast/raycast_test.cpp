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
  for (const Projection projection : kProjections) {
    for (const Vec3 spacing : {Vec3{1, 1, 1}, Vec3{1, 1.5, 0.7}}) {
      for (const double rate : {1.0, 0.7, 3.0}) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed << " rate " << rate);
        const Volume block = MakeBlock({{26, 20, 24}, spacing});
        const auto setup = [&](const SetupOptions& options, int view) { return RaycastSetup(block, options, rate, view % 3 * 0.5); };
        // Rays shorter than 1.1 / rate may pass between samples.
        ExpectOpacityOfLength(block, RandomViews(projection, 6, random), {.setup = setup, .least_length = 1.1 / rate});
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
