// Picking against analytic truth, and against the depths of the Z-buffer's frames.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "coordinator/probe/percentiles.h"
#include "coordinator/probe/pick.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr double kRadius = 11;  // of the ball, in the unit of the spacing

// Its value falls linearly from `kRadius` in the centre to 0 on the surface and below outside.
Volume MakeBall(const VolumeGeometry& geometry) {
  return MakeVolume(geometry, ScalarType::kFloat32,
                    [&](const Index3& voxel) { return kRadius - Length((ToVec3(voxel) - geometry.centre()) * geometry.spacing); });
}

// Depth at which the ray enters the ball; none: it misses it. `reach`: how near it comes to the centre.
std::optional<double> EntersBall(const Camera::Ray& ray, const VolumeGeometry& geometry, double& reach) {
  const Vec3 from = (ray.origin - geometry.centre()) * geometry.spacing, along = ray.direction * geometry.spacing;
  const double a = Dot(along, along), b = Dot(from, along), c = Dot(from, from) - kRadius * kRadius;
  reach = std::sqrt(std::max(Dot(from, from) - b * b / a, 0.0));
  const double root = b * b - a * c;
  return root < 0 ? std::nullopt : std::optional((-b - std::sqrt(root)) / a);
}

std::optional<Picked> PickIn(const Volume& volume, const FrameSetup& setup, double x, double y) {
  return Pick(setup, {.voxels = VoxelBricks(volume.block)}, x, y);
}

TEST(Pick, SmoothSurfaceOfALabelIsHitWhereTheRayEntersIt) {
  constexpr std::uint64_t kLabel = std::uint64_t{7} << 40;
  const Volume ball = MakeBall({{30, 26, 34}, {1, 1.2, 0.9}});
  const auto label = [&](const Index3& voxel) {
    return ball.block.samples<float>()[ball.block.Offset(voxel)] > 0 ? kLabel : std::uint64_t{0};
  };
  VolumeDescription labels = ball.description;
  labels.type = ScalarType::kUint64;
  std::mt19937 random(9);
  double error[2] = {0, 0};  // blocky, smooth
  for (int i = 0; i < 6; ++i) {
    SetupOptions options{.renderer = FindRenderer("raycast"), .view = RandomView(kProjections[i % 2], random)};
    options.transfer = {.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0}}};
    FrameSetup setup = MakeSetup(ball, options);
    for (const bool smooth : {false, true}) {
      setup.fields = {{.levels = {{3, labels}}, .of_volume = {0}, .labels = LabelLook{.mode = LabelMode::kSurface, .smooth = smooth}}};
      for (int y = 2; y < 64; y += 5) {
        for (int x = 2; x < 64; x += 5) {
          double reach = 0;
          const int s = setup.camera.supersample;
          const auto truth = EntersBall(setup.camera.RayAt((x + 0.5) * s, (y + 0.5) * s), ball.description.geometry, reach);
          const auto picked = Pick(setup, {.voxels = VoxelBricks(ball.block), .label = label}, x + 0.5, y + 0.5);
          if (reach > 0.9 * kRadius && reach < 1.1 * kRadius) continue;
          ASSERT_EQ(picked.has_value(), truth.has_value()) << x << ", " << y;
          if (!truth) continue;
          error[smooth ? 1 : 0] += std::abs(picked->depth - *truth);
          if (smooth) {
            EXPECT_NEAR(picked->depth, *truth, 0.7) << x << ", " << y;
          }
        }
      }
    }
  }
  EXPECT_LT(error[1], 0.6 * error[0]);
}

TEST(Pick, IsosurfaceOfABallIsHitWhereTheRayEntersIt) {
  const Volume ball = MakeBall({{30, 26, 34}, {1, 1.2, 0.9}});
  for (const Projection projection : kProjections) {
    std::mt19937 random(7);
    for (int i = 0; i < 6; ++i) {
      SetupOptions options{.renderer = FindRenderer("raycast"), .view = RandomView(projection, random)};
      options.transfer = {.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0}}, .opacity_distance = 1, .isosurfaces = {{0, {1, 1, 1}, 1}}};
      const FrameSetup setup = MakeSetup(ball, options);
      int hits = 0, steep = 0, in_ball = 0;
      for (int y = 2; y < 64; y += 5) {
        for (int x = 2; x < 64; x += 5) {
          double reach = 0;
          const int s = setup.camera.supersample;
          const auto truth = EntersBall(setup.camera.RayAt((x + 0.5) * s, (y + 0.5) * s), ball.description.geometry, reach);
          const auto picked = PickIn(ball, setup, x + 0.5, y + 0.5);
          if (std::abs(reach - kRadius) < 0.3) continue;  // the interpolated surface lies a little inside
          ASSERT_EQ(picked.has_value(), truth.has_value()) << x << ", " << y;
          if (!truth) continue;
          ++hits;
          EXPECT_NEAR(picked->depth, *truth, reach > 0.9 * kRadius ? 0.3 : 0.06) << x << ", " << y;
          const Camera::ImagePoint back = setup.camera.Project(picked->at);
          EXPECT_NEAR(back.x, (x + 0.5) * s, 1e-6);
          EXPECT_NEAR(back.y, (y + 0.5) * s, 1e-6);
          EXPECT_NEAR(back.depth, picked->depth, 1e-9);
          if (reach > 0.7 * kRadius) continue;
          ++steep;
          in_ball += (ProbeVolume{.voxels = VoxelBricks(ball.block)}).StoredAt(picked->voxel) > 0 ? 1 : 0;
        }
      }
      EXPECT_GT(hits, 5);
      EXPECT_GE(in_ball, 0.9 * steep) << "the voxel is one of the ball, although the point lies between voxels";
    }
  }
}

