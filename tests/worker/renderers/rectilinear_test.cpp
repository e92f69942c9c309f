// Rectilinear grids by the renderers that draw them: values, gradients and opacities against what follows from the grid itself, and one
// picture for all partitions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/renderers/mip/projection_mode.h"
#include "common/renderers/raycast/raycast_parameters.h"
#include "common/volume/indices.h"
#include "tests/support/random.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/rays/stretch_tables.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Steps differ by up to `ratio`.
std::vector<double> RandomPlaces(int size, double ratio, Random& random) {
  std::vector<double> ends = {0};
  for (int i = 0; i <= size; ++i) ends.push_back(ends.back() + std::pow(ratio, random.Real(-0.5, 0.5)));
  std::vector<double> places;
  for (int i = 1; i <= size; ++i) places.push_back(ends[std::size_t(i)] / ends.back() * size - 0.5);
  return places;
}

// Two axes or three are uneven.
VolumeGeometry RandomGrid(Random& random, double ratio = 20) {
  VolumeGeometry grid{.size = {random.Integer(9, 30), random.Integer(9, 30), random.Integer(9, 30)}, .spacing = {1, 0.8, 1.3}};
  const bool all = random.Chance(0.5);
  const int even = random.Integer(0, 2);
  Stretch::Places places;
  for (int i = 0; i < 3; ++i) {
    if (all || i != even) places[std::size_t(i)] = RandomPlaces(grid.size[i], ratio, random);
  }
  grid.stretch = Stretch::Make(places, grid.size).value();
  return grid;
}

// From -1 to 1 by tanh, as channel flow is: the longest step is about `ratio` times the shortest.
std::vector<double> WallPlaces(int size, double ratio) {
  const double steepness = std::acosh(std::sqrt(ratio));
  std::vector<double> at;
  for (int i = 0; i < size; ++i) at.push_back(std::tanh(steepness * (2.0 * i / (size - 1) - 1)) / std::tanh(steepness));
  const double first = at[1] - at[0], length = 2 + first;
  std::vector<double> places;
  for (const double y : at) places.push_back((y + 1 + first / 2) / length * size - 0.5);
  return places;
}

// The value at p, in data space.
double ValueAt(const Volume& volume, const Vec3& p) {
  const Vec3 voxel = volume.description.geometry.stretch.ToVoxel(p);
  const Index3 last = volume.description.geometry.size - Index3{1, 1, 1};
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Index3 at;
    double weight = 1;
    for (int i = 0; i < 3; ++i) {
      const double inside = std::clamp(voxel[i], 0.0, double(last[i]));
      const int low = std::min(int(inside), std::max(last[i] - 1, 0)), high = std::min(low + 1, last[i]);
      const bool upper = (corner >> i & 1) != 0;
      at[i] = upper ? high : low;
      weight *= upper ? inside - low : 1 - (inside - low);
    }
    if (weight > 0) sum += weight * double(volume.block.samples<float>()[volume.block.Offset(at)]);
  }
  return sum;
}

Volume RandomValues(const VolumeGeometry& grid, Random& random) {
  return MakeVolume(grid, ScalarType::kFloat32, [&](const Index3&) { return random.Real(0, 200); });
}

// Depths at which the ray of a pixel is in what clipping and the volume leave of it.
struct Depths {
  double enter, leave;
};
Depths Inside(const FrameSetup& setup, const Camera::Ray& ray) {
  Depths inside = {0, 1e300};
  const auto cut = [&](const Vec3& normal, double offset) {
    const double at = -(Dot(normal, ray.origin) + offset) / Dot(normal, ray.direction);
    (Dot(normal, ray.direction) > 0 ? inside.enter : inside.leave) =
        Dot(normal, ray.direction) > 0 ? std::max(inside.enter, at) : std::min(inside.leave, at);
  };
  for (const Axis axis : kAxes) {
    Vec3 normal;
    normal[axis] = 1;
    cut(normal, 0.5);
    cut(-normal, setup.description.geometry.size[axis] - 0.5);
  }
  for (const HalfSpace& side : setup.clip.sides) cut(side.normal, side.offset);
  return inside;
}

