// The ray caster's kernel on every instruction set against its definition, and what it leaps with.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderers/render_support.h"
#include "tests/support/random.h"
#include "tests/support/random_box.h"
#include "tests/support/simd_targets.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/march.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// A box of a volume, ready to be marched through.
struct Scene {
  Scene(const Volume& volume, const Box& box, const FrameSetup& setup, double rate)
      : camera(setup.camera),
        rays(MakeViewRays(camera, volume.description.geometry, rate)),
        padded(Pad(VoxelBricks(volume.block), Grown(box, 3, volume.block.box))),
        cells(FindCellRanges(padded)),
        look(MakeRayLook(Classify(setup.transfer, setup.description, setup.range), setup.description, camera, setup.shading, rate)),
        distances(EmptyDistances(cells, VisibleSamples(look))),
        ray_box(MakeRayBox(padded, cells.counts, box, WholeBox(box), rays, camera)) {}

  MarchWork Work(float termination = 0) const { return {&rays, &ray_box, &look, distances.data(), termination}; }

  Camera camera;
  ViewRays rays;
  PaddedVoxels padded;
  CellRanges cells;
  RayLook look;
  std::vector<std::uint8_t> distances;
  RayBox ray_box;
};

LocalImage Marched(const Scene& scene, float termination = 0) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, scene.camera.width, scene.camera.height});
  MarchTile(scene.Work(termination), image.bounds, image.rgba.data(), 4 * std::size_t(image.bounds.width()));
  return image;
}
LocalImage MarchedByReference(const Scene& scene) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, scene.camera.width, scene.camera.height});
  MarchTileReference(scene.Work(), image.bounds, image.rgba.data(), 4 * std::size_t(image.bounds.width()));
  return image;
}

TEST(MarchTile, AgreesWithTheReference) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(81);
  for (int i = 0; i < 18; ++i) {
    const ScalarType type = ScalarType(1 + i % 3);
    const Projection projection = i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective;
    Volume volume = MakeBlobs({{23, 19, 27}, {1, 0.7, 1.4}}, type, unsigned(i));
    if (type == ScalarType::kFloat32) volume.block.samples<float>()[4000] = std::numeric_limits<float>::quiet_NaN();
    SetupOptions options;
    options.view = RandomView(projection, views);
    options.view.zoom *= i % 5 == 0 ? 4 : 1;
    options.transfer = Ramp(random.Real(0.05, 0.9));
    if (i % 3 == 0) options.transfer.opacities = {{90, 0, 0.5, 0}, {110, 0.7, 0.5, 0}, {130, 0, 0.5, 0}};
    if (i % 7 == 3) options.shading.model = ShadingModel::kNone;
    if (i % 2 == 1) options.shading.lights = {{1, 2, 3}, {-1, 0.3, -0.2}};
    options.size = {45, 38};
    FrameSetup setup = MakeSetup(volume, options);
    setup.camera = MakeCamera(options.view, options.size, volume.description.geometry);
    const Box box = i % 4 == 0 ? volume.block.box : RandomBox(random, volume.block.box);
    const Scene scene(volume, box, setup, i % 4 == 1 ? 2.5 : 1);
    const LocalImage expected = MarchedByReference(scene);
    ForEachTarget([&] { EXPECT_LE(LargestDifference(Marched(scene), expected), 1e-5F) << "case " << i; });
  }
}

// Empty space that is leapt over, and rays that end early, do not show.
TEST(MarchTile, EarlyTerminationChangesNoMoreThanItsThreshold) {
  std::mt19937 views(82);
  const Volume volume = MakeBlobs({{40, 40, 40}, {1, 1, 1}}, ScalarType::kUint8, 7);
  for (Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    SetupOptions options;
    options.view = RandomView(projection, views);
    options.transfer = Ramp(0.8);
    const Scene scene(volume, volume.block.box, MakeSetup(volume, options), 1);
    EXPECT_LE(LargestDifference(Marched(scene, 0.01F), Marched(scene)), 0.01F + 1e-5F);
    EXPECT_GT(LargestDifference(Marched(scene, 0.1F), Marched(scene)), 0);
  }
}

TEST(EmptyDistances, AreChebyshevDistancesToTheNearestVisibleCell) {
  Random random(83);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 6; ++i) {
    const Volume volume = MakeVolume({{37, 30, 41}, {1, 1, 1}}, ScalarType::kUint8,
                                     [&](const Index3&) { return random.Integer(0, 400 * (1 + i)) == 0 ? 100 : 0; });
    SetupOptions options;
    const FrameSetup setup = MakeSetup(volume, options);
    const Scene scene(volume, volume.block.box, setup, 1);
    const Index3& n = scene.cells.counts;
    std::vector<Index3> visible;
    for (Index3 c; c.z < n.z; ++c.z) {
      for (c.y = 0; c.y < n.y; ++c.y) {
        for (c.x = 0; c.x < n.x; ++c.x) {
          if (scene.cells.ranges[NumberIn(n, c)].max > 0) visible.push_back(c);
        }
      }
    }
    for (Index3 c; c.z < n.z; ++c.z) {
      for (c.y = 0; c.y < n.y; ++c.y) {
        for (c.x = 0; c.x < n.x; ++c.x) {
          int nearest = 255;
          for (const Index3& v : visible)
            nearest = std::min(nearest, std::max({std::abs(v.x - c.x), std::abs(v.y - c.y), std::abs(v.z - c.z)}));
          ASSERT_EQ(int(scene.distances[NumberIn(n, c)]), nearest) << c.x << "," << c.y << "," << c.z;
        }
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
