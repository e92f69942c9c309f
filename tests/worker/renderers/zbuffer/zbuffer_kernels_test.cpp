// The kernels of the Z-buffer: every instruction set against the plain reference, bit for bit, and shading against Phong in double
// precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "common/view/phong.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/kernels/draw_faces_reference.h"
#include "tests/worker/kernels/shade_faces_reference.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/zbuffer/brick_projection.h"
#include "worker/renderers/zbuffer/vertex_normals.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

struct Keys {
  explicit Keys(const PixelBounds& pixels)
      : stride(std::size_t(pixels.width() + kKeyPadding)), keys(stride * std::size_t(pixels.height()), kEmptyKey), bounds(pixels) {}
  KeyBand band() { return {keys.data(), stride, bounds}; }
  std::uint64_t At(int x, int y) const { return keys[std::size_t(y - bounds.y_begin) * stride + std::size_t(x - bounds.x_begin)]; }
  // Of the pixels, not the padding; empty ones have any number.
  friend bool operator==(const Keys& a, const Keys& b) {
    for (int y = a.bounds.y_begin; y < a.bounds.y_end; ++y) {
      for (int x = a.bounds.x_begin; x < a.bounds.x_end; ++x) {
        if (a.At(x, y) != b.At(x, y) && std::min(a.At(x, y), b.At(x, y)) >> 32 != kEmptyKey >> 32) return false;
      }
    }
    return true;
  }
  std::size_t stride;
  std::vector<std::uint64_t> keys;
  PixelBounds bounds;
};

const VolumeGeometry kGeometry = {{40, 37, 50}, {1, 1.4, 0.8}};

// Some faces of one side of the voxels of a brick, with room to read ahead.
std::vector<FaceSite> RandomSites(std::mt19937& random, const SurfaceBrick& brick, int side, int share) {
  std::vector<FaceSite> sites;
  for (Index3 v = brick.voxels.begin; v.z < brick.voxels.end.z; ++v.z) {
    for (v.y = brick.voxels.begin.y; v.y < brick.voxels.end.y; ++v.y) {
      for (v.x = brick.voxels.begin.x; v.x < brick.voxels.end.x; ++v.x) {
        if (random() % unsigned(share) != 0) continue;
        const auto bin_and_side = std::uint16_t(random() % 100 | unsigned(side) << kBinBits);
        sites.push_back({std::uint16_t(v.x), std::uint16_t(v.y), std::uint16_t(v.z), bin_and_side});
      }
    }
  }
  return sites;
}

TEST(DrawFaces, IsTheSameBitsOnEveryInstructionSet) {
  for (Projection projection : kProjections) {
    for (unsigned seed = 40; seed < 70; ++seed) {
      SCOPED_TRACE(seed);
      std::mt19937 random(seed);
      ViewParameters view = RandomView(projection, random);
      view.zoom = std::exp2(int(random() % 12) - 3);  // pixels from a few to a hundredth of a voxel
      const Camera camera = MakeCamera(view, {100, 80}, kGeometry);
      const BrickProjection bricks(camera, kGeometry.size);
      SurfaceBrick brick;
      brick.origin = {16 * int(random() % 3), 16 * int(random() % 3), 16 * int(random() % 3)};
      brick.voxels = Grown({brick.origin, brick.origin}, 16, kGeometry.bounds());
      brick.voxels.begin = brick.origin;
      const int side = int(random() % kSides);
      std::vector<FaceSite> sites = RandomSites(random, brick, side, 1 + int(random() % 50));
      const auto count = std::uint32_t(sites.size());
      sites.resize(sites.size() + kSitesReadAhead);
      const std::vector<FaceNormals> normals(sites.size());
      if (bricks.View(brick).pixels.empty()) continue;
      const FaceProjection faces = bricks.Faces(brick, side);
      // The whole frame, and a band that cuts faces off on all sides.
      for (const PixelBounds& bounds : {PixelBounds{0, 0, camera.width, camera.height}, PixelBounds{37, 31, 60, 45}}) {
        Keys expected(bounds);
        const std::size_t drawn = DrawFacesReference(projection, faces, sites.data(), 0, count, expected.band());
        ForEachTarget([&] {
          Keys got(bounds);
          EXPECT_EQ(DrawFaces(projection, faces, sites.data(), normals.data(), 0, count, got.band()), drawn);
          EXPECT_TRUE(got == expected);
        });
      }
    }
  }
}

