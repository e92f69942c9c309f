// Isosurfaces, and opacity by the gradient. That they are the same for every partition is in partition_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/planning/brick_visibility.h"
#include "common/view/phong.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr unsigned kSeed = 41;
constexpr Rgb kRed = {0.9F, 0.3F, 0.2F}, kBlue = {0.2F, 0.4F, 0.8F};

// Nothing but these surfaces.
TransferFunction Surfaces(std::vector<Isosurface> isosurfaces) {
  TransferFunction transfer{{{0, {1, 1, 1}}}, {{0, 0}}};
  transfer.isosurfaces = std::move(isosurfaces);
  return transfer;
}

SetupOptions RaycastOptions(Projection projection, std::mt19937& random) {
  SetupOptions options;
  options.renderer = FindRenderer("raycast");
  options.view = RandomView(projection, random);
  options.view.zoom = 1;
  return options;
}

LocalImage Raycast(const Volume& volume, const SetupOptions& options, double rate = 1) {
  return RenderPicture(volume, RaycastSetup(volume, options, rate));
}

// The point of a pixel's ray at `distance` from its origin in units of its direction.
struct PixelLine {
  PixelLine(const FrameSetup& setup, int x, int y) : ray(setup.camera.RayAt(x + 0.5, y + 0.5)) {}
  Vec3 At(double t) const { return ray.origin + t * ray.direction; }

  Camera::Ray ray;
};

// What lies in front of `behind`: premultiplied, with light.
std::array<double, 4> Over(const Rgb& color, double opacity, const PhongFactors& light, const std::array<double, 4>& behind = {}) {
  const auto lit = [&](float c) { return std::clamp(double(c) * double(light.diffuse) + double(light.specular), 0.0, 1.0) * opacity; };
  return {lit(color.r) + (1 - opacity) * behind[0], lit(color.g) + (1 - opacity) * behind[1], lit(color.b) + (1 - opacity) * behind[2],
          opacity + (1 - opacity) * behind[3]};
}

void ExpectPixel(const LocalImage& image, int x, int y, const std::array<double, 4>& expected, double tolerance) {
  const std::array<float, 4> pixel = PixelOf(image, x, y);
  for (std::size_t c = 0; c < 4; ++c)
    EXPECT_NEAR(double(pixel[c]), expected[c], tolerance) << "pixel " << x << ' ' << y << " channel " << c;
}

// A linear field is its own trilinear interpolant: the surface is a plane, at a known depth, with one normal.
TEST(Isosurfaces, OfALinearFieldArePlanesAtTheirDepth) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const Projection projection : kProjections) {
    for (int view = 0; view < 8; ++view) {
      SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " projection " << int(projection) << " view " << view);
      const VolumeGeometry geometry{{30, 26, 34}, {1, 0.8, 1.3}};
      const Vec3 slope = {uniform(random), uniform(random), uniform(random)}, middle = {14.5, 12.5, 16.5};
      Volume volume = MakeVolume(geometry, ScalarType::kFloat32, [&](const Index3& v) { return 7 + Dot(slope, ToVec3(v) - middle); });
      const double isovalue = 7 + uniform(random), opacity = view % 2 == 0 ? 1 : 0.3;
      SetupOptions options = RaycastOptions(projection, random);
      options.transfer = Surfaces({{isovalue, kRed, opacity}});
      if (view % 3 == 1) options.shading.lights = {{1, 2, 3}, {-1, 0.3, -0.2}};
      FrameSetup setup = MakeSetup(volume, options);
      const LocalImage image = RenderPicture(volume, setup);
      // The surface again, in slabs that are 2e-3 voxels thick: around it, in front of it and behind it.
      const double length = Length(slope / geometry.spacing);
      const auto clipped = [&](double from, double to) {
        const Vec3 normal = (1 / length) * slope;
        const double offset = -(isovalue - 7) / length - Dot(normal, middle);
        setup.clip.sides = {{normal, offset - from}, {-1 * normal, -offset + to}};
        return RenderPicture(volume, setup);
      };
      const LocalImage around = clipped(-1e-3, 1e-3), above = clipped(1e-3, 3e-3), below = clipped(-3e-3, -1e-3);
      const PhongFactors light = Phong(options.shading, setup.camera.view_direction).AtNormal(Normalized(slope / geometry.spacing));
      int seen = 0;
      for (int y = 0; y < setup.camera.height; ++y) {
        for (int x = 0; x < setup.camera.width; ++x) {
          const PixelLine line(setup, x, y);
          const double rise = Dot(slope, line.ray.direction);
          const Vec3 p = line.At((isovalue - 7 - Dot(slope, line.ray.origin - middle)) / rise);
          bool inside = true;  // where the gradient needs no voxel beyond the border
          for (const Axis axis : kAxes) inside = inside && p[axis] > 1.01 && p[axis] < geometry.size[axis] - 2.01;
          if (!inside || std::abs(rise) * setup.camera.spacing.x < 0.05 * length) continue;
          ++seen;
          ExpectPixel(image, x, y, Over(kRed, opacity, light), 2e-3);
          ASSERT_NEAR(double(PixelOf(around, x, y)[3]), opacity, 1e-6) << x << ' ' << y;
          ASSERT_EQ(PixelOf(above, x, y)[3], 0) << x << ' ' << y;
          ASSERT_EQ(PixelOf(below, x, y)[3], 0) << x << ' ' << y;
        }
      }
      EXPECT_GT(seen, 30);
    }
  }
}

