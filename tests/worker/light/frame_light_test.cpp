// The light volume, transmittance and openness against closed forms and brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>

#include "common/volume/light_volume.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/light/extinction.h"
#include "worker/light/occlusion.h"
#include "worker/light/transmittance.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Voxels with value 100 take 1 - opacity of the light that passes a voxel length.
FrameSetup SetupOf(const Volume& volume, double opacity, float shadows = 1, float occlusion = 0) {
  SetupOptions options;
  options.renderer = FindRenderer("raycast");
  options.transfer = Uniform(opacity, {1, 1, 1});
  options.shading.shadows = shadows;
  options.shading.ambient_occlusion = occlusion;
  return MakeSetup(volume, options);
}

Extinction ExtinctionIn(const Volume& volume, const FrameSetup& setup) {
  return ExtinctionOf(MakeLightVolume(volume.block, volume.description).block, setup);
}

std::vector<std::uint8_t> Transmitted(const Extinction& extinction, const Vec3& to_light) {
  std::vector<std::uint8_t> out(extinction.each.size());
  FindTransmittance(extinction, Turned(extinction), Normalized(to_light), 1, out.data());
  return out;
}

std::vector<float> OpennessIn(const Extinction& extinction, double radius) {
  std::vector<float> open(extinction.each.size());
  FindOpenness(extinction, radius,
               [&](std::size_t first, std::span<const float> row) { std::ranges::copy(row, open.begin() + std::ptrdiff_t(first)); });
  return open;
}

// Where matter is by one linear function of the extinction, interpolated as transmittance of a step is.
double ByBruteForce(const Extinction& extinction, const Vec3& from, const Vec3& to_light, double begin, double end, double step) {
  double sum = 0;
  for (double t = begin + step / 2; t < end; t += step) {
    const Vec3 p = from + t * (to_light / extinction.spacing);
    double value = 0;
    const Index3 low = {int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z))};
    for (int corner = 0; corner < 8; ++corner) {
      const Index3 at = low + Index3{corner & 1, corner >> 1 & 1, corner >> 2};
      if (!Box{{0, 0, 0}, extinction.size}.Contains(at)) continue;
      double weight = 1;
      for (const Axis axis : kAxes) weight *= 1 - std::abs(p[axis] - at[axis]);
      value += weight * double(extinction.each[NumberIn(extinction.size, at)]);
    }
    sum += value * step;
  }
  return std::exp(-sum);
}

TEST(LightVolume, HasTheMeansOfBlocksAndLiesWhereTheVolumeLies) {
  const VolumeGeometry geometry = {{300, 5, 129}, {1, 2, 0.5}, {.origin = {10, 20, 30}}};
  const Volume volume = MakeVolume(geometry, ScalarType::kUint16, [](const Index3& v) { return 3 * v.x + 100 * v.y + 7 * v.z; });
  const Volume light = MakeLightVolume(volume.block, volume.description);
  EXPECT_EQ(light.description.geometry.size, (Index3{100, 5, 65}));
  EXPECT_EQ(light.description.geometry.spacing, (Vec3{3, 2, 1}));
  EXPECT_EQ(light.description.geometry.orientation.origin, (Vec3{11, 20, 30.25}));
  const auto* samples = light.block.samples<std::uint16_t>();
  EXPECT_EQ(samples[light.block.Offset({0, 0, 0})], 7) << "3 + 3.5, rounded";
  EXPECT_EQ(samples[light.block.Offset({99, 4, 0})], 3 * 298 + 400 + 4);
  EXPECT_EQ(samples[light.block.Offset({0, 0, 64})], 3 + 7 * 128) << "the last block has one slice";
}

TEST(LightVolume, LeavesOutSamplesThatAreNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Volume volume = MakeVolume({{256, 2, 2}}, ScalarType::kFloat32, [&](const Index3& v) { return v.x < 2 || v.x == 5 ? nan : 4.0; });
  const Volume light = MakeLightVolume(volume.block, volume.description);
  EXPECT_TRUE(std::isnan(light.block.samples<float>()[0]));
  EXPECT_EQ(light.block.samples<float>()[light.block.Offset({2, 0, 0})], 4);
}