TEST(DrawFaces, NearerKeysStay) {
  const Camera camera = MakeCamera({}, {64, 64}, kGeometry);
  const BrickProjection bricks(camera, kGeometry.size);
  SurfaceBrick brick;
  brick.voxels = {{0, 0, 0}, {16, 16, 16}};
  std::mt19937 random(1);
  for (int side = 0; side < kSides; ++side) {
    if ((bricks.View(brick).sides >> side & 1) == 0) continue;
    std::vector<FaceSite> sites = RandomSites(random, brick, side, 1);
    const auto count = std::uint32_t(sites.size());
    sites.resize(sites.size() + kSitesReadAhead);
    const std::vector<FaceNormals> normals(sites.size());
    Keys keys({0, 0, 64, 64});
    std::ranges::fill(keys.keys, 12345);  // depth 0
    EXPECT_GT(DrawFaces(camera.projection, bricks.Faces(brick, side), sites.data(), normals.data(), 0, count, keys.band()), 0U);
    EXPECT_EQ(std::ranges::count(keys.keys, 12345), std::ptrdiff_t(keys.keys.size()));
  }
}

TEST(AllHidden, LooksAtEveryPixelOfTheBoundsAndNoOther) {
  const std::uint64_t near = std::uint64_t{std::bit_cast<std::uint32_t>(2.0F)} << 32 | 7;
  ForEachTarget([&] {
    for (int width : {1, 3, 8, 21}) {
      const PixelBounds bounds = {13, 4, 13 + width, 7};
      Keys keys({10, 2, 50, 9});  // the rest is empty
      for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
        for (int x = bounds.x_begin; x < bounds.x_end; ++x) keys.keys[std::size_t(y - 2) * keys.stride + std::size_t(x - 10)] = near;
      }
      EXPECT_TRUE(AllHidden(keys.band(), bounds, 2.5F));
      EXPECT_FALSE(AllHidden(keys.band(), bounds, 2.0F));  // not nearer, as near
      for (int x = bounds.x_begin; x < bounds.x_end; ++x) {
        std::uint64_t& key = keys.keys[std::size_t(6 - 2) * keys.stride + std::size_t(x - 10)];
        key = kEmptyKey;
        EXPECT_FALSE(AllHidden(keys.band(), bounds, 2.5F));
        key = near;
      }
    }
  });
}

TEST(AllHidden, SeesOnlyDepthsThatTheLimitsLetThrough) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  // Whole numbers, so that depths are often equal. A limit that begins behind its end belongs to a ray that misses the region.
  const auto any = [&] { return float(1 + random() % 6); };
  for (int round = 0; round < 400; ++round) {
    Keys keys({10, 2, 50, 9});
    for (std::uint64_t& key : keys.keys) key = std::uint64_t{std::bit_cast<std::uint32_t>(any())} << 32 | 7;
    std::vector<float> from(keys.keys.size()), to(keys.keys.size());
    std::ranges::generate(from, any);
    std::ranges::generate(to, any);
    KeyBand band = keys.band();
    band.limits = {from.data(), to.data(), round % 2 == 0};
    const int x = 10 + int(random() % 30), y = 2 + int(random() % 7);
    const PixelBounds bounds = {x, y, x + 1 + int(random() % 3), y + 1};
    const float nearest = any();
    bool seen = false;  // a depth from `nearest` on, in steps of a half, that is let through and not hidden
    for (std::int32_t column = bounds.x_begin; column < bounds.x_end; ++column) {
      const std::size_t at = std::size_t(y - 2) * band.stride + std::size_t(column - 10);
      for (float depth = nearest; depth < 9; depth += 0.5F) {
        const bool inside = depth >= from[at] && depth <= to[at];
        seen |= inside == band.limits.inside && depth <= std::bit_cast<float>(std::uint32_t(band.keys[at] >> 32));
      }
    }
    // It may take a pixel for seen that is not, never the other way round.
    ForEachTarget([&] {
      if (seen) {
        EXPECT_FALSE(AllHidden(band, bounds, nearest));
      }
    });
    band.limits = {};
    bool nearer = true;
    for (std::int32_t column = bounds.x_begin; column < bounds.x_end; ++column) {
      const std::size_t at = std::size_t(y - 2) * band.stride + std::size_t(column - 10);
      nearer &= std::bit_cast<float>(std::uint32_t(band.keys[at] >> 32)) < nearest;
    }
    EXPECT_EQ(AllHidden(band, bounds, nearest), nearer);
  }
}

