// The ray caster's kernel on every instruction set against its definition, and what it leaps with.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "tests/support/random.h"
#include "tests/support/random_box.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/raycast/march_reference.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/surface_cells.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// A box of a volume, ready to be marched through.
struct Scene {
  Scene(const Volume& volume, const Box& box, const FrameSetup& setup, double rate)
      : camera(setup.camera),
        rays(MakeViewRays(camera, volume.description.geometry, rate, setup.clip)),
        padded(Pad(VoxelBricks(volume.block), Grown(box, 3, volume.block.box))),
        cells(FindMacrocellRanges(padded)),
        look(MakeRayLook(Classify(setup.transfer, setup.description, setup.range), setup.transfer, setup.description, camera, setup.shading,
                         rate)),
        visible(look),
        to_samples(cells.counts, VisibleCells(cells, [&](float low, float high) { return visible.AnyMatterBetween(low, high); })),
        surface_cells(FindSurfaceCells(padded, cells, visible)),
        to_surfaces(cells.counts, MacrocellsWithSurfaces(surface_cells)),
        ray_box(MakeRayBox(padded, cells.counts, WholeBox(box), WholeBox(box), rays, camera)) {
    to_samples.Find(OctantsOf(rays));
    to_surfaces.Find(OctantsOf(rays));
  }

  // Rays leap nowhere: every cell might show something.
  void FindNothingEmpty() {
    for (EmptyDistances* distances : {&to_samples, &to_surfaces}) {
      *distances = EmptyDistances(cells.counts, std::vector<std::uint8_t>(cells.ranges.size()));
      distances->Find(OctantsOf(rays));
    }
  }
  // Rays leap over eighths of cells, too.
  void FindEighths() {
    to_samples.SetEighths(VisibleEighths(padded, cells.counts, to_samples.visible(),
                                         [&](float low, float high) { return visible.AnyMatterBetween(low, high); }));
    to_samples.Find(OctantsOf(rays));
  }

  MarchWork Work(float termination = 0) const {
    return {.rays = &rays,
            .box = &ray_box,
            .look = &look,
            .to_samples = &to_samples,
            .to_surfaces = look.isovalues.empty() ? nullptr : &to_surfaces,
            .surface_cells = surface_cells.data(),
            .termination = termination,
            .smooth = smooth};
  }

  Camera camera;
  ViewRays rays;
  PaddedVoxels padded;
  MacrocellRanges cells;
  RayLook look;
  VisibleSamples visible;
  EmptyDistances to_samples;
  std::vector<std::int32_t> surface_cells;
  EmptyDistances to_surfaces;
  RayBox ray_box;
  bool smooth = false;  // MarchWork::smooth
};

LocalImage Marched(const Scene& scene, float termination = 0) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, scene.camera.width, scene.camera.height});
  GradientBricks bricks;
  MarchTile(scene.Work(termination), image.bounds, {&bricks, 1}, image.rgba.data(), 4 * std::size_t(image.bounds.width()));
  return image;
}
LocalImage MarchedByReference(const Scene& scene) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, scene.camera.width, scene.camera.height});
  MarchTileReference(scene.Work(), image.bounds, image.rgba.data(), 4 * std::size_t(image.bounds.width()));
  return image;
}

// A random scene: view, box, transfer function, lights and rate by the number `i`.
struct RandomScene {
  Volume volume;
  SetupOptions options;
  Box box;
  double rate = 1;

  RandomScene(int i, Random& random, std::mt19937& views) {
    const ScalarType type = ScalarType(1 + i % 3);
    const Projection projection = i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective;
    volume = MakeBlobs({{23, 19, 27}, {1, 0.7, 1.4}}, type, unsigned(i));
    if (type == ScalarType::kFloat32) volume.block.samples<float>()[4000] = std::numeric_limits<float>::quiet_NaN();
    options.view = RandomView(projection, views);
    options.view.zoom *= i % 5 == 0 ? 4 : 1;
    options.transfer = Ramp(random.Real(0.05, 0.9));
    if (i % 3 == 0) options.transfer.opacities = {{90, 0, 0.5, 0}, {110, 0.7, 0.5, 0}, {130, 0, 0.5, 0}};
    if (i % 7 == 3) options.shading.model = ShadingModel::kNone;
    if (i % 2 == 1) options.shading.lights = {{1, 2, 3}, {-1, 0.3, -0.2}};
    options.size = {45, 38};
    box = i % 4 == 0 ? volume.block.box : RandomBox(random, volume.block.box);
    if (i % 4 == 1) rate = 2.5;
  }

