// Clipped volumes. That they are the same for every partition is in partition_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/renderers/mip/projection_mode.h"
#include "common/view/phong.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr unsigned kSeed = 31;

// A volume, rendered with a region kept, with it cut away, and whole.
struct Parts {
  LocalImage whole, kept, rest;
  FrameSetup setup;
};
Parts RenderParts(const Volume& volume, SetupOptions options) {
  Parts parts;
  const Clipping clipping = std::exchange(options.clipping, {});
  parts.setup = MakeSetup(volume, options);
  parts.whole = RenderWhole(volume, parts.setup);
  options.clipping = clipping;
  options.clipping.mode = ClipMode::kKeep;
  parts.kept = RenderWhole(volume, MakeSetup(volume, options));
  options.clipping.mode = ClipMode::kCutAway;
  parts.rest = RenderWhole(volume, MakeSetup(volume, options));
  return parts;
}

template <class Check>
void ForEachClipping(const RendererKind* renderer, Check&& check) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, ScalarType::kUint8, kSeed);
  for (Projection projection : kProjections) {
    for (int view = 0; view < 6; ++view) {
      SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " projection " << int(projection) << " view " << view);
      SetupOptions options;
      options.renderer = renderer;
      options.view = RandomView(projection, random);
      options.view.zoom = 1;
      options.clipping = RandomClipping(volume.description.geometry, random);
      options.shading.model = ShadingModel::kNone;
      check(volume, options);
    }
  }
}

template <class Check>
void ForEachPixel(const FrameSetup& setup, Check&& check) {
  const PixelBounds frame = FrameBounds(setup);
  for (std::int32_t y = 0; y < frame.y_end; ++y) {
    for (std::int32_t x = 0; x < frame.x_end; ++x) check(x, y);
  }
}

// Every sample is either kept or cut away, so transmittances multiply.
void ExpectTransmittancesMultiply(const RendererKind* renderer, double mean_tolerance, double tolerance) {
  int divided = 0;
  double sum = 0;
  ForEachClipping(renderer, [&](const Volume& volume, const SetupOptions& options) {
    const Parts parts = RenderParts(volume, options);
    ForEachPixel(parts.setup, [&](int x, int y) {
      const float whole = PixelOf(parts.whole, x, y)[3], kept = PixelOf(parts.kept, x, y)[3], rest = PixelOf(parts.rest, x, y)[3];
      ASSERT_NEAR(1 - whole, (1 - kept) * (1 - rest), tolerance) << "pixel " << x << " " << y;
      if (kept == 0 || rest == 0) return;
      ++divided;
      sum += std::abs(double((1 - whole) - (1 - kept) * (1 - rest)));
    });
  });
  ASSERT_GT(divided, 1000);
  EXPECT_LE(sum / divided, mean_tolerance);
}

// The samples beside a cut stand for the ray up to the cut, instead of half a step.
TEST(ClippedRaycasting, AndWhatIsCutAwayMakeTheWhole) { ExpectTransmittancesMultiply(FindRenderer("raycast"), 5e-3, 0.15); }
TEST(ClippedSplatting, AndWhatIsCutAwayMakeTheWhole) { ExpectTransmittancesMultiply(Splatting(), 2e-6, 2e-5); }

TEST(ClippedMaximum, AndWhatIsCutAwayMakeTheWhole) {
  int differ = 0;
  ForEachClipping(FindRenderer("mip"), [&](const Volume& volume, const SetupOptions& options) {
    const Parts parts = RenderParts(volume, options);
    ForEachPixel(parts.setup, [&](int x, int y) {
      const float kept = PixelOf(parts.kept, x, y)[0], rest = PixelOf(parts.rest, x, y)[0];
      ASSERT_EQ(PixelOf(parts.whole, x, y)[0], std::max(kept, rest)) << "pixel " << x << " " << y;
      differ += kept != rest ? 1 : 0;
    });
  });
  EXPECT_GT(differ, 1000);
}

float DepthOf(const LocalImage& image, int x, int y) {
  const PixelBounds& bounds = image.bounds;
  if (x < bounds.x_begin || x >= bounds.x_end || y < bounds.y_begin || y >= bounds.y_end) return std::numeric_limits<float>::infinity();
  return image.depth[std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()) + std::size_t(x - bounds.x_begin)];
}

TEST(ClippedZBuffer, NearerOfBothPartsIsTheWhole) {
  int cut = 0;
  ForEachClipping(ZBuffer(), [&](const Volume& volume, const SetupOptions& options) {
    const Parts parts = RenderParts(volume, options);
    int others = 0;
    ForEachPixel(parts.setup, [&](int x, int y) {
      const float whole = DepthOf(parts.whole, x, y), kept = DepthOf(parts.kept, x, y), rest = DepthOf(parts.rest, x, y);
      // A face in the plane of a cut may be missing in both parts: the cut stands for it.
      if (std::min(kept, rest) != whole) ++others;
      cut += std::isfinite(kept) && kept > whole ? 1 : 0;
    });
    EXPECT_LE(others, 4);
  });
  EXPECT_GT(cut, 300);
}