TEST(Extinction, AddsUpToThatOfTheMatterAlongAnAxis) {
  constexpr double kOpacity = 0.1;
  const Volume volume =
      MakeVolume({{8, 8, 40}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) { return v.z >= 10 && v.z < 22 ? 100 : 0; });
  const FrameSetup setup = SetupOf(volume, kOpacity);
  const Extinction extinction = ExtinctionIn(volume, setup);
  double sum = 0;
  for (int z = 0; z < 40; ++z) sum += double(extinction.each[NumberIn(extinction.size, {4, 4, z})]);
  // Values from 1 on have the opacity, so the interpolated slab is nearly a voxel longer.
  EXPECT_NEAR(sum, -12.99 * std::log1p(-kOpacity), 0.01);
}

TEST(Extinction, OfAnIsosurfaceIsItsOpacityOnce) {
  const Volume volume = MakeVolume({{8, 8, 40}}, ScalarType::kUint8, [](const Index3& v) { return 5 * v.z; });
  FrameSetup setup = SetupOf(volume, 0);
  setup.transfer.isosurfaces = {{101, {1, 1, 1}, 0.4}};
  const Extinction extinction = ExtinctionIn(volume, setup);
  double sum = 0;
  for (int z = 0; z < 40; ++z) sum += double(extinction.each[NumberIn(extinction.size, {4, 4, z})]);
  EXPECT_NEAR(sum, -std::log1p(-0.4), 1e-3);
}

// The same as by a curve where the slope lies in the region, and nothing elsewhere.
TEST(Extinction, OfRegionsDependsOnTheSlope) {
  constexpr double kOpacity = 0.1;
  const Volume volume =
      MakeVolume({{8, 8, 60}, {1, 1, 2}}, ScalarType::kUint8, [](const Index3& v) { return v.z < 30 ? 3 * v.z : 90 + 2 * (v.z - 30); });
  FrameSetup setup = SetupOf(volume, kOpacity);
  setup.transfer = WithCurvesOfRegions(
      {.colors = {}, .opacities = {}, .regions = {{{{-50, 1.25}, {300, 1.25}, {300, 5}, {-50, 5}}, {1, 1, 1}, kOpacity, 0}}});
  const Extinction extinction = ExtinctionIn(volume, setup);
  for (int z = 1; z < 59; ++z) {
    if (z == 30) continue;  // a mean of both slopes
    const double expected = z < 30 ? -std::log1p(-kOpacity) : 0;
    EXPECT_NEAR(extinction.each[NumberIn(extinction.size, {4, 4, z})], expected, 1e-4) << z;
  }
}

TEST(Extinction, OfWhatIsClippedAwayIsNothing) {
  const Volume volume = MakeBlock({{16, 16, 16}});
  FrameSetup setup = SetupOf(volume, 0.5);
  setup.clip = MakeClipRegion({.planes = {{{1, 0, 0}, -8}}}, volume.description.geometry).value();
  const Extinction extinction = ExtinctionIn(volume, setup);
  EXPECT_EQ(extinction.each[NumberIn(extinction.size, {7, 8, 8})], 0);
  EXPECT_NEAR(extinction.each[NumberIn(extinction.size, {8, 8, 8})], -0.5 * std::log1p(-0.5), 1e-3) << "the plane halves the voxel";
  EXPECT_NEAR(extinction.each[NumberIn(extinction.size, {9, 8, 8})], -std::log1p(-0.5), 1e-3);
}