TEST(Rectilinear, ASliceHasTheValuesBetweenTheGridsOwnVoxels) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  int pixels = 0;
  for (int round = 0; round < 12; ++round) {
    const Volume volume = RandomValues(RandomGrid(random), random);
    SetupOptions options{.renderer = FindRenderer("mip")};
    // Along an axis, or slanted.
    options.view = {.azimuth_degrees = round % 2 == 0 ? 90.0 * random.Integer(0, 3) : random.Real(0, 360),
                    .elevation_degrees = round % 2 == 0 ? 0 : random.Real(-80, 80)};
    const VolumeGeometry& grid = volume.description.geometry;
    const Vec3 through = grid.ToWorld(ToVec3(grid.size) * Vec3{random.Real(0.3, 0.7), random.Real(0.3, 0.7), random.Real(0.3, 0.7)});
    options.clipping.slab = ClipSlab{.normal = MakeSetup(volume, options).camera.view_direction, .through = through};
    const Axis across = AxisAcross(*options.clipping.slab, grid);
    const bool by_index = round % 4 == 0;
    if (by_index) options.clipping.slab->index = random.Integer(1, grid.size[across] - 2);
    const FrameSetup setup = MakeSetup(volume, options);
    const LocalImage image = RenderWhole(volume, setup);
    const mip::ProjectedValues values = mip::ProjectedValuesOf(setup.transfer, setup.range);
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
        const Depths inside = Inside(setup, ray);
        if (!(inside.enter < inside.leave)) continue;
        // The part of the slab that the volume has may end in its middle.
        const Vec3 p = ray.origin + 0.5 * (inside.enter + inside.leave) * ray.direction;
        const Vec3 off = Absolute(p - grid.centre()) - 0.5 * ToVec3(grid.size);
        if (std::max({off.x, off.y, off.z}) > -0.01) continue;
        ++pixels;
        if (by_index) {
          ASSERT_NEAR(grid.stretch.ToVoxel(p)[across], *options.clipping.slab->index, 1e-6);
        }
        const std::array<float, 4> pixel = PixelOf(image, x, y);
        ASSERT_EQ(pixel[3], 1) << round << ": " << x << ' ' << y;
        // Positions are rounded, and steps between voxels are up to 20 times shorter than their mean.
        EXPECT_NEAR(double(pixel[0]), (ValueAt(volume, p) - values.least) / (values.largest - values.least), 5e-4)
            << round << ": " << x << ' ' << y;
      }
    }
  }
  EXPECT_GT(pixels, 5000);
}

TEST(Rectilinear, AllPartitionsMakeOnePicture) {
  Random random(6);
  SCOPED_TRACE(random.trace());
  std::mt19937 boxes(7);
  for (int round = 0; round < 16; ++round) {
    const VolumeGeometry grid = RandomGrid(random);
    const ScalarType type = kTypes[round % 3];
    const Volume volume = MakeBlobs(grid, type, unsigned(round));
    SetupOptions options{.view = RandomView(kProjections[round % 2], boxes), .transfer = Ramp(0.3)};
    if (round % 4 >= 2) options.clipping = RandomClipping(grid, boxes);
    for (const char* const renderer : {"raycast", "mip"}) {
      options.renderer = FindRenderer(renderer);
      FrameSetup setup = MakeSetup(volume, options);
      if (renderer == std::string_view("raycast")) setup.parameters.at(raycast::kGradient) = round % 5 < 2 ? 1 : 0;
      const LocalImage one = RenderPicture(volume, setup);
      for (int count = 2; count <= 5; ++count) {
        const Partition partition =
            round % 2 == 0 ? CutAtRandom(volume.block.box, count, boxes) : CutIntoSlabs(volume, count, kAxes[round % 3]);
        const LocalImage many = FinishPicture(RenderByBoxes(volume, setup, partition), setup);
        EXPECT_LE(LargestDifference(one, many), setup.format == PixelFormat::kRgba ? 2e-5F : 0.0F)
            << renderer << ", round " << round << ", boxes " << count;
      }
    }
  }
}