  Scene Make() const {
    FrameSetup setup = MakeSetup(volume, options);
    setup.camera = MakeCamera(options.view, options.size, volume.description.geometry);
    return {volume, box, setup, rate};
  }
};

TEST(MarchTile, AgreesWithTheReference) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(81);
  for (int i = 0; i < 18; ++i) {
    const RandomScene setup(i, random, views);
    Scene scene = setup.Make();
    for (const bool smooth : {false, true}) {
      scene.smooth = smooth;
      const LocalImage expected = MarchedByReference(scene);
      ForEachTarget([&] { EXPECT_LE(LargestDifference(Marched(scene), expected), 1e-5F) << "case " << i << " smooth " << smooth; });
    }
  }
}

TEST(MarchTile, LeapsChangeNoBit) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(81);
  for (int i = 0; i < 48; ++i) {
    RandomScene setup(i, random, views);
    if (i % 3 != 0) setup.options.transfer.isosurfaces = {{random.Real(1, 199), {1, 0.5F, 0.2F}, i % 4 == 0 ? 1 : 0.3}};
    Scene scene = setup.Make();
    const LocalImage leapt = Marched(scene);
    scene.FindEighths();
    EXPECT_EQ(LargestDifference(Marched(scene), leapt), 0) << "over eighths, case " << i;
    scene.FindNothingEmpty();
    EXPECT_EQ(LargestDifference(Marched(scene), leapt), 0) << "case " << i;
  }
}

// Rays leap to a few voxels with nothing between them, whatever the angle between neighbouring rays.
TEST(MarchTile, MissesNoVoxelInEmptySpace) {
  Random random(85);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(85);
  for (int i = 0; i < 150; ++i) {
    const VolumeGeometry geometry = {{random.Integer(5, 60), random.Integer(5, 60), random.Integer(5, 60)}, {1, random.Real(0.5, 2), 1}};
    Volume volume = MakeVolume(geometry, ScalarType::kUint8, [](const Index3&) { return 0; });
    std::uint8_t* const samples = volume.block.samples<std::uint8_t>();
    for (int voxels = random.Integer(1, 20); voxels > 0; --voxels)
      samples[random.Integer<std::int64_t>(0, CountIn(geometry.size) - 1)] = 255;
    SetupOptions options;
    if (i % 2 == 0) options.transfer.isosurfaces = {{random.Real(1, 250), {1, 0.5F, 0.2F}, 0.5}};
    options.view = RandomView(i % 3 == 0 ? Projection::kOrthographic : Projection::kPerspective, views);
    options.view.fov_degrees = random.Real(kMinFovDegrees, kMaxFovDegrees);
    options.view.zoom = random.Real(0.5, 1.5);
    const int side = i % 2 == 0 ? 70 : 9;
    options.size = {random.Integer(1, side), random.Integer(1, side)};
    FrameSetup setup = MakeSetup(volume, options);
    setup.camera = MakeCamera(options.view, options.size, geometry);
    Scene scene(volume, i % 4 == 0 ? RandomBox(random, volume.block.box) : volume.block.box, setup, random.Real(0.5, 3));
    if (i % 5 == 0) scene.rays.jitter = 1;
    if (i % 4 < 2) scene.FindEighths();
    const LocalImage leapt = Marched(scene);
    if (scene.look.isovalues.empty()) {
      const LocalImage expected = MarchedByReference(scene);
      ForEachTarget([&] { EXPECT_LE(LargestDifference(Marched(scene), expected), 1e-5F) << "case " << i; });
    }
    scene.FindNothingEmpty();
    EXPECT_EQ(LargestDifference(Marched(scene), leapt), 0) << "case " << i;
  }
}

