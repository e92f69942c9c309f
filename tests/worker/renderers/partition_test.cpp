// However a volume is divided, the combined picture is the one-box picture: the promise of every renderer.
#include <gtest/gtest.h>

#include <hwy/highway.h>

#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr float kBlendTolerance = 2e-5F;

void ExpectSamePicture(const LocalImage& one, const LocalImage& many, const FrameSetup& setup) {
  if (setup.format == PixelFormat::kRgba) {  // opacity accumulates
    const float tolerance = kBlendTolerance + float(setup.termination);
    EXPECT_LE(LargestDifference(one, many), tolerance);
    EXPECT_LE(LargestDifference(FinishPicture(one, setup), FinishPicture(many, setup)), tolerance);
    return;
  }
  // Bit for bit on the union of the bounds.
  LocalImage a = one, b = many;
  const LocalImage everywhere = MakeLocalImage(setup.format, Union(one.bounds, many.bounds));
  const auto spread = [&](const LocalImage& image) {
    LocalImage wide = everywhere;
    for (std::int32_t y = image.bounds.y_begin; y < image.bounds.y_end; ++y) {
      for (std::int32_t x = image.bounds.x_begin; x < image.bounds.x_end; ++x) {
        const auto from = std::size_t(y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(x - image.bounds.x_begin);
        const auto to = std::size_t(y - wide.bounds.y_begin) * std::size_t(wide.bounds.width()) + std::size_t(x - wide.bounds.x_begin);
        for (std::size_t c = 0; c < 4; ++c) wide.rgba[4 * to + c] = image.rgba[4 * from + c];
        if (HasDepth(setup.format)) wide.depth[to] = image.depth[from];
        if (HasVoxel(setup.format)) wide.voxel[to] = image.voxel[from];
      }
    }
    return wide;
  };
  a = spread(one);
  b = spread(many);
  EXPECT_TRUE(a.rgba == b.rgba);
  EXPECT_TRUE(a.depth == b.depth);
  EXPECT_TRUE(a.voxel == b.voxel);
}

void ExpectRandomBoxesMake(const LocalImage& whole, const Volume& volume, const FrameSetup& setup, std::mt19937& random) {
  ExpectSamePicture(whole, RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, 11, random)), setup);
}

class Partitions : public ::testing::TestWithParam<const RendererKind*> {
 protected:
  // Of three odd sides, as the renderer draws it.
  static Volume Blobs(unsigned seed, ScalarType type = ScalarType::kUint8) {
    return VolumeFor(*GetParam(), MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, type, seed));
  }
};

TEST_P(Partitions, SlabsAlongEveryAxisMakeOnePicture) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  for (Projection projection : GetParam()->projections()) {
    for (int view = 0; view < 3; ++view) {
      const Volume volume = Blobs(seed + unsigned(view));
      SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
      options.size = {72, 60};
      const FrameSetup setup = MakeSetup(volume, options);
      const LocalImage one = RenderWhole(volume, setup);
      for (Axis axis : kAxes) {
        for (int boxes : {2, 3, 5, 8, 13}) {
          SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view << " axis " << Letter(axis) << " boxes " << boxes);
          ExpectSamePicture(one, RenderByBoxes(volume, setup, CutIntoSlabs(volume, boxes, axis)), setup);
        }
      }
    }
  }
}

TEST_P(Partitions, BoxesOfAnyKindMakeOnePicture) {
  const unsigned seed = 12;
  std::mt19937 random(seed);
  for (Projection projection : GetParam()->projections()) {
    for (ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
      for (double zoom : {0.3, 1.0, 6.0}) {
        const Volume volume = VolumeFor(*GetParam(), MakeBlobs({{70, 40, 45}, {1, 1, 1}}, type, seed));
        SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
        options.view.zoom = zoom;
        options.transfer = Ramp(0.6);
        options.termination = 1.0 / 1024;
        const FrameSetup setup = MakeSetup(volume, options);
        SCOPED_TRACE(::testing::Message() << "seed " << seed << " zoom " << zoom << " type " << int(type));
        ExpectRandomBoxesMake(RenderWhole(volume, setup), volume, setup, random);
      }
    }
  }
}

TEST_P(Partitions, LookingBesideTheCentreMakesOnePicture) {
  const unsigned seed = 14;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Volume volume = Blobs(seed);
  for (Projection projection : GetParam()->projections()) {
    int seen = 0;
    for (int view = 0; seen < 6; ++view) {
      SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
      options.view.look_at = {20 + 15 * uniform(random), 15 + 12 * uniform(random), 21 + 15 * uniform(random)};
      if (view % 2 == 1) {
        options.view.eye = {20 + 90 * uniform(random), 15 + 90 * uniform(random), 21 + 90 * uniform(random)};
      } else if (projection == Projection::kPerspective) {
        options.view.distance = 60 + 40 * uniform(random);
      }
      if (!CheckView(options.view, volume.description.geometry).ok()) continue;
      ++seen;
      const FrameSetup setup = MakeSetup(volume, options);
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view);
      ExpectRandomBoxesMake(RenderWhole(volume, setup), volume, setup, random);
    }
  }
}

