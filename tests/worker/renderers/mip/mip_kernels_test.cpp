// The kernel of intensity projections: bit for bit its definition on every instruction set, and the same for every partition.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <utility>

#include "tests/support/random.h"
#include "tests/support/random_box.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/rays/project_reference.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

enum class Mode { kMaximum, kMinimum, kMean };

struct Scene {
  Scene(const Volume& volume, const Box& box, const Camera& view, double rate, Mode mode, const ClipRegion& clip = {})
      : camera(view),
        rays(MakeViewRays(camera, volume.description.geometry, rate, clip)),
        padded(Pad(VoxelBricks(volume.block), Grown(box, 3, volume.block.box))),
        cells(FindMacrocellRanges(padded)),
        ray_box(MakeRayBox(padded, cells.counts, WholeBox(box), WholeBox(box), rays, camera)),
        bounds(BoundSamples(cells, mode == Mode::kMinimum ? -1 : 1)),
        opposite(BoundSamples(cells, mode == Mode::kMinimum ? 1 : -1)) {
    work = {.rays = &rays, .box = &ray_box, .bounds = &bounds, .values = {10, 1.0F / 180}};
    if (mode == Mode::kMean) work.opposite = &opposite;
    if (mode == Mode::kMinimum) work.sign = -1, work.complement = true;
  }

  LocalImage Projected(bool by_reference = false) const {
    LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, camera.width, camera.height});
    const auto project = by_reference ? ProjectTileReference : ProjectTile;
    project(work, image.bounds, image.rgba.data(), 4 * std::size_t(camera.width));
    return image;
  }

  Camera camera;
  ViewRays rays;
  PaddedVoxels padded;
  MacrocellRanges cells;
  RayBox ray_box;
  SampleBounds bounds, opposite;
  ProjectWork work;
};

TEST(ProjectTile, IsTheReferenceBitForBit) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(91);
  for (int i = 0; i < 24; ++i) {
    const ScalarType type = ScalarType(1 + i % 3);
    Volume volume = MakeBlobs({{33, 27, 30}, {1, 0.7, 1.4}}, type, unsigned(i));
    if (type == ScalarType::kFloat32) {
      float* const samples = volume.block.samples<float>();
      samples[4000] = std::numeric_limits<float>::quiet_NaN();
      samples[9000] = std::numeric_limits<float>::infinity();
    }
    ViewParameters view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, views);
    view.zoom *= i % 5 == 0 ? 4 : 1;
    const Camera camera = MakeCamera(view, {45, 38}, volume.description.geometry);
    const Box box = i % 4 == 0 ? volume.block.box : RandomBox(random, volume.block.box);
    // One in two is clipped.
    Clipping clipping = i / 3 % 2 == 0 ? Clipping{} : RandomClipping(volume.description.geometry, views);
    clipping.mode = i / 6 % 2 == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
    const ClipRegion clip = MakeClipRegion(clipping, volume.description.geometry).value();
    for (const Mode mode : {Mode::kMaximum, Mode::kMinimum, Mode::kMean}) {
      const Scene scene(volume, box, camera, i % 4 == 1 ? 2.5 : 1, mode, clip);
      const LocalImage expected = scene.Projected(true);
      ForEachTarget([&] { EXPECT_TRUE(scene.Projected().rgba == expected.rgba) << "case " << i << " mode " << int(mode); });
    }
  }
}

// The rays of a packet lie many voxels apart, and have many samples.
TEST(ProjectTile, SmallPicturesAreTheReferenceBitForBit) {
  std::mt19937 views(94);
  for (int i = 0; i < 12; ++i) {
    const Volume volume = MakeBlobs({{70, 52, 61}, {1, 1, 1.3}}, ScalarType(1 + i % 3), unsigned(i));
    const ViewParameters view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, views);
    const int side = i % 3 == 0 ? 25 : i % 3 == 1 ? 9 : 5;
    const Camera camera = MakeCamera(view, {side, side - 1}, volume.description.geometry);
    for (const Mode mode : {Mode::kMaximum, Mode::kMinimum}) {
      const Scene scene(volume, volume.block.box, camera, i < 6 ? 1 : 16, mode);
      const LocalImage expected = scene.Projected(true);
      ForEachTarget([&] { EXPECT_TRUE(scene.Projected().rgba == expected.rgba) << "case " << i << " mode " << int(mode); });
    }
  }
}

