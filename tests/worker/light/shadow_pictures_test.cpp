// Shadows and ambient occlusion in pictures: a slab darkens a floor by its transmittance, and no partition changes a picture.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/image/local_image.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr double kSlabOpacity = 0.06;
constexpr int kFloorTop = 10, kSlabBegin = 40, kSlabEnd = 52;  // voxels along z

// An opaque floor, value 200, below a clear slab, value 100, over half of it: x < 48.
Volume FloorBelowSlab() {
  return MakeVolume({{96, 64, 64}}, ScalarType::kUint8, [](const Index3& v) {
    return v.z < kFloorTop ? 200 : v.x < 48 && v.z >= kSlabBegin && v.z < kSlabEnd ? 100 : 0;
  });
}

// The slab's colour is black, so that what is seen through it tells of the floor alone.
TransferFunction FloorAndSlab(double slab_opacity) {
  return {.colors = {{0, {0, 0, 0}}, {150, {0, 0, 0}}, {151, {1, 1, 1}}},
          .opacities = {{0, 0}, {50, 0}, {51, slab_opacity}, {150, slab_opacity}, {151, 1}}};
}

class Shadows : public ::testing::TestWithParam<const RendererKind*> {};

// Seen from below the slab: the eye looks at the floor at a small angle, and the ray passes only the floor.
void ExpectShadowOnFloor(const Volume& volume, SetupOptions options) {
  options.view = {.elevation_degrees = 20, .zoom = 1};
  options.size = {160, 160};
  options.shading = {.lights = {{0, 0, 1}}, .ambient = 0, .diffuse = 1, .specular = 0};
  const LocalImage lit = RenderPicture(volume, MakeSetup(volume, options));
  options.shading.shadows = 1;
  const FrameSetup setup = MakeSetup(volume, options);
  const LocalImage shaded = RenderPicture(volume, setup);
  // Points of the floor whose rays pass beneath the slab.
  const auto ratio_at = [&](const Vec3& point) {
    const auto at = setup.camera.Project(point);
    const auto pixel = [&](const LocalImage& image) { return double(PixelOf(image, int(at.x), int(at.y))[0]); };
    EXPECT_GT(pixel(lit), 0.3);
    return pixel(shaded) / pixel(lit);
  };
  const double expected = std::pow(1 - kSlabOpacity, kSlabEnd - kSlabBegin);
  EXPECT_NEAR(ratio_at({24, 20, kFloorTop - 0.5}), expected, 0.02);
  EXPECT_NEAR(ratio_at({36, 24, kFloorTop - 0.5}), expected, 0.02);
  EXPECT_NEAR(ratio_at({72, 20, kFloorTop - 0.5}), 1, 0.01) << "beside the slab";
}

TEST_P(Shadows, OfASlabDarkenAFloorByItsTransmittance) {
  if (GetParam()->name() == "zbuffer" || GetParam()->Can(Ability::kCells)) return;  // draws no clear matter; has no floor of voxels
  SetupOptions options;
  options.renderer = GetParam();
  options.transfer = FloorAndSlab(kSlabOpacity);
  ExpectShadowOnFloor(FloorBelowSlab(), options);
}

TEST_P(Shadows, OfASlabDarkenAnIsosurfaceByItsTransmittance) {
  if (GetParam()->name() == "zbuffer" || !GetParam()->Can(Ability::kIsosurfaces)) return;  // draws no clear matter
  SetupOptions options;
  options.renderer = GetParam();
  options.transfer = {.colors = {{0, {0, 0, 0}}}, .opacities = {{0, 0}, {50, 0}, {51, kSlabOpacity}, {120, kSlabOpacity}, {121, 0}}};
  options.transfer.isosurfaces = {{150, {1, 1, 1}, 1}};
  ExpectShadowOnFloor(FloorBelowSlab(), options);
}

TEST_P(Shadows, DoNotDependOnThePartition) {
  const unsigned seed = 41;
  std::mt19937 random(seed);
  const Volume volume = VolumeFor(*GetParam(), MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, ScalarType::kUint8, seed));
  for (const Projection projection : GetParam()->projections()) {
    for (int view = 0; view < 4; ++view) {
      SetupOptions options;
      options.renderer = GetParam();
      options.view = RandomView(projection, random);
      options.transfer = Ramp(0.3);
      options.shading.shadows = 0.9F;
      options.shading.ambient_occlusion = 0.8F;
      options.shading.lights = {{1, 0.5, 0.7}};
      if (view % 2 == 1) options.shading.lights.push_back({-0.3, 1, -0.5});
      if (view == 2) options.shading.model = ShadingModel::kNone;
      if (view == 3) options.clipping = RandomClipping(volume.description.geometry, random);
      const FrameSetup setup = MakeSetup(volume, options);
      const LocalImage one = RenderWhole(volume, setup);
      for (const int boxes : {3, 8}) {
        const LocalImage many = RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, boxes, random));
        SCOPED_TRACE(::testing::Message() << "seed " << seed << " view " << view << " boxes " << boxes);
        EXPECT_LE(LargestDifference(one, many), setup.format == PixelFormat::kRgba ? 2e-5F : 0.0F);
      }
    }
  }
}

TEST_P(Shadows, DarkenAndLeaveOpacityAlone) {
  const Volume volume = VolumeFor(*GetParam(), MakeBlobs({{41, 37, 33}}, ScalarType::kUint8, 3));
  SetupOptions options;
  options.renderer = GetParam();
  options.view = {.azimuth_degrees = 30, .elevation_degrees = 20};
  options.shading.lights = {{1, 0.5, 0.7}};
  const LocalImage lit = RenderWhole(volume, MakeSetup(volume, options));
  options.shading.shadows = options.shading.ambient_occlusion = 1;
  const LocalImage dark = RenderWhole(volume, MakeSetup(volume, options));
  double before = 0, after = 0;
  for (std::int32_t y = lit.bounds.y_begin; y < lit.bounds.y_end; ++y) {
    for (std::int32_t x = lit.bounds.x_begin; x < lit.bounds.x_end; ++x) {
      const auto a = PixelOf(lit, x, y), b = PixelOf(dark, x, y);
      ASSERT_EQ(a[3], b[3]) << x << ' ' << y;
      for (std::size_t c = 0; c < 3; ++c) {
        ASSERT_LE(b[c], a[c] + 1e-5F) << x << ' ' << y;
        before += a[c];
        after += b[c];
      }
    }
  }
  EXPECT_LT(after, 0.9 * before);
}

std::vector<const RendererKind*> WithShadows() {
  std::vector<const RendererKind*> kinds;
  for (const RendererKind* const kind : Renderers()) {
    if (kind->Can(Ability::kShadows)) kinds.push_back(kind);
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(EveryRenderer, Shadows, ::testing::ValuesIn(WithShadows()),
                         [](const auto& kind) { return std::string(kind.param->name()); });

}  // namespace
}  // namespace slabstream