TEST(Rectilinear, ProjectionsHaveTheSameBitsOnEveryInstructionSet) {
  Random random(14);
  std::mt19937 views(14);
  const Volume volume = MakeBlobs(RandomGrid(random), ScalarType::kUint16, 2);
  const FrameSetup setup = MakeSetup(volume, {.renderer = FindRenderer("mip"), .view = RandomView(Projection::kPerspective, views)});
  const LocalImage best = RenderWhole(volume, setup);
  ForEachTarget([&] { EXPECT_EQ(LargestDifference(best, RenderWhole(volume, setup)), 0); });
}

TEST(Rectilinear, AClipBoxCountsVoxels) {
  Random random(15);
  const VolumeGeometry grid = RandomGrid(random);
  const ClipRegion region = MakeClipRegion({.box = ClipBox{{2, 3, 1}, {5, 7, 4}, ClipUnit::kVoxels}}, grid).value();
  const auto inside = [&](const Vec3& voxel) {
    return std::ranges::all_of(region.sides, [&](const HalfSpace& side) { return side.Distance(grid.stretch.ToData(voxel)) >= 0; });
  };
  EXPECT_TRUE(inside({1.51, 2.51, 0.51}));
  EXPECT_TRUE(inside({4.49, 6.49, 3.49}));
  for (const Axis axis : kAxes) {
    Vec3 beyond = {1.51, 2.51, 0.51}, behind = {4.49, 6.49, 3.49};
    beyond[axis] -= 0.02;
    behind[axis] += 0.02;
    EXPECT_FALSE(inside(beyond) || inside(behind)) << Letter(axis);
  }
}

TEST(Rectilinear, HiddenTilesChangeNothingElse) {
  Random random(8);
  std::mt19937 tiles(8);
  const Volume volume = MakeBlobs(RandomGrid(random), ScalarType::kUint8, 3);
  ExpectHiddenTilesChangeNothingElse(volume, RaycastSetup(volume, {}), 0.5, tiles);
}

// Whatever its voxels are like, homogeneous matter looks the same.
TEST(Rectilinear, OpacityFollowsFromTheLengthOfARay) {
  Random random(9);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(9);
  for (const Projection projection : kProjections) {
    const Volume volume = MakeBlock(RandomGrid(random));
    ExpectOpacityOfLength(volume, RandomViews(projection, 3, views),
                          {.setup = [&](const SetupOptions& options, int) { return RaycastSetup(volume, options); }});
  }
}

// A layer at the wall whose thickness is a few voxels there and a fraction of the mean one, against the integral along each ray.
TEST(Rectilinear, ThinLayersHaveTheOpacityOfTheirIntegral) {
  VolumeGeometry grid{.size = {12, 97, 12}, .spacing = {1.0 / 6, 2.0 / 97, 1.0 / 6}};
  grid.stretch = Stretch::Make({{{}, WallPlaces(97, 50), {}}}, grid.size).value();
  const Volume volume = MakeVolume(grid, ScalarType::kFloat32, [&](const Index3& v) {
    const double y = 2 * (grid.stretch.ToData(v.y, Axis::kY) + 0.5) / 97 - 1;
    return 200 * std::exp(-(1 - std::abs(y)) / 0.01);
  });
  // `least`: values below show nothing, so rays leap over all but the layers.
  const auto error_at = [&](double rate, double least) {
    double error = 0, largest = 0;
    for (const double elevation : {0.0, 20.0, 60.0}) {
      SetupOptions options{.view = {.azimuth_degrees = 25, .elevation_degrees = elevation}, .transfer = Ramp(0.9)};
      options.transfer.opacities.front().value = least;
      options.shading.model = ShadingModel::kNone;
      const FrameSetup setup = RaycastSetup(volume, options, rate);
      const LocalImage image = RenderWhole(volume, setup);
      for (int y = 3; y < setup.camera.height; y += 6) {
        for (int x = 3; x < setup.camera.width; x += 6) {
          const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
          const Depths inside = Inside(setup, ray);
          if (!(inside.enter < inside.leave)) continue;
          constexpr int kSteps = 6000;
          const double step = (inside.leave - inside.enter) / kSteps;
          double depth = 0;
          for (int i = 0; i < kSteps; ++i) {
            const double value = ValueAt(volume, ray.origin + (inside.enter + (i + 0.5) * step) * ray.direction);
            depth -= std::log1p(-setup.transfer.Opacity(value));
          }
          depth *= step * Length(ray.direction * grid.spacing) / Least(grid.spacing);
          const double expected = 1 - std::exp(-depth);
          largest = std::max(largest, expected);
          error = std::max(error, std::abs(double(PixelOf(image, x, y)[3]) - expected));
        }
      }
    }
    EXPECT_GT(largest, 0.1);
    return error;
  };
  EXPECT_LE(error_at(2, 0), 1e-3);
  EXPECT_LE(error_at(8, 0), 3e-4);
  EXPECT_LE(error_at(8, 50), 1e-3);
}