// Voxels of a box of whole voxels: as if all other voxels were empty.
TEST(ClippedZBuffer, ByWholeVoxelsIsAVolumeWithoutTheOthers) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlobs({{30, 31, 32}, {1, 0.8, 1.3}}, ScalarType::kUint8, kSeed);
  const Box box = {{8, 0, 11}, {30, 19, 27}};
  Volume others = volume;
  for (std::size_t i = 0; i < others.block.bytes.size(); ++i) {
    if (!box.Contains(PlaceIn(volume.description.geometry.size, i))) others.block.bytes[i] = std::byte{0};
  }
  for (Projection projection : kProjections) {
    for (int view = 0; view < 6; ++view) {
      SetupOptions options;
      options.renderer = ZBuffer();
      options.view = RandomView(projection, random);
      options.shading.model = ShadingModel::kNone;
      FrameSetup setup = MakeSetup(volume, options);
      const LocalImage expected = RenderWhole(others, setup);
      options.clipping.box = ClipBox{{8, -1e9, 11}, {1e9, 19, 27}, ClipUnit::kVoxels};
      setup = MakeSetup(volume, options);
      const LocalImage clipped = RenderWhole(volume, setup);
      int differ = 0, seen = 0;
      ForEachPixel(setup, [&](int x, int y) {
        const float a = DepthOf(expected, x, y), b = DepthOf(clipped, x, y);
        if (std::isfinite(a)) ++seen;
        // Rays through edges may meet either of two voxels.
        if (!(a == b || std::abs(a - b) < 1e-3F) || PixelOf(expected, x, y) != PixelOf(clipped, x, y)) ++differ;
      });
      EXPECT_GT(seen, 100);
      EXPECT_LE(differ, seen / 50) << "seed " << kSeed << " view " << view;
    }
  }
}

// The opacity of a homogeneous block is that of the length which is left of each ray.
void ExpectOpacityOfLength(const RendererKind* renderer, double mean_tolerance, double tolerance) {
  std::mt19937 random(kSeed);
  const double alpha = 0.03;
  const Volume block = MakeBlock({{40, 40, 40}, {1, 1, 1}});
  int inside = 0;
  double sum = 0;
  for (int view = 0; view < 8; ++view) {
    SetupOptions options;
    options.renderer = renderer;
    options.view = RandomView(Projection::kOrthographic, random);
    options.view.zoom = 1;
    options.size = {80, 80};
    options.transfer = Uniform(alpha, {1, 1, 1});
    options.shading.model = ShadingModel::kNone;
    options.clipping = RandomClipping(block.description.geometry, random);
    const FrameSetup setup = MakeSetup(block, options);
    const LocalImage picture = RenderPicture(block, setup);
    for (int y = 10; y < 70; ++y) {
      for (int x = 10; x < 70; ++x) {
        const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
        double enter = -1e9, leave = 1e9;
        const auto cut = [&](double start, double rise) {
          if (rise > 0) enter = std::max(enter, -start / rise);
          if (rise < 0) leave = std::min(leave, -start / rise);
        };
        for (const Axis axis : kAxes) {
          cut(ray.origin[axis] + 0.5, ray.direction[axis]);
          cut(39.5 - ray.origin[axis], -ray.direction[axis]);
        }
        for (const HalfSpace& side : setup.clip.sides) cut(side.Distance(ray.origin), Dot(side.normal, ray.direction));
        if (leave - enter < 4) continue;
        ++inside;
        const double error = std::abs(double(PixelOf(picture, x, y)[3]) - (1 - std::pow(1 - alpha, leave - enter)));
        ASSERT_LE(error, tolerance) << "seed " << kSeed << " view " << view << " pixel " << x << " " << y << " length " << leave - enter;
        sum += error;
      }
    }
  }
  ASSERT_GT(inside, 1000);
  EXPECT_LE(sum / inside, mean_tolerance);
}

TEST(ClippedRaycasting, ABlockHasTheOpacityOfItsLength) { ExpectOpacityOfLength(FindRenderer("raycast"), 1e-4, 1e-3); }
// Whole sheets are kept or dropped, half a sheet too many or too few at each end, and the block's own edges are blurred.
TEST(ClippedSplatting, ABlockHasTheOpacityOfItsLength) { ExpectOpacityOfLength(Splatting(), 0.012, 0.15); }