TEST(AllHidden, ACutHidesWhatLiesBehindIt) {
  Keys keys({10, 2, 50, 9});
  const std::vector<float> enter(keys.keys.size(), 3.0F), leave(keys.keys.size(), 8.0F);
  const PixelBounds bounds = {13, 4, 34, 7};
  KeyBand band = keys.band();
  const auto hidden = [&](float cut, bool inside, float nearest) {
    std::ranges::fill(keys.keys, std::uint64_t{std::bit_cast<std::uint32_t>(cut)} << 32 | 7);
    band.limits = {enter.data(), leave.data(), inside};
    return AllHidden(band, bounds, nearest);
  };
  ForEachTarget([&] {
    EXPECT_TRUE(hidden(2.5F, true, 1));    // what lies before the region is not drawn
    EXPECT_FALSE(hidden(3.5F, true, 1));   // the cut lies behind the beginning of what is drawn
    EXPECT_TRUE(hidden(7.5F, false, 4));   // what lies in the region is not drawn, and the cut hides what lies behind it
    EXPECT_FALSE(hidden(7.5F, false, 1));  // something is drawn before the region
    EXPECT_FALSE(hidden(8.5F, false, 4));
  });
}

// Faces with every kind of normals, and keys that see them or nothing.
struct RandomFaces {
  explicit RandomFaces(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int face = 0; face < 200; ++face) {
      sites.push_back({std::uint16_t(random() % 40), std::uint16_t(random() % 37), std::uint16_t(random() % 50),
                       std::uint16_t(random() % 16 | random() % kSides << kBinBits)});
      FaceNormals corners{};
      for (std::uint32_t& corner : corners) {
        if (face % 7 != 0) corner = PackNormal({normal(random), normal(random), normal(random)});
      }
      normals.push_back(corners);
    }
    for (int i = 0; i < 4 * 16; ++i) colors.push_back(uniform(random));
    for (int face = 0; face < 200; ++face) labels.push_back(std::uint32_t(random() % 8));
    for (int i = 0; i < 4 * 8; ++i) label_colors.push_back(uniform(random) / 2);
    for (int i = 0; i < 100; ++i) {
      const float depth = random() % 3 == 0 ? std::numeric_limits<float>::infinity() : 60 + 60 * uniform(random);
      keys.push_back(std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | (std::isinf(depth) ? 0xFFFFFFFF : random() % 200));
    }
    std::fill_n(keys.begin() + 40, 20, kEmptyKey);
  }
  FaceShading Shading(const Camera& camera, const slabstream::Shading& shading) const {
    FaceShading out = MakeFaceShading(camera, shading, kGeometry.size);
    out.sites = sites.data();
    out.normals = normals.data();
    out.colors = colors.data();
    if (with_labels) {
      out.labels = labels.data();
      out.label_colors = label_colors.data();
    }
    return out;
  }
  std::vector<FaceSite> sites;
  std::vector<FaceNormals> normals;
  std::vector<float> colors, label_colors;
  std::vector<std::uint32_t> labels;
  bool with_labels = false;
  std::vector<std::uint64_t> keys;
};

