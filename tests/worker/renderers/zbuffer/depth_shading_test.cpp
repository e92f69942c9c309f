// Shading by depth gradients: planes whose light is known, edges that do not spoil it, and pictures that no partition changes.
#include "common/renderers/zbuffer/depth_shading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/view/phong.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr float kColour = 0.5F;

FrameSetup SetupFor(Projection projection, unsigned seed) {
  std::mt19937 random(seed);
  SetupOptions options;
  options.renderer = ZBuffer();
  options.view = RandomView(projection, random);
  options.shading.model = ShadingModel::kDepthGradient;
  return MakeSetup(MakeBlock({{24, 20, 22}, {1, 1.4, 0.8}}), options);
}

// A plane through physical `through`: its normal, unit.
struct Plane {
  Vec3 through, normal;
};

// The whole frame, of the plane that `at` names for a pixel.
LocalImage FrameOf(const FrameSetup& setup, const std::function<Plane(int x, int y)>& at) {
  const Camera& camera = setup.camera;
  LocalImage frame = MakeLocalImage(PixelFormat::kDepth, {0, 0, camera.width, camera.height});
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Camera::Ray ray = camera.RayAt(x + 0.5, y + 0.5);
      const Plane plane = at(x, y);
      const Vec3 origin = ray.origin * camera.spacing, direction = ray.direction * camera.spacing;
      const auto i = std::size_t(y) * std::size_t(camera.width) + std::size_t(x);
      frame.depth[i] = float(Dot(plane.through - origin, plane.normal) / Dot(direction, plane.normal));
      for (std::size_t c = 0; c < 4; ++c) frame.rgba[4 * i + c] = c < 3 ? kColour : 1;
    }
  }
  return frame;
}

Vec3 MiddleOf(const FrameSetup& setup) {
  const VolumeGeometry& geometry = setup.description.geometry;
  return 0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1}) * geometry.spacing;
}

// At most 50 degrees off the view direction.
Vec3 NormalNear(const Camera& camera, std::mt19937& random) {
  std::uniform_real_distribution<double> tilt(-0.8, 0.8);
  return Normalized(tilt(random) * camera.right + tilt(random) * camera.up - camera.view_direction);
}

float LitColour(const FrameSetup& setup, const Vec3& normal) {
  const PhongFactors light = Phong(setup.shading, setup.camera.view_direction).AtNormal(normal);
  return std::min(kColour * light.diffuse + light.specular, 1.0F);
}

TEST(DepthShading, LightsAPlaneByItsNormal) {
  for (Projection projection : kProjections) {
    for (unsigned seed = 1; seed < 20; ++seed) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed);
      const FrameSetup setup = SetupFor(projection, seed);
      std::mt19937 random(seed);
      const Vec3 normal = NormalNear(setup.camera, random);
      const LocalImage frame = FrameOf(setup, [&](int, int) { return Plane{MiddleOf(setup), normal}; });
      const LocalImage lit = ShadeByDepth(frame, setup);
      EXPECT_TRUE(lit.depth == frame.depth);
      for (std::size_t i = 0; i < lit.depth.size(); ++i) {
        ASSERT_NEAR(lit.rgba[4 * i], LitColour(setup, normal), 2e-3) << "pixel " << i;
        ASSERT_EQ(lit.rgba[4 * i + 3], 1);
      }
    }
  }
}

// Two parallel planes, one far before the other: the edge between them is lit as each of them is.
TEST(DepthShading, TakesTheOwnSideOfAnEdge) {
  for (Projection projection : kProjections) {
    for (unsigned seed = 1; seed < 20; ++seed) {
      const FrameSetup setup = SetupFor(projection, seed);
      std::mt19937 random(seed);
      const Vec3 normal = NormalNear(setup.camera, random), middle = MiddleOf(setup);
      const Vec3 nearer = middle - 30.0 * setup.camera.view_direction;
      const int edge = setup.camera.width / 2;
      const LocalImage lit = ShadeByDepth(FrameOf(setup, [&](int x, int) { return Plane{x < edge ? nearer : middle, normal}; }), setup);
      for (std::size_t i = 0; i < lit.depth.size(); ++i) ASSERT_NEAR(lit.rgba[4 * i], LitColour(setup, normal), 0.05) << "seed " << seed;
    }
  }
}

TEST(DepthShading, LightsALonePixelLikeMaterialWithoutGradient) {
  const FrameSetup setup = SetupFor(Projection::kOrthographic, 1);
  LocalImage frame = MakeLocalImage(PixelFormat::kDepth, {7, 9, 8, 10});
  frame.depth[0] = 3;
  frame.rgba = {kColour, kColour, kColour, 1};
  const LocalImage lit = ShadeByDepth(frame, setup);
  EXPECT_FLOAT_EQ(lit.rgba[0], kColour * Phong(setup.shading, setup.camera.view_direction).WithoutGradient().diffuse);
  EXPECT_TRUE(ShadeByDepth(MakeLocalImage(PixelFormat::kDepth, {}), setup).rgba.empty());
}

TEST(DepthShading, NoPartitionChangesThePicture) {
  const unsigned seed = 3;
  std::mt19937 random(seed);
  for (Projection projection : kProjections) {
    for (double zoom : {0.3, 1.0, 5.0}) {
      const Volume volume = MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, ScalarType::kUint8, seed);
      SetupOptions options;
      options.renderer = ZBuffer();
      options.view = RandomView(projection, random);
      options.view.zoom = zoom;
      options.transfer = Ramp(1);
      options.shading.model = ShadingModel::kDepthGradient;
      const FrameSetup setup = MakeSetup(volume, options);
      EXPECT_FALSE(setup.renderer->FrameIsPicture(setup));
      const LocalImage one = FinishPicture(RenderWhole(volume, setup), setup);
      for (int boxes : {2, 5, 11}) {
        const LocalImage many = FinishPicture(RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, boxes, random)), setup);
        EXPECT_EQ(LargestDifference(one, many), 0) << "seed " << seed << " zoom " << zoom << " boxes " << boxes;
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
