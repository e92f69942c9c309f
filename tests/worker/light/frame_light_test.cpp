// The light volume, transmittance and openness against closed forms and brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>

#include "common/volume/indices.h"
#include "common/volume/light_volume.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/light/extinction.h"
#include "worker/light/occlusion.h"
#include "worker/light/pack_shares.h"
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
  return ExtinctionOf([&](std::size_t) { return MakeLightVolume(volume.block, volume.description).block; }, setup);
}

std::vector<std::uint8_t> Transmitted(const Extinction& extinction, const Vec3& to_light) {
  const Index3& size = extinction.size;
  const Vec3 direction = Normalized(to_light);
  const bool along_y = SweepsAlongX(extinction, direction);
  std::vector<std::uint8_t> found(extinction.each.size()), out(found.size());
  FindTransmittance(extinction, along_y ? RowsAlongY(extinction) : RowsAlongX(extinction), direction, 1, found.data());
  if (!along_y) return found;
  for (const Index3& v : IndicesIn(Box{{0, 0, 0}, size})) {
    out[NumberIn(size, v)] = found[NumberIn({size.y, size.z, size.x}, {v.y, v.z, v.x})];
  }
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

TEST(LightVolume, OfIntegersHasExactMeansOnEveryInstructionSet) {
  std::mt19937 random(7);
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
    for (const Index3& size : {Index3{128, 3, 200}, Index3{141, 300, 1}, Index3{387, 130, 5}, Index3{5, 129, 140}}) {
      const auto of_any = [&](const Index3&) { return random() >> (type == ScalarType::kUint8 ? 24 : 16); };
      const Volume volume = MakeVolume({size}, type, of_any);
      Volume expected = MakeLightVolume(volume.block, volume.description);
      const Index3 blocks = expected.description.geometry.size, block = CubesOver(size, kMaxLightSide), one = {1, 1, 1};
      VisitScalarType(type, [&]<class T>(const T*) {
        for (const Index3& voxel : IndicesIn(Box{{0, 0, 0}, blocks})) {
          std::uint64_t sum = 0, count = 0;
          for (const Index3& v : IndicesIn(Intersection({voxel * block, (voxel + one) * block}, volume.block.box))) {
            sum += volume.block.samples<T>()[volume.block.Offset(v)];
            ++count;
          }
          expected.block.samples<T>()[expected.block.Offset(voxel)] = T((sum + count / 2) / count);
        }
      });
      ForEachTarget([&] {
        EXPECT_EQ(MakeLightVolume(volume.block, volume.description).block.bytes, expected.block.bytes);
        const BrickedVoxels bricks(volume.block);
        EXPECT_EQ(MakeLightVolume(bricks, volume.description).block.bytes, expected.block.bytes);
      });
    }
  }
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
    ForEachTarget([&] { EXPECT_EQ(Transmitted(extinction, to_light), expected); });
  }
}

TEST(Openness, AndItsBytesAreTheSameOnEveryInstructionSet) {
  const Volume volume = MakeBlobs({{37, 33, 41}}, ScalarType::kUint8, 5);
  const Extinction extinction = ExtinctionIn(volume, SetupOf(volume, 0.2));
  for (const double radius : {5.0, 12.0, 25.0}) {  // on the grid itself, and on coarser ones
    const std::vector<float> open = OpennessIn(extinction, radius);
    std::vector<std::uint8_t> expected, bytes(open.size());
    for (const float each : open) expected.push_back(std::uint8_t(255 * (1 - 0.75F * (1 - std::min(2 * each, 1.0F))) + 0.5F));
    ForEachTarget([&] {
      EXPECT_EQ(OpennessIn(extinction, radius), open);
      KeepOpen(open, 0.75F, bytes.data());
      EXPECT_EQ(bytes, expected);
    });
  }
}