// In a homogeneous medium of extinction k for each voxel length, light is halved after ln 2 / k.
TEST(Pick, HalfOfTheLightIsLostAfterTheKnownDepth) {
  const Volume block = MakeBlock({{20, 24, 18}, {1, 0.5, 2}});
  for (const char* renderer : {"splat", "raycast"}) {
    for (const double opacity : {0.1, 0.3, 0.9}) {
      SetupOptions options{.renderer = FindRenderer(renderer), .view = {.azimuth_degrees = 0}};
      options.transfer = Uniform(opacity, {1, 1, 1});
      const FrameSetup setup = MakeSetup(block, options);
      const auto picked = PickIn(block, setup, 31.7, 32.9);
      ASSERT_TRUE(picked);
      const double k = -std::log1p(-opacity), least = 0.5;
      EXPECT_NEAR(picked->at.y, -0.5 + std::log(2.0) / k, 0.02) << renderer << opacity;
      EXPECT_NEAR((picked->at.y + 0.5) * least, std::log(2.0) / k * least, 0.01);
    }
    SetupOptions thin{.renderer = FindRenderer(renderer)};
    thin.transfer = Uniform(0.01, {1, 1, 1});
    EXPECT_FALSE(PickIn(block, MakeSetup(block, thin), 32, 32)) << "the whole ray meets less than half";
  }
}

// The ball's slope is 1 everywhere.
TEST(Pick, HitsWhatRegionsShow) {
  const Volume ball = MakeBall({{30, 30, 30}, {1, 1, 1}});
  SetupOptions options{.renderer = FindRenderer("raycast")};
  const auto hit = [&](double least, double most) {
    options.transfer = WithCurvesOfRegions(
        {.colors = {}, .opacities = {}, .regions = {{{{0, least}, {20, least}, {20, most}, {0, most}}, {1, 1, 1}, 0.99, 0}}});
    return PickIn(ball, MakeSetup(ball, options), 32, 32).has_value();
  };
  EXPECT_TRUE(hit(0.8, 1.2));
  EXPECT_FALSE(hit(1.5, 3));
}

TEST(Pick, IsTheDepthOfTheZBuffer) {
  std::mt19937 random(3);
  for (const Projection projection : kProjections) {
    for (const ClipMode mode : {ClipMode::kKeep, ClipMode::kCutAway}) {
      for (unsigned seed = 1; seed < 5; ++seed) {
        const Volume blobs = MakeBlobs({{22, 18, 26}, {1, 1.5, 0.8}}, seed % 2 == 0 ? ScalarType::kUint8 : ScalarType::kUint16, seed);
        SetupOptions options{.renderer = ZBuffer(), .view = RandomView(projection, random)};
        options.transfer = Uniform(1, {1, 1, 1});
        options.view.zoom *= 2;
        if (seed > 1) options.clipping = RandomClipping(blobs.description.geometry, random);
        options.clipping.mode = mode;
        const FrameSetup setup = MakeSetup(blobs, options);
        ASSERT_EQ(setup.camera.supersample, 1);
        const LocalImage image = RenderWhole(blobs, setup);
        int seen = 0, wrong = 0;
        for (int y = 0; y < 64; ++y) {
          for (int x = 0; x < 64; ++x) {
            const PixelBounds& b = image.bounds;
            const bool stored = x >= b.x_begin && x < b.x_end && y >= b.y_begin && y < b.y_end;
            const float depth = stored ? image.depth[std::size_t((y - b.y_begin) * b.width() + x - b.x_begin)] : INFINITY;
            const auto picked = PickIn(blobs, setup, x + 0.5, y + 0.5);
            const bool both = std::isfinite(depth) == picked.has_value();
            wrong += both && (!picked || std::abs(picked->depth - double(depth)) < 1e-3) ? 0 : 1;
            if (picked) {
              EXPECT_GT((ProbeVolume{.voxels = VoxelBricks(blobs.block)}).StoredAt(picked->voxel), 0) << x << ", " << y;
            }
            seen += picked ? 1 : 0;
          }
        }
        EXPECT_LE(wrong, 3) << "rays that graze an edge may differ: seed " << seed << ", " << seen << " seen";
        if (seed == 1) {
          EXPECT_GT(seen, 200);
        }
      }
    }
  }
}