// The volume's value between voxels, as stored.
double Interpolated(const Volume& volume, const Vec3& p) {
  const Index3& size = volume.description.geometry.size;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Index3 voxel;
    double weight = 1;
    for (int i = 0; i < 3; ++i) {
      const double floor = std::floor(p[i]);
      const bool upper = (corner >> i & 1) != 0;
      voxel[i] = std::clamp(int(floor) + (upper ? 1 : 0), 0, size[i] - 1);
      weight *= upper ? p[i] - floor : 1 - (p[i] - floor);
    }
    sum += weight * double(std::to_integer<int>(volume.block.bytes[NumberIn(size, voxel)]));
  }
  return sum;
}

// A slab without thickness shows the values in its plane, whatever the view that it faces.
TEST(Slices, ShowTheValuesInTheirPlane) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-8, 8);
  const Volume volume = MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, ScalarType::kUint8, kSeed);
  const VolumeGeometry& geometry = volume.description.geometry;
  const Vec3 centre = 0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1}) * geometry.spacing;
  for (int view = 0; view < 12; ++view) {
    SetupOptions options;
    options.renderer = FindRenderer("mip");
    options.view = RandomView(Projection::kOrthographic, random);
    if (view < 3) options.view = {.azimuth_degrees = 90.0 * view, .elevation_degrees = view == 0 ? 90.0 : 0.0};
    options.view.zoom = 1;
    FrameSetup setup = MakeSetup(volume, options);
    const Vec3 normal = setup.camera.view_direction, through = centre + Vec3{uniform(random), uniform(random), uniform(random)};
    options.clipping.slab = ClipSlab{.normal = normal, .through = through};
    setup = MakeSetup(volume, options);
    const LocalImage slice = RenderWhole(volume, setup);
    int inside = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
        const double depth = Dot(through - ray.origin * geometry.spacing, normal);
        const Vec3 p = ray.origin + depth * ray.direction;
        bool is_inside = true;
        for (const Axis axis : kAxes) is_inside = is_inside && p[axis] > 0.01 && p[axis] < geometry.size[axis] - 1.01;
        if (!is_inside) continue;
        ++inside;
        const double range = double(setup.range.max) - double(setup.range.min);
        const double expected = (Interpolated(volume, p) - double(setup.range.min)) / range;
        ASSERT_NEAR(PixelOf(slice, x, y)[0], expected, 2e-3) << "seed " << kSeed << " view " << view << " pixel " << x << " " << y;
      }
    }
    EXPECT_GT(inside, 200) << "view " << view;
  }
}

// A cut through opaque matter is one flat surface with the light of its plane.
void ExpectFlatCut(const RendererKind* renderer, float tolerance) {
  std::mt19937 random(kSeed);
  // Values vary from voxel to voxel, so that gradients point everywhere; all are opaque, in one colour.
  const Volume volume = VolumeFor(
      *renderer, MakeVolume({{32, 32, 32}, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3&) { return 100.0 + double(random() % 100); }));
  for (int view = 0; view < 6; ++view) {
    SetupOptions options;
    options.renderer = renderer;
    options.view = RandomView(Projection::kOrthographic, random);
    options.view.zoom = 2;
    options.transfer = Uniform(1, {0.4F, 0.6F, 0.8F});
    FrameSetup setup = MakeSetup(volume, options);
    // The cut goes through the middle and faces the eye more or less.
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    const Vec3 normal = setup.camera.view_direction + Vec3{uniform(random), uniform(random), uniform(random)};
    options.clipping.planes = {{normal, -Dot(normal, {15.5, 15.5, 15.5})}};
    setup = MakeSetup(volume, options);
    const LocalImage picture = RenderPicture(volume, setup);
    const PhongFactors light = Phong(options.shading, setup.camera.view_direction).AtNormal(Normalized(normal));
    for (int y = 28; y < 36; ++y) {
      for (int x = 28; x < 36; ++x) {
        const std::array<float, 4> pixel = PixelOf(picture, x, y);
        EXPECT_NEAR(pixel[0], std::clamp(0.4F * light.diffuse + light.specular, 0.0F, 1.0F), tolerance) << "seed " << kSeed;
        EXPECT_NEAR(pixel[2], std::clamp(0.8F * light.diffuse + light.specular, 0.0F, 1.0F), tolerance);
        EXPECT_NEAR(pixel[3], 1, 1e-3);
      }
    }
  }
}

TEST(ClippedRaycasting, LightsCutsAsFlatFaces) { ExpectFlatCut(FindRenderer("raycast"), 0.002F); }
TEST(ClippedSlicing, LightsCutsAsFlatFaces) { ExpectFlatCut(FindRenderer("slice"), 0.002F); }
TEST(ClippedZBuffer, LightsCutsAsFlatFaces) { ExpectFlatCut(ZBuffer(), 0.002F); }
// Normals are coded within 0.8 degrees.
TEST(ClippedSplatting, LightsCutsAsFlatFaces) { ExpectFlatCut(Splatting(), 0.03F); }

}  // namespace
}  // namespace slabstream
