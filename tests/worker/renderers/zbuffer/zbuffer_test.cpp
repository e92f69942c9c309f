// The Z-buffer pipeline against analytic truth: silhouettes and depths that are known by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/zbuffer/vertex_normals.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

float DepthOf(const LocalImage& image, int x, int y) {
  const PixelBounds& b = image.bounds;
  if (x < b.x_begin || x >= b.x_end || y < b.y_begin || y >= b.y_end) return std::numeric_limits<float>::infinity();
  return image.depth[std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin)];
}

SetupOptions Options(Projection projection, unsigned seed) {
  std::mt19937 random(seed);
  SetupOptions options;
  options.renderer = ZBuffer();
  options.view = RandomView(projection, random);
  options.transfer = Uniform(1, {1, 0.5F, 0.25F});
  return options;
}

// Camera depth where a ray meets the cells [first - 0.5, last + 0.5), grown by `margin` voxels on all sides; exit < enter: it misses them.
struct Span {
  double enter, exit;
};
Span Meet(const Camera::Ray& ray, const Vec3& first, const Vec3& last, double margin) {
  Span span{-1e30, 1e30};
  for (Axis axis : kAxes) {
    const double a = (first[axis] - 0.5 - margin - ray.origin[axis]) / ray.direction[axis];
    const double b = (last[axis] + 0.5 + margin - ray.origin[axis]) / ray.direction[axis];
    span = {std::max(span.enter, std::min(a, b)), std::min(span.exit, std::max(a, b))};
  }
  return span;
}

// Faces reach a little beyond their edges (draw_faces.h), so a ray that misses a cell by less may see it.
constexpr double kBeyond = 0x1p-13;

// A filled volume is one box: covered where the ray meets it, at the depth where it enters, at every zoom, without a hole.
TEST(ZBuffer, BlockHasExactSilhouetteAndDepth) {
  for (Projection projection : kProjections) {
    for (double zoom : {0.1, 0.3, 1.0, 6.0, 40.0, 500.0}) {
      for (unsigned seed = 1; seed < 5; ++seed) {
        const Volume block = MakeBlock({{14, 9, 11}, {1, 1.5, 0.7}});
        SetupOptions options = Options(projection, seed);
        options.view.zoom = zoom;
        const FrameSetup setup = MakeSetup(block, options);
        const LocalImage image = RenderWhole(block, setup);
        for (int y = 0; y < setup.camera.height; ++y) {
          for (int x = 0; x < setup.camera.width; ++x) {
            const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
            const Vec3 last = ToVec3(block.description.geometry.size) - Vec3{1, 1, 1};
            const auto [enter, exit] = Meet(ray, {}, last, 0);
            const auto [reached, left] = Meet(ray, {}, last, kBeyond);
            if (enter >= exit && reached < left) continue;  // past an edge
            const float depth = DepthOf(image, x, y);
            ASSERT_EQ(std::isfinite(depth), enter < exit) << "seed " << seed << " zoom " << zoom << " pixel " << x << ' ' << y;
            if (enter < exit) {
              ASSERT_NEAR(depth, enter, 1e-5 * enter);
            }
          }
        }
      }
    }
  }
}

// A ball of voxels: depths and silhouette are the ball's within the size of a voxel, normals are the ball's, so shading is known too.
TEST(ZBuffer, BallHasItsSilhouetteDepthAndShade) {
  constexpr double kRadius = 17;
  const Vec3 middle = {20, 20, 20};
  const Volume ball = MakeVolume({{41, 41, 41}, {1, 1, 1}}, ScalarType::kFloat32, [&](const Index3& v) {
    return std::clamp(10 * (kRadius - Length(ToVec3(v) - middle)) + 100, 0.0, 200.0);  // 100 on the surface
  });
  for (Projection projection : kProjections) {
    SetupOptions options = Options(projection, 9);
    options.view.zoom = 1.4;
    options.size = {128, 128};
    options.transfer.opacities = {{0, 0, 0.5, 0}, {200, 1, 0.5, 0}};  // half opaque on the surface
    options.shading = {ShadingModel::kPhong, {}, 0, 1, 0, 1};         // the headlight's diffuse part only
    const FrameSetup setup = MakeSetup(ball, options);
    const LocalImage image = RenderWhole(ball, setup);
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
        const double length = Length(ray.direction);
        const Vec3 direction = (1 / length) * ray.direction, to_middle = middle - ray.origin;
        const double along = Dot(to_middle, direction), miss = std::sqrt(std::max(0.0, Dot(to_middle, to_middle) - along * along));
        const float depth = DepthOf(image, x, y);
        if (miss > kRadius + 0.9) {
          ASSERT_TRUE(std::isinf(depth)) << x << ' ' << y;
        }
        if (miss > kRadius - 0.9) continue;
        ASSERT_TRUE(std::isfinite(depth)) << x << ' ' << y;
        const double hit = along - std::sqrt(kRadius * kRadius - miss * miss);
        if (miss < 0.8 * kRadius) {
          ASSERT_NEAR(depth * length, hit, 1.6);
          const Vec3 normal = (1 / kRadius) * (ray.origin + hit * direction - middle);
          const double expected = std::abs(Dot(normal, setup.camera.view_direction)) * 1.0;
          ASSERT_NEAR(PixelOf(image, x, y)[0], expected, 0.1) << x << ' ' << y;
        }
      }
    }
  }
}