TEST_P(Partitions, ClippedVolumesMakeOnePicture) {
  const unsigned seed = 15;
  std::mt19937 random(seed);
  const Volume volume = Blobs(seed);
  for (Projection projection : GetParam()->projections()) {
    for (int view = 0; view < 8; ++view) {
      SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
      options.clipping = RandomClipping(volume.description.geometry, random);
      options.clipping.mode = view % 2 == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
      options.transfer = Ramp(0.6);
      const FrameSetup setup = MakeSetup(volume, options);
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view);
      ExpectRandomBoxesMake(RenderWhole(volume, setup), volume, setup, random);
    }
  }
}

// A crossing between two samples, or between two cells, belongs to one box.
TEST_P(Partitions, IsosurfacesMakeOnePicture) {
  if (!GetParam()->Can(Ability::kIsosurfaces)) return;  // draws none
  const unsigned seed = 16;
  std::mt19937 random(seed);
  const Volume volume = Blobs(seed);
  for (Projection projection : GetParam()->projections()) {
    for (int view = 0; view < 12; ++view) {
      SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
      if (view % 4 == 3) options.view = {.projection = projection, .azimuth_degrees = 45.0 * view};
      options.transfer = Ramp(view % 3 == 0 ? 0 : 0.6);
      options.transfer.isosurfaces = {{60, {0.9F, 0.4F, 0.2F}, 0.3}, {120, {0.2F, 0.5F, 0.9F}, view % 2 == 0 ? 1 : 0.5}};
      if (view % 3 == 2) {
        options.clipping = RandomClipping(volume.description.geometry, random);
        options.clipping.mode = view % 2 == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
      }
      FrameSetup setup = MakeSetup(volume, options);
      if (!setup.parameters.empty()) setup.parameters.front() = view % 4 == 0 ? 0.1 : view % 4 == 1 ? 3 : 1;
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view);
      const LocalImage one = RenderWhole(volume, setup);
      ExpectRandomBoxesMake(one, volume, setup, random);
      ExpectSamePicture(one, RenderByBoxes(volume, setup, CutIntoSlabs(volume, 13, kAxes[std::size_t(view) % 3])), setup);
    }
  }
}

TEST_P(Partitions, GradientOpacityMakesOnePicture) {
  if (!GetParam()->Can(Ability::kGradientOpacity)) return;  // has none
  const unsigned seed = 17;
  std::mt19937 random(seed);
  const Volume volume = Blobs(seed);
  for (Projection projection : GetParam()->projections()) {
    for (int view = 0; view < 4; ++view) {
      SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
      options.transfer = Ramp(0.6);
      options.transfer.gradient_opacities = {{3, 0}, {20, 1}, {60, 0.3}};
      const FrameSetup setup = MakeSetup(volume, options);
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view);
      ExpectRandomBoxesMake(RenderWhole(volume, setup), volume, setup, random);
    }
  }
}

TEST_P(Partitions, JitteredRaysMakeOnePicture) {
  if (GetParam()->name() != "raycast") return;  // it alone has --jitter
  const unsigned seed = 29;
  std::mt19937 random(seed);
  const Volume volume = Blobs(seed);
  for (Projection projection : GetParam()->projections()) {
    for (int view = 0; view < 4; ++view) {
      SetupOptions options;
      options.view = RandomView(projection, random);
      if (view >= 2) options.clipping = RandomClipping(volume.description.geometry, random);
      const FrameSetup setup = RaycastSetup(volume, options, 0.7, view % 2 == 0 ? 1 : 0.4);
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view);
      const LocalImage one = RenderWhole(volume, setup);
      ExpectRandomBoxesMake(one, volume, setup, random);
      const LocalImage without = RenderWhole(volume, RaycastSetup(volume, options, 0.7));
      EXPECT_TRUE(view >= 2 || LargestDifference(one, without) > 0) << "clipping may leave nothing, otherwise jitter shows";
    }
  }
}

// Noise up to the volume's borders: a gradient takes 26 neighbours, of which other boxes and the border have some.
TEST_P(Partitions, SmoothGradientsMakeOnePicture) {
  if (GetParam()->name() != "raycast") return;  // it alone has --gradient
  const unsigned seed = 37;
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> value(0, 255);
  for (Projection projection : GetParam()->projections()) {
    for (const ScalarType type : kTypes) {
      const Volume volume = MakeVolume({{41, 37, 33}, {1, 0.8, 1.3}}, type, [&](const Index3&) { return value(random); });
      for (int view = 0; view < 4; ++view) {
        SetupOptions options;
        options.view = RandomView(projection, random);
        options.transfer = Ramp(view < 2 ? 0.3 : 0);
        if (view % 2 == 1) options.transfer.isosurfaces = {{128, {0.9F, 0.4F, 0.2F}, 0.3}};
        if (view == 0) options.transfer.gradient_opacities = {{3, 0.2}, {120, 1}};
        const FrameSetup setup = RaycastSetup(volume, options, 0.7, 0, true);
        SCOPED_TRACE(::testing::Message() << "seed " << seed << " type " << NameOf(type) << " view " << view);
        const LocalImage one = RenderWhole(volume, setup);
        ExpectRandomBoxesMake(one, volume, setup, random);
        ExpectSamePicture(one, RenderByBoxes(volume, setup, CutIntoSlabs(volume, 13, kAxes[std::size_t(view) % 3])), setup);
      }
    }
  }
}

