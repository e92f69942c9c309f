// Rays of a frame against a clip region: depths and outline against the definition, and the kernels against their reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/simd_targets.h"
#include "tests/worker/kernels/clip_rows_reference.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/zbuffer/clip_rays.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

const VolumeGeometry kClippedGeometry = {{41, 37, 33}, {1, 0.8, 1.3}, {}};

// Where a ray is inside half-spaces, from depth 0 on.
struct Interval {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  void Cut(double start, double rise) {
    if (rise > 0) enter = std::max(enter, -start / rise);
    if (rise < 0) leave = std::min(leave, -start / rise);
    if (rise == 0 && start < 0) leave = -1;
  }
};
Interval IntervalOf(const std::vector<HalfSpace>& sides, const Camera::Ray& ray) {
  Interval interval;
  for (const HalfSpace& side : sides) interval.Cut(side.Distance(ray.origin), Dot(side.normal, ray.direction));
  return interval;
}

struct Case {
  ClipRegion region;
  Camera camera;
  Box box;
};
Case RandomCase(std::mt19937& random) {
  Case c;
  const Projection projection = kProjections[random() % 2];
  c.region = MakeClipRegion(RandomClipping(kClippedGeometry, random), kClippedGeometry).value();
  c.camera = MakeCamera(RandomView(projection, random), {61, 53}, kClippedGeometry);
  const Partition boxes = CutAtRandom(kClippedGeometry.bounds(), 4, random);
  c.box = boxes.boxes()[random() % boxes.boxes().size()];
  return c;
}

TEST(ClipRays, MeetTheRegionWhereTheDefinitionSays) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  int met = 0, missed = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const Case c = RandomCase(random);
    const ClipRays rays(c.region, c.camera, kClippedGeometry.bounds());
    std::vector<float> enter(std::size_t(c.camera.width) + kRowPadding), leave(enter.size());
    for (std::int32_t y = 0; y < c.camera.height; ++y) {
      RegionDepths(rays.Row(y), 0, std::size_t(c.camera.width), enter.data(), leave.data());
      for (std::int32_t x = 0; x < c.camera.width; ++x) {
        const Interval expected = IntervalOf(c.region.sides, c.camera.RayAt(x + 0.5, y + 0.5));
        const float from = enter[std::size_t(x)], to = leave[std::size_t(x)];
        const double length = expected.leave - expected.enter;
        if (length < -1e-3) {
          EXPECT_EQ(from, kNeverMet);
          EXPECT_EQ(to, -1);
          ++missed;
        } else if (length > 1e-3) {
          EXPECT_NEAR(from, expected.enter, 1e-3 + 1e-6 * expected.enter);
          if (expected.leave < 1e4) {
            EXPECT_NEAR(to, expected.leave, 1e-3);
          } else {
            EXPECT_GT(to, 9e3);
          }
          ++met;
        }
      }
    }
  }
  EXPECT_GT(met, 10000);
  EXPECT_GT(missed, 10000);
}

TEST(ClipRays, OutlineHoldsAllPixelsThatSeeTheRegionInTheBox) {
  constexpr unsigned kSeed = 12;
  std::mt19937 random(kSeed);
  std::int64_t seen = 0, outlined = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const Case c = RandomCase(random);
    const ClipRays rays(c.region, c.camera, c.box);
    std::vector<HalfSpace> sides = c.region.sides;
    for (const Axis axis : kAxes) {
      Vec3 normal;
      normal[axis] = 1;
      sides.push_back({normal, 0.5 - c.box.begin[axis]});
      sides.push_back({-normal, c.box.end[axis] - 0.5});
    }
    const PixelBounds frame = {0, 0, c.camera.width, c.camera.height};
    for (std::int32_t y = 0; y < c.camera.height; ++y) {
      const auto [begin, end] = rays.ColumnsOf(y, frame);
      if (begin < end) outlined += end - begin;
      for (std::int32_t x = 0; x < c.camera.width; ++x) {
        const Interval inside = IntervalOf(sides, c.camera.RayAt(x + 0.5, y + 0.5));
        if (inside.enter > inside.leave) continue;
        ++seen;
        EXPECT_TRUE(begin <= x && x < end) << x << " " << y;
        EXPECT_TRUE(rays.bounds().Contains({x, y, x + 1, y + 1})) << x << " " << y;
        const Interval region = IntervalOf(c.region.sides, c.camera.RayAt(x + 0.5, y + 0.5));
        EXPECT_TRUE(region.enter == 0 || region.enter >= rays.least_enter());
        EXPECT_GE(region.leave, rays.least_leave());
      }
    }
  }
  EXPECT_GT(seen, 10000);
  EXPECT_LT(outlined, 2 * seen);
}

TEST(ClipRows, AreTheSameBitsOnEveryInstructionSet) {
  constexpr unsigned kSeed = 13;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const Case c = RandomCase(random);
    const RegionRow row = ClipRays(c.region, c.camera, kClippedGeometry.bounds()).Row(20);
    RayRow ray_row;
    const Camera::Ray first = c.camera.RayAt(0, 20.5), next = c.camera.RayAt(1, 20.5);
    for (int axis = 0; axis < 3; ++axis) {
      ray_row.origin[std::size_t(axis)] = {first.origin[axis], next.origin[axis] - first.origin[axis]};
      ray_row.direction[std::size_t(axis)] = {first.direction[axis], next.direction[axis] - first.direction[axis]};
    }
    for (const std::size_t count : {std::size_t{1}, std::size_t{7}, std::size_t{16}, std::size_t{50}}) {
      struct Result {
        explicit Result(std::size_t n) : enter(n + kRowPadding), leave(n + kRowPadding), x(n + kRowPadding), y(x), z(x) {}
        std::vector<float> enter, leave;
        std::vector<std::int32_t> x, y, z;
      };
      Result expected(count);
      RegionDepthsReference(row, 3, count, expected.enter.data(), expected.leave.data());
      VoxelsAtReference(ray_row, 3, count, expected.enter.data(), 0.01, expected.x.data(), expected.y.data(), expected.z.data());
      ForEachTarget([&] {
        Result got(count);
        RegionDepths(row, 3, count, got.enter.data(), got.leave.data());
        VoxelsAt(ray_row, 3, count, got.enter.data(), 0.01, got.x.data(), got.y.data(), got.z.data());
        const auto same = [count](const auto& a, const auto& b) {
          return std::equal(a.begin(), a.begin() + std::ptrdiff_t(count), b.begin());
        };
        EXPECT_TRUE(same(got.enter, expected.enter));
        EXPECT_TRUE(same(got.leave, expected.leave));
        EXPECT_TRUE(same(got.x, expected.x) && same(got.y, expected.y) && same(got.z, expected.z));
      });
    }
  }
}

}  // namespace
}  // namespace slabstream