TEST(Pick, ProjectionsShowTheirExtreme) {
  const Index3 bright = {5, 11, 7}, dark = {13, 3, 9};
  const Volume volume = MakeVolume({{20, 20, 20}, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3& voxel) {
    return voxel == bright ? 200 : voxel == dark ? 10 : 100;
  });
  SetupOptions options{.renderer = FindRenderer("mip"), .view = {.azimuth_degrees = 30, .elevation_degrees = 20}};
  FrameSetup setup = MakeSetup(volume, options);
  const auto near = [&](const Index3& voxel) {
    const Camera::ImagePoint at = setup.camera.Project(ToVec3(voxel));
    const int s = setup.camera.supersample;
    const auto picked = PickIn(volume, setup, at.x / s, at.y / s);
    return picked && Length(picked->at - ToVec3(voxel)) < 0.3;
  };
  EXPECT_TRUE(near(bright));
  EXPECT_FALSE(near(dark));
  SetParameters({1, 1, 0}, setup);
  EXPECT_TRUE(near(dark));
  SetParameters({1, 2, 0}, setup);
  EXPECT_FALSE(PickIn(volume, setup, 32, 32)) << "no point has the mean";
}

TEST(Pick, ClippedAwayIsNotPicked) {
  const Volume block = MakeBlock({{20, 20, 20}, {1, 1, 1}});
  SetupOptions options{.renderer = FindRenderer("raycast")};
  options.transfer = Uniform(1, {1, 1, 1});
  options.clipping.box = ClipBox{{-1e9, 7.5, -1e9}, {1e9, 1e9, 1e9}};
  const auto picked = PickIn(block, MakeSetup(block, options), 32, 32);
  ASSERT_TRUE(picked);
  EXPECT_NEAR(picked->at.y, 7.5, 0.01);
  options.clipping.mode = ClipMode::kCutAway;
  EXPECT_NEAR(PickIn(block, MakeSetup(block, options), 32, 32)->at.y, -0.5, 0.01);
  options.clipping.box = ClipBox{{100, 100, 100}, {200, 200, 200}};
  options.clipping.mode = ClipMode::kKeep;
  EXPECT_FALSE(PickIn(block, MakeSetup(block, options), 32, 32));
}

TEST(SampleAt, IsTheVoxelThatHoldsThePoint) {
  VolumeGeometry geometry{{4, 5, 6}, {2, 1, 0.5}};
  geometry.orientation = {.world = World::kPatient, .origin = {-10, 3, 7}, .axes = {Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}};
  Volume volume = MakeVolume(geometry, ScalarType::kFloat32, [](const Index3& v) {
    return v == Index3{1, 1, 1} ? NAN : v.x + 10 * v.y + 100 * v.z;
  });
  const VolumeSummary summary = Summarize(volume);
  const ProbeVolume probe{.voxels = VoxelBricks(volume.block)};
  const VolumeSample sample = SampleAt(probe, summary, geometry.ToWorld({2.4, 3.6, 4.49}));
  EXPECT_TRUE(sample.inside);
  EXPECT_EQ(sample.voxel, (Index3{2, 4, 4}));
  EXPECT_EQ(sample.value, 2 + 40 + 400);
  EXPECT_FALSE(sample.label);
  EXPECT_FALSE(SampleAt(probe, summary, geometry.ToWorld({1, 1, 1})).value) << "not finite";
  EXPECT_TRUE(SampleAt(probe, summary, geometry.ToWorld({-0.49, 0, 5.49})).inside);
  for (const Vec3& p : {Vec3{-0.51, 0, 0}, Vec3{0, 4.51, 0}, Vec3{1e300, -1e300, 0}})
    EXPECT_FALSE(SampleAt(probe, summary, geometry.ToWorld(p)).inside);
}

TEST(SampleAt, TellsTheExactValue) {
  const Volume volume = MakeVolume({{2, 1, 1}, {1, 1, 1}}, ScalarType::kFloat32, [](const Index3&) { return 0x1p60; });
  const VolumeSummary summary = Summarize(volume);
  ProbeVolume probe{.voxels = VoxelBricks(volume.block)};
  EXPECT_EQ(SampleAt(probe, summary, {1, 0, 0}).rest, 0);
  probe.exact = [](const Index3& voxel) { return ExactValue{0x1p60, voxel.x}; };
  const VolumeSample sample = SampleAt(probe, summary, {1, 0, 0});
  EXPECT_EQ(sample.value, 0x1p60);
  EXPECT_EQ(sample.rest, 1);
}

TEST(Percentiles, AreThoseOfAllFiniteVoxels) {
  const Volume ramp =
      MakeVolume({{256, 4, 4}, {1, 1, 1}}, ScalarType::kFloat32, [](const Index3& v) { return v.y == 0 && v.z == 0 ? NAN : v.x; });
  const VolumeSummary summary = Summarize(ramp);
  double last = -1;
  for (const double percent : kPercents) {
    const double value = PercentileOf(summary, percent);
    EXPECT_NEAR(value, 2.55 * percent, 255.0 / kHistogramBins + 1e-9);
    EXPECT_GT(value, last);
    last = value;
  }
}

}  // namespace
}  // namespace slabstream