TEST(ProjectTile, BoxesCombineToTheImageOfTheWholeBitForBit) {
  std::mt19937 random(92);
  for (int i = 0; i < 8; ++i) {
    const Volume volume = MakeBlobs({{40, 37, 43}, {1, 1, 1.2}}, ScalarType(1 + i % 3), unsigned(i));
    const ViewParameters view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
    const Camera camera = MakeCamera(view, {70, 60}, volume.description.geometry);
    const Partition partition = CutAtRandom(volume.block.box, 9, random);
    for (const Mode mode : {Mode::kMaximum, Mode::kMinimum, Mode::kMean}) {
      const LocalImage whole = Scene(volume, volume.block.box, camera, 1, mode).Projected();
      LocalImage combined = MakeLocalImage(PixelFormat::kRgba, whole.bounds);
      for (const Box& box : partition.boxes()) {
        const LocalImage part = Scene(volume, box, camera, 1, mode).Projected();
        for (std::size_t k = 0; k < part.rgba.size(); ++k) {
          combined.rgba[k] = mode == Mode::kMean ? combined.rgba[k] + part.rgba[k] : std::max(combined.rgba[k], part.rgba[k]);
        }
      }
      EXPECT_TRUE(combined.rgba == whole.rgba) << "case " << i << " mode " << int(mode);
    }
  }
}

// Sums leap over blocks and cells of one value, be it black, white or between, and stop at what lies beside them.
TEST(ProjectTile, SumsAcrossUniformPartsAreTheReferenceBitForBit) {
  const unsigned seed = 93;
  std::mt19937 random(seed);
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed << " case " << i);
    const Index3 size = {70, 52, 61};
    const std::array<double, 4> parts = {5, 195, 100, -1};  // by half of x and of y; -1: noise
    const Volume volume = MakeVolume({size, {1, 1, 1.3}}, i / 2 % 2 == 0 ? ScalarType::kUint8 : ScalarType::kUint16, [&](const Index3& v) {
      const double part = parts[std::size_t(v.x >= 37) + 2 * std::size_t(v.y >= 20)];
      return part >= 0 ? part : double(random() % 200);
    });
    const ViewParameters view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
    const Camera camera = MakeCamera(view, {51, 46}, volume.description.geometry);
    Scene scene(volume, volume.block.box, camera, i < 4 ? 1 : 2.5, Mode::kMean);
    if (i % 4 >= 2) {  // as where data values fall as stored samples rise
      scene.work.sign = -1;
      std::swap(scene.work.bounds, scene.work.opposite);
    }
    const LocalImage expected = scene.Projected(true);
    ForEachTarget([&] { EXPECT_TRUE(scene.Projected().rgba == expected.rgba); });
  }
}

// A block of one value: every ray through it has that value, and as many samples as its length holds.
TEST(ProjectTile, SumsCountSamplesOfTheWayThroughTheVolume) {
  const Volume volume = MakeVolume({{32, 32, 32}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3&) { return 100; });
  const Camera camera = MakeCamera({}, {64, 64}, volume.description.geometry);  // along +y
  for (const double rate : {1.0, 4.0}) {
    const LocalImage sums = Scene(volume, volume.block.box, camera, rate, Mode::kMean).Projected();
    const auto pixel = PixelOf(sums, 32, 32);
    EXPECT_EQ(pixel[3], float(32 * rate));
    const double mean = (double(pixel[0]) * 65536 + double(pixel[1]) * 256 + double(pixel[2])) / double(pixel[3]) / 0x1p24;
    EXPECT_NEAR(mean, 0.5, 1e-6);
    EXPECT_EQ(PixelOf(sums, 1, 1)[3], 0);
  }
}

}  // namespace
}  // namespace slabstream