TEST(ShadeFaces, IsTheSameBitsOnEveryInstructionSet) {
  const std::vector<Shading> shadings = {{},
                                         {ShadingModel::kNone},
                                         {ShadingModel::kPhong, {{1, 2, 3}}, 0.1F, 0.9F, 0.5F, 1},
                                         {ShadingModel::kPhong, {{1, 0, 0}, {0, -1, 0.3}, {-1, -1, -1}}, 0.3F, 0.3F, 1, 1000}};
  for (Projection projection : kProjections) {
    for (unsigned seed = 70; seed < 80; ++seed) {
      SCOPED_TRACE(seed);
      RandomFaces faces(seed);
      faces.with_labels = seed % 2 == 1;
      std::mt19937 random(seed);
      const FaceShading shading = faces.Shading(MakeCamera(RandomView(projection, random), {100, 80}, kGeometry), shadings[seed % 4]);
      for (std::size_t count : {1, 3, 4, 5, 15, 16, 17, 33, 64, 100}) {
        std::vector<float> rgba(4 * count), depth(count), expected_rgba(4 * count), expected_depth(count);
        std::vector<std::uint32_t> voxel(count), expected_voxel(count);
        ShadeFaceRowReference(shading, faces.keys.data(), 3, 50, count, expected_rgba.data(), expected_depth.data(), expected_voxel.data());
        ForEachTarget([&] {
          ShadeFaceRow(shading, faces.keys.data(), 3, 50, count, rgba.data(), depth.data(), voxel.data());
          EXPECT_EQ(rgba, expected_rgba) << count;
          EXPECT_EQ(depth, expected_depth) << count;
          EXPECT_EQ(voxel, expected_voxel) << count;
        });
      }
    }
  }
}

// Where all corners of a face have one normal, so does every pixel: what Phong makes of it in double precision is known.
TEST(ShadeFaces, IsPhong) {
  for (unsigned seed = 80; seed < 90; ++seed) {
    SCOPED_TRACE(seed);
    RandomFaces faces(seed);
    std::mt19937 random(seed);
    for (FaceNormals& corners : faces.normals) corners.fill(corners[0]);
    Shading shading{ShadingModel::kPhong, {{1, 2, 3}, {-3, 1, 0}}, 0.1F, 0.4F, 0.5F, std::exp2(float(seed - 80))};
    if (seed % 2 == 0) shading.lights.clear();
    const Camera camera = MakeCamera(RandomView(Projection::kPerspective, random), {100, 80}, kGeometry);
    const FaceShading kernel = faces.Shading(camera, shading);
    const Phong phong(shading, camera.view_direction);
    const std::size_t count = faces.keys.size();
    std::vector<float> rgba(4 * count), depth(count);
    std::vector<std::uint32_t> voxel(count);
    ShadeFaceRow(kernel, faces.keys.data(), 0, 0, count, rgba.data(), depth.data(), voxel.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (std::isinf(depth[i])) {
        EXPECT_EQ(rgba[4 * i + 3], 0);
        continue;
      }
      const auto face = std::uint32_t(faces.keys[i]);
      const std::uint32_t packed = faces.normals[face][0];
      const auto component = [&](int bit) { return double(std::int32_t(packed << (22 - bit)) >> 22); };
      const Vec3 normal = {component(0), component(10), component(20)};
      const PhongFactors factors = packed == 0 ? phong.WithoutGradient() : phong.AtNormal(Normalized(normal));
      for (std::size_t c = 0; c < 3; ++c) {
        const float color = faces.colors[4 * (faces.sites[face].bin_and_side % 4096U) + c];
        EXPECT_NEAR(rgba[4 * i + c], std::clamp(color * factors.diffuse + factors.specular, 0.0F, 1.0F), 2e-4);
      }
      EXPECT_EQ(rgba[4 * i + 3], 1);
    }
  }
}

// Packing keeps directions within a tenth of a degree.
TEST(PackNormal, KeepsDirections) {
  const unsigned seed = 90;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 10000; ++i) {
    const Vec3 direction = Normalized({normal(random), normal(random), normal(random)});
    const std::uint32_t packed = PackNormal(1e-3 * direction);
    const auto component = [&](int bit) { return double(std::int32_t(packed << (22 - bit)) >> 22); };
    const Vec3 unpacked = Normalized({component(0), component(10), component(20)});
    ASSERT_LT(std::asin(Length(Cross(unpacked, direction))) * 57.29577951308232, 0.1) << "seed " << seed;
  }
  EXPECT_EQ(PackNormal({}), 0U);
  EXPECT_EQ(PackNormal({NAN, 1, 1}), 0U);
}

}  // namespace
}  // namespace slabstream