// A ramp has its gradient at every vertex of every cell, borders included; a constant has none at all, not even
// by rounding.
TEST(ZBuffer, GradientsOfRampsAndConstantsAreTheirs) {
  const Vec3 spacing = {0.5, 2, 1.3};
  for (Index3 size : {Index3{19, 6, 5}, Index3{2, 3, 1}}) {
    const Volume ramp = MakeVolume({size, spacing}, ScalarType::kFloat32, [](const Index3& v) { return 2.0 * v.x - 3.0 * v.y + v.z; });
    const Volume constant = MakeVolume({size, spacing}, ScalarType::kFloat32, [](const Index3&) { return 0.1; });
    const Vec3 expected = Vec3{size.x > 1 ? 2.0 : 0.0, size.y > 1 ? -3.0 : 0.0, size.z > 1 ? 1.0 : 0.0} / spacing;
    for (Index3 brick : {Index3{0, 0, 0}, Index3{16, 0, 0}}) {
      if (brick.x >= size.x) continue;
      const auto of_ramp = std::make_unique<VertexNormals>(), of_constant = std::make_unique<VertexNormals>();
      of_ramp->Compute(ramp.block, spacing, brick);
      of_constant->Compute(constant.block, spacing, brick);
      for (Index3 v; v.z <= std::min(16, size.z - brick.z); ++v.z) {
        for (v.y = 0; v.y <= std::min(16, size.y - brick.y); ++v.y) {
          for (v.x = 0; v.x <= std::min(16, size.x - brick.x); ++v.x) {
            ASSERT_LT(Length(of_ramp->Gradient(v) - expected), 1e-4) << v.x << ' ' << v.y << ' ' << v.z;
            ASSERT_EQ(of_constant->Gradient(v), Vec3{}) << v.x << ' ' << v.y << ' ' << v.z;
          }
        }
      }
    }
  }
}

TEST(ZBuffer, DrawsVoxelsFromHalfTheLargestOpacityOn) {
  // Values 50 and 100 with opacities 0.2 and 0.5: only the second reaches half of the largest.
  const Volume volume = MakeVolume({{8, 8, 8}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) { return v.x < 4 ? 50 : 100; });
  SetupOptions options = Options(Projection::kOrthographic, 3);
  options.transfer.opacities = {{0, 0, 0.5, 0}, {50, 0.2, 0.5, 0}, {100, 0.5, 0.5, 0}, {101, 1, 0.5, 0}};  // 101 does not occur
  const FrameSetup setup = MakeSetup(volume, options);
  const auto data = CutBox(volume, volume.block.box);
  RankReport report;
  const LocalImage image = MakeRenderer(*ZBuffer())->Render(*data, volume.block.box, setup, {}, RenderControl(), report).value();
  for (std::size_t i = 0; i < image.depth.size(); ++i) {
    if (std::isfinite(image.depth[i])) {
      EXPECT_GE(image.voxel[i] % 8 * 2, 4U);  // FaceIndex ends with x / 2
    }
  }
  EXPECT_GT(report.drawn_voxels, 0U);
}

TEST(ZBuffer, NothingIsDrawnWhereNothingIsOpaque) {
  SetupOptions options = Options(Projection::kPerspective, 3);
  options.transfer.opacities = {{0, 0, 0.5, 0}};
  const Volume block = MakeBlock({{5, 5, 5}, {1, 1, 1}});
  EXPECT_TRUE(RenderWhole(block, MakeSetup(block, options)).bounds.empty());
}

// Ties and nearest voxels by brute force: every voxel of a random cloud against every pixel.
TEST(ZBuffer, IsTheNearestCellOfEveryPixel) {
  for (Projection projection : kProjections) {
    for (unsigned seed = 20; seed < 40; ++seed) {
      std::mt19937 random(seed);
      const Volume cloud =
          MakeVolume({{7, 6, 5}, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3&) { return random() % 4 == 0 ? 100 : 0; });
      SetupOptions options = Options(projection, seed);
      options.size = {48, 48};
      options.view.zoom = std::exp2(int(seed % 5) - 1);
      const FrameSetup setup = MakeSetup(cloud, options);
      const LocalImage image = RenderWhole(cloud, setup);
      for (int y = 0; y < setup.camera.height; ++y) {
        for (int x = 0; x < setup.camera.width; ++x) {
          const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
          double nearest = std::numeric_limits<double>::infinity(), nearest_reached = nearest;
          bool edge = false;
          for (Index3 v; v.z < 5; ++v.z) {
            for (v.y = 0; v.y < 6; ++v.y) {
              for (v.x = 0; v.x < 7; ++v.x) {
                if (cloud.block.samples<std::uint8_t>()[cloud.block.Offset(v)] == 0) continue;
                const auto [enter, exit] = Meet(ray, ToVec3(v), ToVec3(v), 0);
                const auto [reached, left] = Meet(ray, ToVec3(v), ToVec3(v), kBeyond);
                edge |= enter > exit && reached < left;
                if (enter <= exit) nearest = std::min(nearest, enter);
                if (reached <= left) nearest_reached = std::min(nearest_reached, reached);
              }
            }
          }
          if (edge) continue;
          const float depth = DepthOf(image, x, y);
          ASSERT_EQ(std::isinf(depth), std::isinf(nearest)) << "seed " << seed << " pixel " << x << ' ' << y;
          if (std::isfinite(nearest)) {
            ASSERT_LE(depth, nearest + 1e-5 * nearest) << "seed " << seed << " pixel " << x << ' ' << y;
            ASSERT_GE(depth, nearest_reached - 1e-5 * nearest) << "seed " << seed << " pixel " << x << ' ' << y;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