// The product of three coordinates is its own trilinear interpolant, too, and along a ray a cubic with up to three crossings.
TEST(Isosurfaces, OfAProductOfCoordinatesHaveAllTheirCrossings) {
  std::mt19937 random(kSeed);
  const Vec3 centre = {11.3, 12.6, 11.9};
  const auto field = [&](const Vec3& p) { return (p.x - centre.x) * (p.y - centre.y) * (p.z - centre.z); };
  const Volume volume = MakeVolume({{24, 24, 24}, {1, 1, 1}}, ScalarType::kFloat32, [&](const Index3& v) { return field(ToVec3(v)); });
  constexpr double kOpacity = 0.3;
  std::array<int, 8> with_crossings{};
  for (const Projection projection : kProjections) {
    for (const double isovalue : {2.0, -40.0}) {
      for (const double rate : {0.1, 1.0, 3.0}) {
        SetupOptions options = RaycastOptions(projection, random);
        options.transfer = Surfaces({{isovalue, kBlue, kOpacity}});
        const FrameSetup setup = MakeSetup(volume, options);
        const Phong phong(options.shading, setup.camera.view_direction);
        const LocalImage image = Raycast(volume, options, rate);
        for (int y = 12; y < 52; ++y) {
          for (int x = 12; x < 52; ++x) {
            const PixelLine line(setup, x, y);
            std::vector<Vec3> points;
            bool clear = true;  // no ray that only just touches a surface, or crosses it beside the border
            constexpr double kStep = 1e-2;
            const double middle = Dot(centre - line.ray.origin, line.ray.direction) / Dot(line.ray.direction, line.ray.direction);
            for (double t = middle - 25; t < middle + 25; t += kStep) {
              const Vec3 p = line.At(t), q = line.At(t + kStep);
              bool inside = true, beyond = false;
              for (const Axis axis : kAxes) {
                inside = inside && p[axis] > 1.1 && p[axis] < 21.9;
                beyond = beyond || p[axis] < -0.6 || p[axis] > 23.6;
              }
              if (beyond) continue;
              const double a = field(p) - isovalue, b = field(q) - isovalue;
              clear = clear && (inside || std::abs(a) > 0.5 + std::abs(isovalue) / 4);
              if ((a >= 0) == (b >= 0)) continue;
              clear = clear && std::abs(a - b) > 1e-3;
              points.push_back(line.At(t + kStep * a / (a - b)));
            }
            // Beyond the outermost voxel centres values stay as they are there.
            if (!clear || points.size() >= with_crossings.size()) continue;
            ++with_crossings[points.size()];
            std::array<double, 4> expected{};
            for (auto p = points.rbegin(); p != points.rend(); ++p) {
              const Vec3 d = *p - centre;
              expected = Over(kBlue, kOpacity, phong.AtNormal(Normalized(Vec3{d.y * d.z, d.x * d.z, d.x * d.y})), expected);
            }
            SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " rate " << rate << " isovalue " << isovalue);
            ExpectPixel(image, x, y, expected, 3e-3);
            if (HasFailure()) return;
          }
        }
      }
    }
  }
  EXPECT_GT(with_crossings[0], 100);
  EXPECT_GT(with_crossings[1], 100);
  EXPECT_GT(with_crossings[2], 100);
  EXPECT_GT(with_crossings[3], 10);
}