// Of any samples, by a sum over the values between a voxel and its neighbours; the same on every instruction set.
TEST(Extinction, IsTheMeanOverValuesHalfwayToTheNeighbours) {
  const unsigned seed = 17;
  std::mt19937 random(seed);
  constexpr double kMost = 0.4;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const VolumeGeometry geometry = {{37, 6, 5}};  // rows end within a register
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kFloat32}) {
    const auto sample = [&](const Index3& v) {
      const int value = int(random() % 256);
      if (type == ScalarType::kFloat32 && value % 16 == 0) return double(nan);
      return v.x < 20 || value >= 100 ? double(value) : 0;
    };
    const Volume volume = MakeVolume(geometry, type, sample);
    FrameSetup setup = SetupOf(volume, 0);
    setup.transfer = {.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0}, {80, 0}, {80 + 128, kMost}, {256, kMost}}};
    setup.range = {0, 255};
    const auto value_at = [&](const Index3& at) {
      const std::size_t i = NumberIn(geometry.size, at);
      return type == ScalarType::kUint8 ? double(volume.block.samples<std::uint8_t>()[i]) : double(volume.block.samples<float>()[i]);
    };
    const auto mean = [](double from, double to) {
      constexpr int kSteps = 200;
      double sum = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double value = from + (i + 0.5) / kSteps * (to - from);
        sum -= std::log1p(-kMost * std::clamp((value - 80) / 128, 0.0, 1.0));
      }
      return sum / kSteps;
    };
    const Extinction extinction = ExtinctionIn(volume, setup);
    for (std::size_t i = 0; i < extinction.each.size(); ++i) {
      const Index3 at = {int(i % 37), int(i / 37 % 6), int(i / (37 * 6))};
      const double value = value_at(at);
      double expected = 0;
      if (std::isfinite(value)) {
        double least = value, greatest = value;
        for (const Axis axis : kAxes) {
          for (const int step : {-1, 1}) {
            Index3 near = at;
            near[axis] = std::clamp(near[axis] + step, 0, geometry.size[axis] - 1);
            if (value_at(near) < least) least = value_at(near);
            if (value_at(near) > greatest) greatest = value_at(near);
          }
        }
        expected = (mean((value + least) / 2, value) + mean(value, (value + greatest) / 2)) / 2;
      }
      ASSERT_NEAR(extinction.each[i], expected, 1e-3) << "seed " << seed << " voxel " << at.x << ' ' << at.y << ' ' << at.z;
    }
    ForEachTarget([&] { EXPECT_EQ(ExtinctionIn(volume, setup).each, extinction.each); });
  }
}

// A slab between light and floor takes of the light what its length along the light's rays takes.
TEST(Transmittance, BehindASlabIsThatOfTheSlabFromEveryDirection) {
  constexpr double kOpacity = 0.05;
  for (const VolumeGeometry& geometry : {VolumeGeometry{{60, 60, 60}}, VolumeGeometry{{60, 50, 40}, {1, 1.2, 1.6}}}) {
    for (const Axis axis : kAxes) {
      const Volume volume =
          MakeVolume(geometry, ScalarType::kUint8, [&](const Index3& v) { return v[axis] >= 20 && v[axis] < 28 ? 100 : 0; });
      const Extinction extinction = ExtinctionIn(volume, SetupOf(volume, kOpacity));
      for (const Vec3& way : {Vec3{0, 0, 1}, Vec3{0.2, 0.3, 1}, Vec3{-0.6, 0.1, 1}, Vec3{0.5, -0.55, 1}}) {
        for (const double side : {-1.0, 1.0}) {
          Vec3 to_light;
          to_light[axis] = side * way.z;
          to_light[kAxes[std::size_t(Number(axis) + 1) % 3]] = way.x;
          to_light[kAxes[std::size_t(Number(axis) + 2) % 3]] = way.y;
          to_light = Normalized(to_light);
          const std::vector<std::uint8_t> reached = Transmitted(extinction, to_light);
          Index3 floor = geometry.size / 2;
          floor[axis] = side > 0 ? 16 : 31;
          const double voxel = Least(geometry.spacing), length = 8.99 * geometry.spacing[axis] / std::abs(to_light[axis]);
          const double expected = std::pow(1 - kOpacity, length / voxel);
          EXPECT_NEAR(reached[NumberIn(geometry.size, floor)] / 255.0, expected, 0.01) << Letter(axis) << ' ' << way.x << ' ' << side;
          floor[axis] = side > 0 ? 35 : 3;
          EXPECT_EQ(reached[NumberIn(geometry.size, floor)], 255) << "before the slab";
        }
      }
    }
  }
}