TEST(MarchTile, AgreesWithTheReferenceOnClippedVolumes) {
  Random random(84);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(84);
  for (int i = 0; i < 24; ++i) {
    RandomScene setup(i, random, views);
    setup.options.clipping = RandomClipping(setup.volume.description.geometry, views);
    setup.options.clipping.mode = i / 2 % 2 == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
    const Scene scene = setup.Make();
    const LocalImage expected = MarchedByReference(scene);
    // What a sample beside a cut stands for is a difference of large numbers in single precision.
    ForEachTarget([&] { EXPECT_LE(LargestDifference(Marched(scene), expected), 1e-4F) << "case " << i; });
  }
}

TEST(MarchTile, AgreesWithTheReferenceOnGradientOpacity) {
  Random random(85);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(85);
  for (int i = 0; i < 18; ++i) {
    RandomScene setup(i, random, views);
    setup.options.transfer.gradient_opacities = {{2, 0.1}, {20, 0.9}, {60, 0.3}};
    if (i % 5 == 1) setup.options.transfer.opacity_distance = 2.5;
    Scene scene = setup.Make();
    for (const bool smooth : {false, true}) {  // opacities stay
      scene.smooth = smooth;
      const LocalImage expected = MarchedByReference(scene);
      // A rounding may move a gradient to the next of 4096 entries.
      ForEachTarget([&] { EXPECT_LE(LargestDifference(Marched(scene), expected), 5e-4F) << "case " << i << " smooth " << smooth; });
    }
  }
}

// How many pixels of two images differ by more than `tolerance`, and how many of the first one show something.
std::pair<int, int> DifferentPixels(const LocalImage& a, const LocalImage& b, float tolerance) {
  std::pair<int, int> count = {0, 0};
  for (int y = a.bounds.y_begin; y < a.bounds.y_end; ++y) {
    for (int x = a.bounds.x_begin; x < a.bounds.x_end; ++x) {
      const auto p = PixelOf(a, x, y), q = PixelOf(b, x, y);
      bool differs = false;
      for (std::size_t c = 0; c < 4; ++c) differs = differs || !(std::abs(p[c] - q[c]) <= tolerance);
      count.first += differs ? 1 : 0;
      count.second += p[3] > 0 ? 1 : 0;
    }
  }
  return count;
}

TEST(MarchTile, AgreesWithTheReferenceOnIsosurfaces) {
  Random random(86);
  int all_seen = 0;
  SCOPED_TRACE(random.trace());
  std::mt19937 views(86);
  for (int i = 0; i < 36; ++i) {
    RandomScene setup(i, random, views);
    const double a = random.Real(1, 100), b = random.Real(101, 199);
    setup.options.transfer.isosurfaces = {{a, {1, 0.5F, 0.2F}, i % 3 == 0 ? 1 : 0.3}, {b, {0.2F, 0.5F, 1}, 0.5}};
    if (i % 3 == 1) {  // several in a cell, and more along a ray than a walk keeps
      auto& surfaces = setup.options.transfer.isosurfaces;
      for (int n = 1; n < 8; ++n) surfaces.insert(surfaces.end() - 1, {a + (b - a) * n / 8, {1, 1, 1}, 0.02});
    }
    if (i % 2 == 0) setup.options.transfer.opacities = {{0, 0}};  // surfaces alone
    if (i % 6 == 5) setup.rate = 0.1;
    if (i % 4 == 3) {
      setup.options.clipping = RandomClipping(setup.volume.description.geometry, views);
      setup.options.clipping.mode = i % 8 == 3 ? ClipMode::kKeep : ClipMode::kCutAway;
    }
    Scene scene = setup.Make();
    scene.smooth = i % 5 < 2;
    const LocalImage expected = MarchedByReference(scene);
    ForEachTarget([&] {
      const auto [differ, seen] = DifferentPixels(expected, Marched(scene), 1e-3F);
      EXPECT_LE(differ, seen / 200) << "case " << i << ": rays that touch a surface may miss it";
      all_seen += seen;
    });
  }
  EXPECT_GT(all_seen, 5000) << "also with one instruction set";
}