// A ray has the opacities of as many crossings as what lies between the voxels has along it.
TEST(Rectilinear, RaysCrossIsosurfacesOfTheInterpolatedValue) {
  Random random(16);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(16);
  int rays = 0, crossed = 0, wrong = 0;
  for (int round = 0; round < 8; ++round) {
    const VolumeGeometry grid = RandomGrid(random);
    const Volume volume = MakeBlobs(grid, ScalarType::kFloat32, unsigned(round));
    SetupOptions options{.view = RandomView(kProjections[round % 2], views)};
    options.transfer.opacities = {{0, 0}};
    options.transfer.isosurfaces = {{random.Real(60, 140), {1, 1, 1}, 0.6}};
    const FrameSetup setup = RaycastSetup(volume, options);
    const LocalImage image = RenderWhole(volume, setup);
    for (int y = 1; y < setup.camera.height; y += 3) {
      for (int x = 1; x < setup.camera.width; x += 3) {
        const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
        const Depths inside = Inside(setup, ray);
        if (!(inside.enter < inside.leave)) continue;
        constexpr int kSteps = 4000;
        double transmitted = 1;
        for (int i = 0, above = -1; i <= kSteps; ++i) {
          const double value = ValueAt(volume, ray.origin + std::lerp(inside.enter, inside.leave, double(i) / kSteps) * ray.direction);
          const int is_above = value >= options.transfer.isosurfaces[0].value ? 1 : 0;
          if (above >= 0 && is_above != above) transmitted *= 0.4;
          above = is_above;
        }
        ++rays;
        crossed += transmitted < 1 ? 1 : 0;
        wrong += std::abs(double(PixelOf(image, x, y)[3]) - (1 - transmitted)) > 1e-3 ? 1 : 0;  // touched, or crossed at the border
      }
    }
    for (int count = 2; count <= 4; ++count) {
      EXPECT_LE(LargestDifference(image, RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, count, views))), 2e-5F) << round;
    }
    options.transfer = Ramp(0.2);
    options.transfer.isosurfaces = {{100, {1, 1, 1}, 0.5}};
    const FrameSetup with_matter = RaycastSetup(volume, options);
    const LocalImage many = RenderByBoxes(volume, with_matter, CutAtRandom(volume.block.box, 5, views));
    EXPECT_LE(LargestDifference(RenderWhole(volume, with_matter), many), 2e-5F) << round;
  }
  EXPECT_GT(crossed, rays / 4);
  EXPECT_LE(wrong, rays / 100);
}