// Two spheres, one in the other: the outer one is a veil.
TEST(Isosurfaces, NestedOnesShowThroughEachOther) {
  std::mt19937 random(kSeed);
  const Vec3 centre = {19.7, 20.1, 19.4};
  constexpr double kOuter = 15, kInner = 8;
  const Volume volume =
      MakeVolume({{40, 40, 40}, {1, 1, 1}}, ScalarType::kFloat32, [&](const Index3& v) { return -Length(ToVec3(v) - centre); });
  for (const Projection projection : kProjections) {
    for (const double inner_opacity : {1.0, 0.5}) {
      SetupOptions options = RaycastOptions(projection, random);
      options.transfer = Surfaces({{-kOuter, kRed, 0.3}, {-kInner, kBlue, inner_opacity}});
      const FrameSetup setup = MakeSetup(volume, options);
      const Phong phong(options.shading, setup.camera.view_direction);
      const LocalImage image = Raycast(volume, options);
      int both = 0, one = 0, none = 0;
      for (int y = 0; y < setup.camera.height; ++y) {
        for (int x = 0; x < setup.camera.width; ++x) {
          const PixelLine line(setup, x, y);
          const Vec3 along = Normalized(line.ray.direction);
          const double nearest = Dot(centre - line.ray.origin, along);
          const double miss = Length(line.ray.origin + nearest * along - centre);
          if (std::abs(miss - kOuter) < 1 || std::abs(miss - kInner) < 1) continue;
          std::array<double, 4> expected{};
          const auto add = [&](double radius, double side, const Rgb& color, double opacity) {
            if (miss > radius) return;
            const Vec3 p = line.ray.origin + (nearest + side * std::sqrt(radius * radius - miss * miss)) * along;
            expected = Over(color, opacity, phong.AtNormal(Normalized(p - centre)), expected);
          };
          add(kOuter, 1, kRed, 0.3);
          add(kInner, 1, kBlue, inner_opacity);
          add(kInner, -1, kBlue, inner_opacity);
          add(kOuter, -1, kRed, 0.3);
          ++(miss < kInner ? both : miss < kOuter ? one : none);
          SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " opacity " << inner_opacity);
          EXPECT_NEAR(double(PixelOf(image, x, y)[3]), expected[3], 1e-5) << x << ' ' << y;
          ExpectPixel(image, x, y, expected, 0.03);  // the spheres of voxels bend a little
        }
      }
      EXPECT_GT(both, 50);
      EXPECT_GT(one, 100);
      EXPECT_GT(none, 100);
    }
  }
}

// Clipping opens the outer sphere: one passage is left of two.
TEST(Isosurfaces, AreCutOpenByClipping) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeVolume({{40, 40, 40}, {1, 1, 1}}, ScalarType::kFloat32, [](const Index3& v) {
    return -Length(ToVec3(v) - Vec3{19.5, 19.5, 19.5});
  });
  for (const ClipMode mode : {ClipMode::kKeep, ClipMode::kCutAway}) {
    SetupOptions options = RaycastOptions(Projection::kOrthographic, random);
    options.transfer = Surfaces({{-12, kRed, 0.3}});
    const Vec3 away = MakeSetup(volume, options).camera.view_direction;
    options.clipping.planes = {{away, -Dot(away, {19.5, 19.5, 19.5})}};
    options.clipping.mode = mode;
    const LocalImage image = Raycast(volume, options);
    EXPECT_NEAR(PixelOf(image, 32, 32)[3], 0.3, 1e-6);
  }
}