TEST_P(Partitions, WideFootprintsMakeOnePicture) {
  if (GetParam()->name() != "splat") return;  // it alone has --footprint
  const unsigned seed = 31;
  std::mt19937 random(seed);
  const Volume volume = Blobs(seed);
  for (Projection projection : GetParam()->projections()) {
    for (const double footprint : {1.5, kMaxFootprint}) {
      SetupOptions options;
      options.view = RandomView(projection, random);
      const FrameSetup setup = SplatSetup(volume, options, footprint);
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " footprint " << footprint);
      ExpectRandomBoxesMake(RenderWhole(volume, setup), volume, setup, random);
    }
  }
}

TEST_P(Partitions, RegionsMakeOnePicture) {
  if (!GetParam()->Can(Ability::kRegions)) return;  // has none
  const unsigned seed = 23;
  std::mt19937 random(seed);
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kFloat32}) {
    const Volume volume = Blobs(seed, type);
    for (Projection projection : GetParam()->projections()) {
      for (int view = 0; view < 4; ++view) {
        SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
        options.transfer =
            WithCurvesOfRegions({.colors = {},
                                 .opacities = {},
                                 .regions = {{{{40, 0}, {255, 0}, {255, 12}, {40, 12}}, {1, 0.3F, 0.1F}, 0.1, 0.3},
                                             {{{20, 6}, {160, 6}, {90, 80}}, {0.2F, 0.5F, 1}, 0.7, view % 2 == 0 ? 0.5 : 0}}});
        const FrameSetup setup = MakeSetup(volume, options);
        SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view);
        const LocalImage one = RenderWhole(volume, setup);
        EXPECT_GT(std::ranges::max(one.rgba), 0);
        ExpectRandomBoxesMake(one, volume, setup, random);
      }
    }
  }
}

// Axis-parallel views put rays, faces and planes on top of each other.
TEST_P(Partitions, AxisParallelViewsHaveNoSeams) {
  const Volume volume = VolumeFor(*GetParam(), MakeBlobs({{32, 32, 32}, {1, 1, 1}}, ScalarType::kUint8, 5));
  for (Projection projection : GetParam()->projections()) {
    for (auto [azimuth, elevation] : {std::pair(0.0, 0.0), std::pair(90.0, 0.0), std::pair(0.0, 90.0), std::pair(45.0, 0.0)}) {
      SetupOptions options;
      options.renderer = GetParam();
      options.view.projection = projection;
      options.view.azimuth_degrees = azimuth;
      options.view.elevation_degrees = elevation;
      options.size = {111, 111};
      const FrameSetup setup = MakeSetup(volume, options);
      const LocalImage one = RenderWhole(volume, setup);
      for (Axis axis : kAxes) ExpectSamePicture(one, RenderByBoxes(volume, setup, CutIntoSlabs(volume, 4, axis)), setup);
    }
  }
}

TEST_P(Partitions, EveryInstructionSetMakesOnePicture) {
  const unsigned seed = 13;
  std::mt19937 random(seed);
  const Volume volume = VolumeFor(*GetParam(), MakeBlobs({{45, 45, 45}, {1, 1, 1}}, ScalarType::kUint8, seed));
  for (Projection projection : GetParam()->projections()) {
    SetupOptions options{.renderer = GetParam(), .view = RandomView(projection, random)};
    if (projection == GetParam()->projections().back()) {
      options.clipping = RandomClipping(volume.description.geometry, random);
      if (GetParam()->Can(Ability::kIsosurfaces)) options.transfer.isosurfaces = {{60, {0.9F, 0.4F, 0.2F}, 0.3}};
      if (GetParam()->Can(Ability::kGradientOpacity)) options.transfer.gradient_opacities = {{3, 0.2}, {20, 1}};
    }
    const FrameSetup setup = MakeSetup(volume, options);
    const LocalImage best = RenderWhole(volume, setup);
    for (auto target : hwy::SupportedAndGeneratedTargets()) {
      SCOPED_TRACE(hwy::TargetName(target));
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(target);
      const LocalImage image = RenderWhole(volume, setup);
      hwy::SetSupportedTargetsForTest(0);
      hwy::GetChosenTarget().DeInit();
      ExpectSamePicture(best, image, setup);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Renderers, Partitions, ::testing::ValuesIn(Renderers().begin(), Renderers().end()),
                         [](const auto& kind) { return std::string(kind.param->name()); });

}  // namespace
}  // namespace slabstream
