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

TEST(Raycast, SmoothingChangesNoNormalOfALinearField) {
  std::mt19937 random(31);
  for (const ScalarType type : kTypes) {
    const Volume volume = MakeVolume({{30, 26, 34}, {1, 0.8, 1.3}}, type, [](const Index3& v) { return 20 + 2 * v.x + 3 * v.y + v.z; });
    for (const Projection projection : kProjections) {
      SetupOptions options;
      options.view = RandomView(projection, random);
      options.transfer = Ramp(0.3);
      options.transfer.isosurfaces = {{90, {0.9F, 0.4F, 0.2F}, 0.5}};
      const auto picture = [&](bool smooth) { return RenderPicture(volume, RaycastSetup(volume, options, 1, 0, smooth)); };
      EXPECT_LE(LargestDifference(picture(true), picture(false)), 1e-5F) << NameOf(type);
    }
  }
}

// The sphere's values are rounded, so that plain differences have an error of up to a sixth. Light falls along the view.
TEST(Raycast, SmoothedNormalsOfARoundedSphereAreNearerToTheTrueOnes) {
  const double radius = 40;
  const Vec3 centre = {49.6, 50.1, 49.3};
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
    const Volume volume = MakeVolume({{100, 100, 100}, {1, 1, 1}}, type, [&](const Index3& v) {
      return std::clamp(128 + std::round(3 * (radius - Length(ToVec3(v) - centre))), 0.0, 255.0);
    });
    SetupOptions options;
    options.view = {.azimuth_degrees = 33, .elevation_degrees = 21};
    options.size = {300, 300};
    options.shading.ambient = options.shading.specular = 0;
    options.shading.diffuse = 1;
    options.transfer = Ramp(0);
    options.transfer.isosurfaces = {{128, {1, 1, 1}, 1}};
    const auto error = [&](bool smooth) {
      const FrameSetup setup = RaycastSetup(volume, options, 1, 0, smooth);
      const LocalImage image = RenderPicture(volume, setup);
      double sum = 0;
      int count = 0;
      for (int y = 0; y < 300; ++y) {
        for (int x = 0; x < 300; ++x) {
          const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
          const Vec3 along = Normalized(ray.direction), to_centre = centre - ray.origin;
          const double miss = Length(to_centre - Dot(to_centre, along) * along) / radius;
          if (miss > 0.9) continue;
          const double difference = double(PixelOf(image, x, y)[0]) - std::sqrt(1 - miss * miss);
          sum += difference * difference;
          ++count;
        }
      }
      EXPECT_GT(count, 10000);
      return std::sqrt(sum / count);
    };
    const double central = error(false), smooth = error(true);
    EXPECT_LT(smooth, 0.6 * central) << NameOf(type) << ' ' << smooth << ' ' << central;
    EXPECT_LT(smooth, 0.03) << NameOf(type);
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