// No sheet is so thin that a ray passes between two samples of it.
TEST(Isosurfaces, DoNotDependOnTheSamplingRate) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeVolume({{48, 40, 44}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) { return v.x == 23 ? 200 : 0; });
  for (const Projection projection : kProjections) {
    SetupOptions options = RaycastOptions(projection, random);
    options.transfer = Surfaces({{150, kRed, 0.3}});
    const FrameSetup setup = MakeSetup(volume, options);
    const LocalImage image = Raycast(volume, options);
    for (const double rate : {0.1, 5.0}) EXPECT_LE(LargestDifference(image, Raycast(volume, options, rate)), 2e-3F) << rate;
    int seen = 0;
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        const PixelLine line(setup, x, y);
        const Vec3 p = line.At((23 - line.ray.origin.x) / line.ray.direction.x);
        if (std::min(p.y, p.z) < 2 || p.y > 37 || p.z > 41) continue;
        ++seen;
        ASSERT_NEAR(PixelOf(image, x, y)[3], 1 - 0.7 * 0.7, 1e-5) << "seed " << kSeed << " pixel " << x << ' ' << y;
      }
    }
    EXPECT_GT(seen, 100);
  }
}

// The surface of a solid is found where interpolation reaches its value, in spite of rounding.
TEST(Isosurfaces, AtTheValueOfASolidHaveNoHoles) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeVolume({{40, 40, 40}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) {
    return Length(ToVec3(v) - Vec3{19.5, 19.5, 19.5}) < 15 ? 213 : 0;
  });
  for (const Projection projection : kProjections) {
    for (int view = 0; view < 4; ++view) {
      SetupOptions options = RaycastOptions(projection, random);
      if (view == 3) options.view = {.projection = projection};
      options.transfer = Surfaces({{213, kRed, 0.3}});
      const FrameSetup setup = MakeSetup(volume, options);
      const LocalImage image = Raycast(volume, options);
      int seen = 0;
      for (int y = 0; y < setup.camera.height; ++y) {
        for (int x = 0; x < setup.camera.width; ++x) {
          const PixelLine line(setup, x, y);
          const Vec3 along = Normalized(line.ray.direction), to_centre = Vec3{19.5, 19.5, 19.5} - line.ray.origin;
          if (Length(to_centre - Dot(to_centre, along) * along) > 12) continue;
          ++seen;
          // What goes in comes out; the solid has steps, so a ray may go in twice.
          const double crossings = std::log1p(-double(PixelOf(image, x, y)[3])) / std::log1p(-0.3), pairs = std::round(crossings / 2);
          ASSERT_NEAR(crossings, 2 * pairs, 1e-3) << "seed " << kSeed << " view " << view << " pixel " << x << ' ' << y;
          ASSERT_GE(pairs, 1) << "seed " << kSeed << " view " << view << " pixel " << x << ' ' << y;
        }
      }
      EXPECT_GT(seen, 200);
    }
  }
}

// What lies behind an opaque surface is not sampled.
TEST(Isosurfaces, OpaqueOnesEndRays) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlock({{40, 40, 40}, {1, 1, 1}});
  Volume half = volume;
  for (std::size_t i = 0; i < half.block.bytes.size(); ++i) {
    if (PlaceIn({40, 40, 40}, i).y >= 20) half.block.bytes[i] = std::byte{200};
  }
  SetupOptions options = RaycastOptions(Projection::kOrthographic, random);
  options.view = {};  // along +y
  options.transfer = Uniform(0.01, {1, 1, 1});
  const auto samples = [&](const TransferFunction& transfer) {
    options.transfer = transfer;
    options.termination = kDefaultTermination;
    const FrameSetup setup = MakeSetup(half, options);
    RankReport report;
    const auto data = CutBox(half, half.block.box);
    (void)MakeRenderer(*setup.renderer)->Render(*data, half.block.box, setup, {}, RenderControl(), report).value();
    return double(report.drawn_voxels);
  };
  TransferFunction with_surface = options.transfer;
  with_surface.isosurfaces = {{150, kRed, 1}};
  EXPECT_NEAR(samples(with_surface) / samples(Uniform(0.01, {1, 1, 1})), 0.5, 0.1);
}