TEST(Transmittance, OfAnyMatterIsThatOfRaysThroughIt) {
  const unsigned seed = 31;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Volume volume = MakeBlobs({{48, 40, 44}, {1, 1.1, 0.9}}, ScalarType::kUint8, seed);
  FrameSetup setup = SetupOf(volume, 0.1);
  setup.transfer = Ramp(0.08);
  const Extinction extinction = ExtinctionIn(volume, setup);
  for (int light = 0; light < 6; ++light) {
    const Vec3 to_light = Normalized({normal(random), normal(random), normal(random)});
    const std::vector<std::uint8_t> reached = Transmitted(extinction, to_light);
    const Vec3 planes = Absolute(to_light / extinction.spacing);
    const double step = 1 / std::max({planes.x, planes.y, planes.z});
    double squares = 0;
    constexpr int kPlaces = 400;
    for (int i = 0; i < kPlaces; ++i) {
      const Index3 at = {int(random() % 48), int(random() % 40), int(random() % 44)};
      const double expected = ByBruteForce(extinction, ToVec3(at), to_light, kShadowOffset * step, 100, 0.05);
      squares += std::pow(reached[NumberIn(extinction.size, at)] / 255.0 - expected, 2);
    }
    EXPECT_LT(std::sqrt(squares / kPlaces), 0.02) << "seed " << seed << " light " << light;
  }
}

TEST(Transmittance, IsTheSameOnEveryInstructionSet) {
  const Volume volume = MakeBlobs({{37, 33, 41}}, ScalarType::kUint8, 5);
  const Extinction extinction = ExtinctionIn(volume, SetupOf(volume, 0.2));
  for (const Vec3& to_light : {Vec3{1, 0.3, -0.4}, Vec3{0.1, -1, 0.7}, Vec3{0.5, 0.6, 1}}) {
    const std::vector<std::uint8_t> expected = Transmitted(extinction, to_light);
    const std::vector<float> open = OpennessIn(extinction, 5);
    ForEachTarget([&] {
      EXPECT_EQ(Transmitted(extinction, to_light), expected);
      EXPECT_EQ(OpennessIn(extinction, 5), open);
    });
  }
}

TEST(Openness, IsOneInTheOpenHalfOnAWallAndNearlyNothingInMatter) {
  const Volume volume = MakeVolume({{48, 48, 48}}, ScalarType::kUint8, [](const Index3& v) { return v.z < 24 ? 100 : 0; });
  const Extinction extinction = ExtinctionIn(volume, SetupOf(volume, 1));
  const std::vector<float> open = OpennessIn(extinction, 5);
  const auto at = [&](int z) { return open[NumberIn(extinction.size, {24, 24, z})]; };
  EXPECT_EQ(at(40), 1);
  EXPECT_NEAR(at(24), 0.5, 0.2);
  EXPECT_LT(at(16), 0.02);
  EXPECT_LT(at(24), at(26));
}