// The gradient of a linear function is the same everywhere, and so is its light.
TEST(Rectilinear, ALinearFieldHasOneGradient) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  enum class Of { kLight, kGradientOpacity, kRegion };
  const auto colors = [](const VolumeGeometry& grid, const Vec3& slope, Of of, bool smooth = false) {
    const Vec3 centre = grid.centre();
    const Volume volume = MakeVolume(grid, ScalarType::kFloat32, [&](const Index3& v) {
      return 100 + Dot(slope, (grid.stretch.ToData(ToVec3(v)) - centre) * grid.spacing);
    });
    SetupOptions options{.view = {.azimuth_degrees = 35, .elevation_degrees = 25}};
    options.transfer.colors = {{0, {1, 1, 1}}};
    options.transfer.opacities = {{95, 0}, {97, 0.6}, {103, 0.6}, {105, 0}};  // far from the borders
    options.shading.lights = {{0.3, -0.8, 0.5}};
    const double steep = Length(slope);
    if (of == Of::kGradientOpacity) options.transfer.gradient_opacities = {{steep - 0.5, 0}, {steep + 0.5, 1}};
    if (of == Of::kRegion) {
      options.transfer.regions = {{{{95, steep - 1}, {105, steep - 1}, {105, steep + 1}, {95, steep + 1}}, {1, 1, 1}, 0.6}};
      options.transfer = WithCurvesOfRegions(options.transfer);
    }
    const FrameSetup setup = RaycastSetup(volume, options, 16, 0, smooth);
    const LocalImage image = RenderWhole(volume, setup);
    std::vector<double> straight;
    for (int y = 28; y < 36; ++y) {
      for (int x = 28; x < 36; ++x) {
        const std::array<float, 4> pixel = PixelOf(image, x, y);
        EXPECT_GT(pixel[3], 0.3);
        straight.push_back(double(of == Of::kLight ? pixel[0] / pixel[3] : pixel[3]));
      }
    }
    return straight;
  };
  for (int round = 0; round < 5; ++round) {
    VolumeGeometry grid{.size = {40, 36, 44}, .spacing = {1, 1.2, 0.9}};
    const Vec3 slope = {random.Real(2, 4), random.Real(-4, -2), random.Real(2, 4)};
    const double light = colors(grid, slope, Of::kLight).front();
    const std::vector<double> opacities = colors(grid, slope, Of::kGradientOpacity), of_region = colors(grid, slope, Of::kRegion);
    grid.stretch =
        Stretch::Make({{RandomPlaces(40, 6, random), RandomPlaces(36, 6, random), RandomPlaces(44, 6, random)}}, grid.size).value();
    for (const bool smooth : {false, true}) {
      for (const double of : colors(grid, slope, Of::kLight, smooth)) EXPECT_NEAR(of, light, 1e-3) << round << ' ' << smooth;
    }
    const std::vector<double> stretched = colors(grid, slope, Of::kGradientOpacity), by_region = colors(grid, slope, Of::kRegion);
    for (std::size_t i = 0; i < opacities.size(); ++i) {
      EXPECT_NEAR(stretched[i], opacities[i], 0.01) << round;
      EXPECT_NEAR(by_region[i], of_region[i], 0.02) << round;
    }
  }
}

TEST(StretchTables, BinsLeadToTheirVoxelsAndNoStrideIsLongerThanAStep) {
  Random random(13);
  SCOPED_TRACE(random.trace());
  std::int32_t crowded = 0;
  for (int round = 0; round < 100; ++round) {
    const int size = random.Integer(4, 50);
    std::vector<double> places = RandomPlaces(size, 1000, random);
    if (round % 2 == 1) {  // a bin holds many of them
      for (int i = 0; i < size; ++i) places[std::size_t(i)] = i < size / 2 ? 1 + 2e-5 * i : i;
    }
    const Stretch stretch = Stretch::Make({{places, {}, {}}}, {size, 3, 3}).value();
    const StretchTables tables(stretch);
    const StretchTable& table = tables.axes[0];
    const std::vector<double>& knots = stretch.knots(Axis::kX);
    ASSERT_FALSE(table.even());
    EXPECT_TRUE(tables.axes[1].even());
    for (int i = 0; i < 300; ++i) {
      const double position = i % 2 == 0 ? random.Real(-0.5, size - 0.5) : stretch.ToData(random.Real(-0.5, size - 0.5), Axis::kX);
      const auto bin = std::min(std::size_t((position + 0.5) * double(table.bins_a_unit)), table.first.size() - 1);
      const auto voxel = std::size_t(std::floor(stretch.ToVoxel(position, Axis::kX)) + 1);  // number of the knot before
      EXPECT_LE(std::size_t(table.first[bin]), voxel);
      EXPECT_LE(voxel, std::size_t(table.first[bin] + 2 * table.first_step - 1));
      crowded = std::max(crowded, table.first_step);
      EXPECT_LE(double(table.strides[bin]), (knots[voxel + 1] - knots[voxel]) * 1.00001);
    }
  }
  EXPECT_GE(crowded, 4);
}

}  // namespace
}  // namespace slabstream