// Voxels from the isovalue on, as a step of the transfer function makes them opaque.
TEST(Isosurfaces, OfTheZBufferAreItsFaces) {
  std::mt19937 random(kSeed);
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
    const Volume volume = MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, type, kSeed);
    SetupOptions options;
    options.renderer = ZBuffer();
    options.view = RandomView(Projection::kPerspective, random);
    options.transfer = Surfaces({{60, kRed, 0.4}});
    const LocalImage surface = RenderPicture(volume, MakeSetup(volume, options));
    options.transfer = {{{60, kRed}}, {{0, 0}, {60, 0}, {60, 1}}};
    const LocalImage step = RenderPicture(volume, MakeSetup(volume, options));
    EXPECT_TRUE(surface.rgba == step.rgba);
    EXPECT_TRUE(surface.depth == step.depth);
    // Of several the least one is seen; the others show where clipping cuts through.
    options.transfer = Surfaces({{60, kRed, 1}, {120, kBlue, 1}});
    options.shading.model = ShadingModel::kNone;
    options.clipping.planes = {{{0, 1, 0}, -12}};
    const LocalImage cut = RenderPicture(volume, MakeSetup(volume, options));
    int red = 0, blue = 0, others = 0;
    for (std::size_t i = 0; i < cut.rgba.size(); i += 4) {
      if (cut.rgba[i + 3] != 1) continue;
      ++(cut.rgba[i] == kRed.r ? red : cut.rgba[i] == kBlue.r ? blue : others);
    }
    EXPECT_GT(red, 50);
    EXPECT_GT(blue, 20);
    EXPECT_EQ(others, 0);
  }
}

// Boxes that the planner leaves out hold no crossing; those with a crossing are drawn.
TEST(Isosurfaces, AreDrawnWhereBricksSaySo) {
  const Volume volume =
      MakeVolume({{64, 64, 64}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) { return v.x + v.y / 8 < 40 ? 0 : 200; });
  const Partition partition = CutIntoSlabs(volume, 16, Axis::kX);
  for (const RendererKind* renderer : {FindRenderer("raycast"), ZBuffer()}) {
    SetupOptions options;
    options.renderer = renderer;
    options.transfer = Surfaces({{77, kRed, 1}});
    const FrameSetup setup = MakeSetup(volume, options);
    const VolumeSummary summary = Summarize(volume);
    const BrickVisibility bricks(summary, renderer->DrawnTable(setup.transfer, summary));
    int left_out = 0, drawn = 0;
    for (const Box& box : partition.boxes()) {
      RankReport report;
      const auto data = CutBox(volume, PaddedBox(box, setup));
      (void)MakeRenderer(*renderer)->Render(*data, box, setup, {}, RenderControl(), report).value();
      if (bricks.AnyVisible(PaddedBox(box, setup))) {
        drawn += report.drawn_voxels > 0 ? 1 : 0;
      } else {
        ++left_out;
        EXPECT_EQ(report.drawn_voxels, 0U);
      }
    }
    EXPECT_GE(drawn, 2);
    EXPECT_GE(left_out, 6);
  }
}

// A ramp has one slope everywhere, a block none. Slopes are data values per unit of the world.
TEST(GradientOpacity, IsTheFactorOfTheSlope) {
  std::mt19937 random(kSeed);
  constexpr double kOpacity = 0.05, kFactor = 0.4, kOfNone = 0.7;
  const VolumeGeometry geometry{{30, 26, 28}, {0.5, 0.5, 0.75}};
  Volume ramp = MakeVolume(geometry, ScalarType::kUint8, [](const Index3& v) { return 20 + 6 * v.x; });
  ramp.description.mapping = {0.5, -3};
  Volume block = MakeBlock(geometry);
  block.description.mapping = ramp.description.mapping;
  constexpr double kSlope = 6 * 0.5 / 0.5;  // at the border a fifth of it and more
  for (const Projection projection : kProjections) {
    for (const double rate : {1.0, 0.7, 3.0}) {
      for (const double distance : {1.0, 2.0}) {
        SetupOptions options = RaycastOptions(projection, random);
        options.view.zoom = 1.5;
        options.shading.model = rate == 3 ? ShadingModel::kPhong : ShadingModel::kNone;
        options.transfer = {{{0, {1, 1, 1}}}, {{0, kOpacity}}, distance};
        options.transfer.gradient_opacities = {{0, kOfNone}, {0.1 * kSlope, kFactor}, {1.1 * kSlope, kFactor}, {1.1 * kSlope, 0}};
        const auto alpha = [&](const Volume& volume) { return Raycast(volume, options, rate); };
        const LocalImage of_ramp = alpha(ramp), of_block = alpha(block);
        options.transfer.gradient_opacities.clear();
        const LocalImage plain = alpha(block);
        int seen = 0;
        for (int y = 0; y < 64; ++y) {
          for (int x = 0; x < 64; ++x) {
            const double whole = double(PixelOf(plain, x, y)[3]);
            if (whole < 0.1) continue;
            ++seen;
            const double length = std::log1p(-whole) / std::log1p(-kOpacity);
            const auto expected = [&](double factor) { return 1 - std::pow(1 - kOpacity * factor, length); };
            ASSERT_NEAR(double(PixelOf(of_ramp, x, y)[3]), expected(kFactor), 2e-4) << "seed " << kSeed << " rate " << rate;
            ASSERT_NEAR(double(PixelOf(of_block, x, y)[3]), expected(kOfNone), 2e-4) << "seed " << kSeed << " rate " << rate;
          }
        }
        EXPECT_GT(seen, 300);
      }
    }
  }
}