// Matter as thick as a smooth fog: 26 directions suffice for the mean over all.
TEST(Openness, InsideACaveIsThatOfManyRays) {
  constexpr double kRadius = 8;
  const Vec3 middle = {32, 32, 32};
  const Volume volume = MakeVolume({{64, 64, 64}}, ScalarType::kUint8, [&](const Index3& v) {
    const double hollow = Length(ToVec3(v) - middle), ball = Length(ToVec3(v) - middle - Vec3{4, 0, 0});
    return 200 * std::clamp(std::max(hollow - 13, 5 - ball) / 3, 0.0, 1.0);
  });
  FrameSetup setup = SetupOf(volume, 0.1);
  setup.transfer = Ramp(0.25);
  const Extinction extinction = ExtinctionIn(volume, setup);
  const std::vector<float> open = OpennessIn(extinction, kRadius);
  double squares = 0;
  int places = 0;
  constexpr int kRays = 400;
  for (int z = 20; z < 44; z += 5) {
    for (int y = 20; y < 44; y += 5) {
      for (int x = 20; x < 44; x += 5, ++places) {
        double sum = 0;
        for (int ray = 0; ray < kRays; ++ray) {  // a spiral of equal areas
          const double height = 1 - (2 * ray + 1.0) / kRays, around = std::sqrt(1 - height * height), angle = 2.399963 * ray;
          sum += ByBruteForce(extinction, {double(x), double(y), double(z)}, {around * std::cos(angle), around * std::sin(angle), height},
                              0.5, kRadius + 0.5, 0.25);
        }
        squares += std::pow(open[NumberIn(extinction.size, {x, y, z})] - sum / kRays, 2);
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / places), 0.02);
}

TEST(FrameLight, IsFoundFromVoxelsOfTheVolumeAndStaysWithinItsValues) {
  const Volume volume = MakeVolume({{256, 40, 40}}, ScalarType::kUint8, [](const Index3& v) { return v.x >= 60 && v.x < 80 ? 100 : 0; });
  FrameSetup setup = SetupOf(volume, 0.05, 1, 1);
  setup.shading.lights = {{1, 0, 0}, {-1, 0, 0}};
  const std::shared_ptr<const FrameLight> light = LightOf(volume, setup);
  const FrameLight::Shares left = light->At({20, 20, 20}), right = light->At({120, 20, 20}), far = light->At({-100, 900, 20});
  const double slab = std::pow(0.95, 20.99);
  EXPECT_NEAR(left.reached[0], slab, 0.02);
  EXPECT_EQ(left.reached[1], 1);
  EXPECT_EQ(right.reached[0], 1);
  EXPECT_NEAR(right.reached[1], slab, 0.02);
  EXPECT_GE(far.open, 0.0F);
  EXPECT_LE(far.open, 1.0F);
  EXPECT_NEAR(far.reached[0], slab, 0.02) << "as at the border";
}

TEST(FrameLight, OfHalfTheStrengthIsHalfAsDark) {
  const Volume volume = MakeBlobs({{40, 40, 40}}, ScalarType::kUint8, 7);
  FrameSetup full = SetupOf(volume, 0.1, 1, 1), half = full;
  half.shading.shadows = half.shading.ambient_occlusion = 0.5F;
  const auto a = LightOf(volume, full), b = LightOf(volume, half);
  for (int i = 0; i < 40; ++i) {
    const FrameLight::Shares of_full = a->At({double(i), 39.0 - i, 20}), of_half = b->At({double(i), 39.0 - i, 20});
    EXPECT_NEAR(1 - of_half.open, (1 - of_full.open) / 2, 0.005);
    EXPECT_NEAR(1 - of_half.reached[0], (1 - of_full.reached[0]) / 2, 0.005);
  }
}

TEST(FrameLight, IsMadeOnceForVolumeFunctionAndLight) {
  const Volume volume = MakeBlobs({{40, 40, 40}}, ScalarType::kUint8, 7);
  FrameSetup setup = SetupOf(volume, 0.1, 1, 1);
  setup.shading.lights = {{0, 0, 1}};
  const auto first = LightOf(volume, setup);
  setup.camera.view_direction = Normalized({1, 2, 3});
  setup.shading.specular = 0.7F;
  for (ColorPoint& point : setup.transfer.colors) point.color = {0, 1, 0};
  EXPECT_EQ(LightOf(volume, setup), first) << "neither view nor colours matter";
  setup.shading.lights = {{0, 1, 1}};
  EXPECT_NE(LightOf(volume, setup), first);
  setup.shading.lights = {{0, 0, 1}};
  setup.transfer = Ramp(0.3);
  EXPECT_NE(LightOf(volume, setup), first);
}

}  // namespace
}  // namespace slabstream