// Every cell of the padded voxels, of every type.
TEST(FindSurfaceCells, FindsTheCellsWhoseCornersLieOnBothSides) {
  Random random(89);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(89);
  int held = 0;
  for (int i = 0; i < 12; ++i) {
    RandomScene setup(i, random, views);
    setup.options.transfer.isosurfaces = {{random.Real(1, 60), {1, 1, 1}, 1}, {random.Real(61, 120), {1, 1, 1}, 1}};
    const Scene scene = setup.Make();
    const PaddedVoxels& voxels = scene.padded;
    const Index3 begin = voxels.box.begin - Uniform(1), end = voxels.box.end;  // cells, by their lowest corner
    const auto value_at = [&](const Index3& voxel) {
      return VisitScalarType(voxels.type, [&]<class T>(const T*) { return double(*reinterpret_cast<const T*>(voxels.At(voxel))); });
    };
    for (const float isovalue : scene.look.isovalues) ASSERT_TRUE(std::isfinite(isovalue));
    for (Index3 cell = begin; cell.z < end.z; ++cell.z) {
      for (cell.y = begin.y; cell.y < end.y; ++cell.y) {
        for (cell.x = begin.x; cell.x < end.x; ++cell.x) {
          bool holds = false;
          for (const float isovalue : scene.look.isovalues) {
            int above = 0;
            for (int corner = 0; corner < 8; ++corner) {
              above += value_at(cell + Index3{corner & 1, corner >> 1 & 1, corner >> 2}) >= double(isovalue) ? 1 : 0;
            }
            holds = holds || (above != 0 && above != 8);
          }
          const Index3 at = cell - begin, group = {at.x / kCellSide, at.y / kCellSide, at.z / kCellSide}, among = at - kCellSide * group;
          const std::int32_t bits = scene.surface_cells[2 * NumberIn(scene.cells.counts, group) + std::size_t(among.z % 2)];
          ASSERT_EQ((bits >> (16 * (among.z / 2) + 4 * among.y + among.x) & 1) != 0, holds) << "case " << i;
          held += holds ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(held, 1000);
}

// Differences of neighbours that do not fit into 16 bits.
TEST(MarchTile, LightsVoxelsOfTheWholeRangeOf16Bits) {
  Random random(87);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(87);
  const Volume volume =
      MakeVolume({{18, 21, 15}, {1, 1, 1}}, ScalarType::kUint16, [&](const Index3&) { return 65535 * random.Integer(0, 8) / 8; });
  SetupOptions options;
  options.transfer.opacities = {{0, 0.1, 0.5, 0}, {65535, 0.4, 0.5, 0}};
  options.size = {45, 38};
  for (Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    options.view = RandomView(projection, views);
    Scene scene(volume, volume.block.box, MakeSetup(volume, options), 1);
    for (const bool smooth : {false, true}) {
      scene.smooth = smooth;
      const LocalImage expected = MarchedByReference(scene);
      ForEachTarget([&] { EXPECT_LE(LargestDifference(Marched(scene), expected), 1e-4F) << "smooth " << smooth; });
    }
  }
}

// More bricks than there is room for, and those of other voxels.
TEST(MarchTile, ForgetsBricksWithoutATrace) {
  std::mt19937 views(88);
  SetupOptions options;
  options.view = RandomView(Projection::kPerspective, views);
  options.transfer = Ramp(0.01);
  options.size = {64, 64};
  GradientBricks kept;
  const Volume a = MakeBlobs({{90, 90, 90}, {1, 1, 1}}, ScalarType::kUint8, 1),
               b = MakeBlobs({{90, 90, 90}, {1, 1, 1}}, ScalarType::kUint8, 2);
  Scene scenes[] = {{a, a.block.box, MakeSetup(a, options), 1}, {b, b.block.box, MakeSetup(b, options), 1}};
  for (Scene& scene : scenes) {
    scene.smooth = &scene == &scenes[1];
    const LocalImage whole = Marched(scene);
    LocalImage tiled = MakeLocalImage(PixelFormat::kRgba, whole.bounds);
    for (std::int32_t y = 0; y < 64; y += 16) {
      for (std::int32_t x = 0; x < 64; x += 16)
        MarchTile(scene.Work(), {x, y, x + 16, y + 16}, {&kept, 1}, &tiled.rgba[4 * std::size_t(64 * y + x)], 256);
    }
    EXPECT_EQ(LargestDifference(tiled, whole), 0);
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

TEST(EmptyDistances, AreChebyshevDistancesToTheNearestVisibleCellOfAnOctant) {
  Random random(83);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 6; ++i) {
    const Index3 n{9 - i, 8, 5 + i};
    std::vector<std::uint8_t> shown(std::size_t(CountIn(n)));
    for (std::uint8_t& cell : shown) cell = random.Integer(0, 10 * (1 + i)) == 0 ? 0 : 255;
    EmptyDistances distances(n, shown);
    OctantSet asked = 0;
    for (const OctantSet octants : {OctantSet{1}, OctantSet{0x24}, OctantSet{0x20}, OctantSet{0xFF}}) {
      distances.Find(octants);
      asked = (octants & ~asked) != 0 ? octants : asked;
      for (unsigned octant = 0; octant < kOctants; ++octant) {
        if ((asked >> octant & 1) == 0) continue;
        // From c to v along the octant: how far along each axis, negative if it lies behind.
        const auto ahead = [&](const Index3& c, const Index3& v, int axis) {
          return (octant >> axis & 1) != 0 ? c[axis] - v[axis] : v[axis] - c[axis];
        };
        for (std::int32_t number = 0; number < std::int32_t(CountIn(n)); ++number) {
          const Index3 c{number % n.x, number / n.x % n.y, number / n.x / n.y};
          int nearest = 255;
          for (std::int32_t other = 0; other < std::int32_t(CountIn(n)); ++other) {
            const Index3 v{other % n.x, other / n.x % n.y, other / n.x / n.y};
            const int x = ahead(c, v, 0), y = ahead(c, v, 1), z = ahead(c, v, 2);
            if (shown[std::size_t(other)] == 0 && std::min({x, y, z}) >= 0) nearest = std::min(nearest, std::max({x, y, z}));
          }
          const int eighths = nearest == 0 ? 255 : 0;
          ASSERT_EQ(int(distances.data()[distances.starts()[octant] + number]), 256 * nearest + eighths)
              << "octant " << octant << ", cell " << number;
        }
      }
    }
  }
}

// The direction of every pixel's ray is in one of the octants, whatever the view.
TEST(OctantsOf, ContainTheDirectionsOfAllRays) {
  Random random(84);
  SCOPED_TRACE(random.trace());
  const Volume volume = MakeVolume({{20, 30, 25}, {1, 2, 0.5}}, ScalarType::kUint8, [](const Index3&) { return 1; });
  for (int i = 0; i < 60; ++i) {
    SetupOptions options;
    const bool perspective = i % 2 != 0;
    options.view.projection = perspective ? Projection::kPerspective : Projection::kOrthographic;
    options.view.azimuth_degrees = i % 3 == 0 ? 90.0 * (i % 4) : random.Real(0, 360);
    options.view.elevation_degrees = i % 5 == 0 ? 0 : random.Real(-90, 90);
    const FrameSetup setup = MakeSetup(volume, options);
    const ViewRays rays = MakeViewRays(setup.camera, volume.description.geometry, 1);
    const OctantSet octants = OctantsOf(rays);
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        unsigned octant = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float offset = (float(x) - rays.centre_x) * rays.right[axis] + (float(y) - rays.centre_y) * rays.down[axis];
          if (rays.forward[axis] + (perspective ? offset : 0) < 0) octant |= 1U << axis;
        }
        ASSERT_NE(octants >> octant & 1, 0U) << "view " << i << ", pixel " << x << "," << y;
      }
    }
    EXPECT_LE(std::popcount(octants), perspective ? 8 : 4) << "view " << i;
  }
}

}  // namespace
}  // namespace slabstream