// A region of one slope has its opacity in a ramp of that slope, and none in a ramp of another one. Slopes are per unit of the world.
TEST(Regions, ShowTheirSlopesAlone) {
  std::mt19937 random(kSeed);
  constexpr double kOpacity = 0.05;
  const auto ramp = [](int rise) {
    Volume volume = MakeVolume({{30, 26, 28}, {0.5, 0.5, 0.75}}, ScalarType::kUint8, [&](const Index3& v) { return 20 + rise * v.x; });
    volume.description.mapping = {0.5, -3};
    return volume;
  };
  const Volume gentle = ramp(2), steep = ramp(6);
  constexpr double kGentle = 2 * 0.5 / 0.5, kSteep = 6 * 0.5 / 0.5;
  for (const Projection projection : kProjections) {
    for (const double rate : {1.0, 3.0}) {
      SetupOptions options = RaycastOptions(projection, random);
      options.view.zoom = 1.5;
      options.shading.model = rate == 3 ? ShadingModel::kPhong : ShadingModel::kNone;
      // At the border of the volume voxels repeat, so that slopes are less.
      options.clipping.box = ClipBox{{10, 10, 10}, {90, 90, 90}, ClipUnit::kPercent};
      options.transfer = {{{0, {1, 1, 1}}}, {{0, kOpacity}}};
      const auto alpha = [&](const Volume& volume) { return Raycast(volume, options, rate); };
      const LocalImage plain = alpha(steep);
      options.transfer.regions = {
          {{{-100, 0.4 * kSteep}, {200, 0.4 * kSteep}, {200, 1.2 * kSteep}, {-100, 1.2 * kSteep}}, {1, 1, 1}, kOpacity, 0}};
      options.transfer = WithCurvesOfRegions(options.transfer);
      const LocalImage of_steep = alpha(steep), of_gentle = alpha(gentle);
      int seen = 0;
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
          if (PixelOf(plain, x, y)[3] < 0.1F) continue;
          ++seen;
          ASSERT_NEAR(double(PixelOf(of_steep, x, y)[3]), double(PixelOf(plain, x, y)[3]), 2e-4) << "seed " << kSeed << " rate " << rate;
          ASSERT_EQ(PixelOf(of_gentle, x, y)[3], 0) << "seed " << kSeed << " rate " << rate;
        }
      }
      EXPECT_GT(seen, 300);
      static_assert(kGentle < 0.4 * kSteep);
    }
  }
}

TEST(GradientOpacity, OfOneChangesNothing) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, ScalarType::kUint8, kSeed);
  for (const Projection projection : kProjections) {
    SetupOptions options = RaycastOptions(projection, random);
    const LocalImage plain = Raycast(volume, options, 2);
    options.transfer.gradient_opacities = {{5, 1}};
    EXPECT_LE(LargestDifference(plain, Raycast(volume, options, 2)), 2e-5F);
  }
}

}  // namespace
}  // namespace slabstream