// Of voxels in either order, each of which the shares may have, and one voxel more along each axis.
TEST(PackShares, PutsTheSharesOfEachVoxelWhereItsLightIsRead) {
  const unsigned seed = 23;
  std::mt19937 random(seed);
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (const Index3& size : {Index3{37, 70, 33}, Index3{1, 5, 64}, Index3{64, 1, 3}}) {
    Bytes255 along_x(CountIn(size)), reached_along_x(CountIn(size));
    for (Bytes255* const bytes : {&along_x, &reached_along_x}) {
      for (std::uint8_t& byte : *bytes) byte = std::uint8_t(random());
    }
    const Bytes255 along_y = TurnedBytes(along_x, size), reached_along_y = TurnedBytes(reached_along_x, size), none;
    const Index3 whole = size + Uniform(1);
    for (int order = 0; order < 8; ++order) {
      const int fast = order & 1, reached_fast = order >> 1 & 1;
      const bool has_open = order < 4;
      FrameLight light{.size = size, .lights = 2, .fast = fast};
      light.stride = fast == 0 ? std::array{2, 2 * whole.x, 2 * whole.x * whole.y} : std::array{2 * whole.y * whole.z, 2, 2 * whole.y};
      light.light = 2 * whole.x * whole.y * whole.z;
      light.shares.resize(2 * std::size_t(light.light) + FrameLight::kSharesPadding);
      PackShares(!has_open   ? none
                 : fast == 0 ? along_x
                             : along_y,
                 reached_fast == 0 ? reached_along_x : reached_along_y, reached_fast, 1, light);
      PackShares(!has_open ? none : fast == 0 ? along_x : along_y, none, 0, 0, light);
      for (const Index3& voxel : IndicesIn(Box{{0, 0, 0}, whole})) {
        const std::size_t nearest = NumberIn(size, Min(voxel, size - Uniform(1)));
        const auto at = std::size_t(voxel.x * light.stride[0] + voxel.y * light.stride[1] + voxel.z * light.stride[2]);
        for (std::size_t number = 0; number < 2; ++number) {
          const std::uint8_t* const shares = &light.shares[number * std::size_t(light.light) + at];
          ASSERT_EQ(shares[0], has_open ? along_x[nearest] : 255) << order;
          ASSERT_EQ(shares[1], number == 1 ? reached_along_x[nearest] : 255) << order;
        }
      }
    }
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

// ---- several fields

// A picture whose first field is the volume.
struct Scene {
  Volume volume;
  FrameSetup setup;
  std::vector<Volume> fields = {};

  void Show(Volume field, FieldLook look) {
    look.range = Summarize(field).range;
    setup.fields.push_back(
        {.levels = {{1, field.description}}, .of_volume = {0}, .look = look, .light = NewLightVolume(field.description)});
    fields.push_back(std::move(field));
  }
  Extinction Found() const {
    const auto light = [&](std::size_t number) {
      const Volume& of = number == 0 ? volume : fields[number - 1];
      return MakeLightVolume(of.block, of.description).block;
    };
    return ExtinctionOf(light, setup);
  }
};

float At(const Extinction& extinction, const Index3& voxel) { return extinction.each[NumberIn(extinction.size, voxel)]; }

TEST(FieldsExtinction, AddsByWeightAndIsCoveredAsFarAsAFieldIsOpaque) {
  constexpr double kA = 0.2, kB = 0.3, kDistance = 2;
  const double a = -std::log1p(-kA) / kDistance, b = -std::log1p(-kB) / kDistance;
  for (const double weight : {0.0, 0.25, 1.0}) {
    for (const double of_field : {0.0, 0.5, 1.0}) {
      Scene scene = {MakeBlock({{6, 5, 4}}), SetupOf(MakeBlock({{6, 5, 4}}), kA)};
      scene.setup.weight = weight;
      scene.setup.transfer.opacity_distance = kDistance;
      TransferFunction transfer = Uniform(kB, {1, 0, 0});
      transfer.opacity_distance = kDistance;
      scene.Show(MakeBlock({{6, 5, 4}}), {.transfer = transfer, .range = {}, .weight = of_field});
      EXPECT_NEAR(At(scene.Found(), {3, 2, 1}), weight * a + of_field * b, 1e-5) << weight << ' ' << of_field;
      scene.setup.fields[0].look.blend = Blend::kOver;
      const double left = std::pow(1 - kB, of_field);
      EXPECT_NEAR(At(scene.Found(), {3, 2, 1}), weight * a * left + of_field * b, 1e-5) << weight << ' ' << of_field;
    }
  }
}

TEST(FieldsExtinction, OfOpaqueMatterIsThatWhateverItsWeight) {
  Scene scene = {MakeBlock({{6, 5, 4}}), SetupOf(MakeBlock({{6, 5, 4}}), 1)};
  const float opaque = At(scene.Found(), {3, 2, 1});
  scene.setup.weight = 0.3;
  EXPECT_EQ(At(scene.Found(), {3, 2, 1}), opaque);
  scene.setup.weight = 0;
  EXPECT_EQ(At(scene.Found(), {3, 2, 1}), 0);
}

// A slab that another field has, on a grid that is turned, and coarser or finer: as much matter at the same place.
TEST(FieldsExtinction, LiesWhereAFieldOnAGridOfItsOwnLies) {
  constexpr double kOpacity = 0.1;
  const VolumeGeometry geometry = {{32, 30, 36}, {1, 1.2, 0.9}};
  const auto empty = [](const Index3&) { return 0; };
  for (const double spacing : {0.4, 1.0, 2.5}) {
    for (const double angle : {0.0, 0.5}) {
      VolumeGeometry grid;
      grid.orientation.axes = {Vec3{0, std::cos(angle), std::sin(angle)}, Vec3{0, -std::sin(angle), std::cos(angle)}, Vec3{1, 0, 0}};
      const auto count = std::int32_t(60 / spacing);
      grid.size = {count, count, count};
      grid.spacing = {spacing, spacing, spacing};
      const Vec3 middle = {15, 17, 16};  // of both grids, in the world
      grid.orientation.origin = middle - grid.orientation.ToWorld(spacing * 0.5 * (ToVec3(grid.size) - Vec3{1, 1, 1}));
      // 10 long along the world's x, which is the field's z.
      const auto slab = [&](const Index3& v) {
        return 100 * std::clamp((5 - std::abs(spacing * (v.z - 0.5 * (count - 1)))) / spacing + 0.5, 0.0, 1.0);
      };
      Scene scene = {MakeVolume(geometry, ScalarType::kUint8, empty), {}};
      scene.setup = SetupOf(scene.volume, 0);
      TransferFunction ramp = Uniform(0, {1, 1, 1});
      ramp.opacities = {{0, 0}, {100, kOpacity}};
      scene.Show(MakeVolume(grid, ScalarType::kFloat32, slab), {.transfer = ramp});
      const Extinction found = scene.Found();
      double sum = 0, moment = 0;
      for (std::int32_t x = 0; x < geometry.size.x; ++x) {
        sum += double(At(found, {x, 14, 18}));
        moment += x * double(At(found, {x, 14, 18}));
      }
      const double voxel = 0.9;  // the shortest side: opacities are those of such a length
      EXPECT_NEAR(sum, -10 * std::log1p(-kOpacity) / voxel, 0.02 * sum) << spacing << ' ' << angle;
      EXPECT_NEAR(moment / sum, middle.x, 0.02) << spacing << ' ' << angle;
      EXPECT_NEAR(At(found, {15, 14, 18}), -std::log1p(-kOpacity) / voxel, 1e-3) << spacing << ' ' << angle;
    }
  }
}

TEST(FieldsExtinction, EndsWhereAFieldEndsAndWhereTheClipRegionDoes) {
  const Volume empty = MakeVolume({{16, 16, 16}}, ScalarType::kUint8, [](const Index3&) { return 0; });
  Scene scene = {empty, SetupOf(empty, 0)};
  VolumeGeometry part = {{4, 16, 16}};
  part.orientation.origin = {6, 0, 0};
  scene.Show(MakeBlock(part), {.transfer = Uniform(0.5, {1, 1, 1})});
  scene.setup.clip = MakeClipRegion({.planes = {{{0, 1, 0}, -8}}}, empty.description.geometry).value();
  const Extinction found = scene.Found();
  const double full = -std::log1p(-0.5);
  for (std::int32_t x = 0; x < 16; ++x) {
    EXPECT_NEAR(At(found, {x, 12, 8}), x >= 6 && x < 10 ? full : 0, 1e-3) << x;
    EXPECT_EQ(At(found, {x, 4, 8}), 0) << x;
  }
}

// Far finer than the volume: all of its matter counts as long as it is not lost between eight places a side.
TEST(FieldsExtinction, OfAFinerFieldIsItsMean) {
  const Volume empty = MakeVolume({{4, 4, 4}, {16, 16, 16}}, ScalarType::kUint8, [](const Index3&) { return 0; });
  Scene scene = {empty, SetupOf(empty, 0)};
  VolumeGeometry fine = {{64, 64, 64}};
  fine.orientation.origin = {-7.5, -7.5, -7.5};
  scene.Show(MakeVolume(fine, ScalarType::kUint8, [](const Index3& v) { return v.x % 4 < 2 ? 100 : 0; }),
             {.transfer = Uniform(0.1, {1, 1, 1})});
  const Extinction found = scene.Found();
  // A voxel of light takes as much as two of four fine ones, and a bit more where values run from one to the next.
  const double full = -std::log1p(-0.1) / 16;
  EXPECT_GT(At(found, {1, 2, 2}), 0.5 * full);
  EXPECT_LT(At(found, {1, 2, 2}), 0.8 * full);
  EXPECT_NEAR(At(found, {2, 1, 2}), At(found, {1, 2, 2}), 1e-3 * full);
}

// What one field casts onto another is what it casts if both are one.
TEST(FrameLight, OfTwoFieldsIsThatOfOneWhichHasBoth) {
  const unsigned seed = 23;
  std::mt19937 random(seed);
  const VolumeGeometry geometry = {{48, 44, 40}, {1, 0.9, 1.1}};
  const auto ball = [&](const Vec3& middle, double radius) {
    return [=](const Index3& v) { return 100 * std::clamp(radius - Length(ToVec3(v) - middle) + 0.5, 0.0, 1.0); };
  };
  const auto a = ball({14, 20, 20}, 8), b = ball({34, 24, 20}, 7);
  const Volume both = MakeVolume(geometry, ScalarType::kUint8, [&](const Index3& v) { return std::max(a(v), b(v)); });
  FrameSetup setup = SetupOf(both, 0, 1, 1);
  setup.transfer = Ramp(0.4);
  setup.shading.lights = {{1, 0, 0}, {-1, 0.4, 0.3}};
  setup.range = {0, 100};
  const auto expected = LightOf(both, setup);
  Scene scene = {MakeVolume(geometry, ScalarType::kUint8, a), setup};
  const CoarserLevel light = NewLightVolume(scene.volume.description);
  scene.setup.light = light;
  scene.Show(MakeVolume(geometry, ScalarType::kUint8, b), {.transfer = setup.transfer});
  const auto found = LightOf(scene.volume, scene.setup, scene.fields);
  FrameSetup first_alone = scene.setup;
  first_alone.fields.clear();
  const auto alone = LightOf(scene.volume, first_alone);
  double most = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = {double(random() % 48), double(random() % 44), double(random() % 40)};
    const FrameLight::Shares of_both = expected->At(p), of_two = found->At(p), of_first = alone->At(p);
    EXPECT_NEAR(of_two.open, of_both.open, 0.02) << "seed " << seed;
    for (std::size_t n = 0; n < 2; ++n) {
      EXPECT_NEAR(of_two.reached[n], of_both.reached[n], 0.02) << "seed " << seed;
      most = std::max(most, double(of_first.reached[n] - of_two.reached[n]));
    }
  }
  EXPECT_GT(most, 0.5) << "the second field casts a shadow";
}

TEST(FrameLight, IsMadeAnewIfAFieldsMatterChanges) {
  Scene scene = {MakeBlobs({{40, 40, 40}}, ScalarType::kUint8, 7), {}};
  scene.setup = SetupOf(scene.volume, 0.1, 1, 1);
  scene.Show(MakeBlobs({{40, 40, 40}}, ScalarType::kUint8, 8), {.transfer = Ramp(0.1)});
  const auto light = [&] { return LightOf(scene.volume, scene.setup, scene.fields); };
  const auto first = light();
  for (ColorPoint& point : scene.setup.transfer.colors) point.color = {0, 1, 0};
  for (ColorPoint& point : scene.setup.fields[0].look.transfer.colors) point.color = {0, 1, 0};
  const auto recoloured = light();
  EXPECT_EQ(recoloured, first) << "colours take no light";
  scene.setup.weight = 0.5;
  EXPECT_NE(light(), first);
  scene.setup.weight = 1;
  scene.setup.fields[0].look.weight = 0.5;
  EXPECT_NE(light(), first);
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
