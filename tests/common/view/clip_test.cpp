// Which part of a volume is drawn.
#include "common/view/clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "common/view/camera.h"
#include "common/view/clip_corners.h"
#include "common/wire/validate_request.h"
#include "tests/common/view/random_view.h"
#include "tests/support/random.h"
#include "tests/support/random_box.h"

namespace slabstream {
namespace {

Clipping RandomClipping(Random& random, const VolumeGeometry& geometry) {
  Clipping clipping;
  const auto around = [&](double reach) {
    Vec3 p;
    for (const Axis axis : kAxes) p[axis] = random.Real(-reach, reach);
    return p;
  };
  const auto world = [&](const Vec3& voxel) {
    return geometry.orientation.origin + geometry.orientation.ToWorld(geometry.spacing * voxel);
  };
  for (int planes = random.Integer(0, 3); planes > 0; --planes) {
    const Vec3 normal = around(10), through = world(0.5 * ToVec3(geometry.size) + around(10));
    clipping.planes.push_back({normal, -Dot(normal, through)});
  }
  if (clipping.planes.empty() || random.Integer(0, 1) == 0) {
    ClipBox& box = clipping.box.emplace();
    box.unit = ClipUnit(random.Integer(1, 3));
    const Vec3 middle = box.unit == ClipUnit::kWorld     ? world(0.5 * ToVec3(geometry.size))
                        : box.unit == ClipUnit::kPercent ? Vec3{50, 50, 50}
                                                         : 0.5 * ToVec3(geometry.size);
    for (const Axis axis : kAxes) {
      box.low[axis] = middle[axis] - random.Real(0.1, 20);
      box.high[axis] = middle[axis] + random.Real(0.1, 20);
    }
  }
  clipping.mode = random.Integer(0, 1) == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
  return clipping;
}

// The definition.
bool Keeps(const Clipping& clipping, const VolumeGeometry& geometry, const Vec3& p) {
  const Vec3 world = geometry.orientation.origin + geometry.orientation.ToWorld(geometry.spacing * p);
  bool inside = true;
  for (const ClipPlane& plane : clipping.planes) inside = inside && Dot(plane.normal, world) + plane.offset >= 0;
  if (clipping.box) {
    const Vec3 half = {0.5, 0.5, 0.5};
    const Vec3 at = clipping.box->unit == ClipUnit::kWorld    ? world
                    : clipping.box->unit == ClipUnit::kVoxels ? p + half
                                                              : 100.0 * ((p + half) / ToVec3(geometry.size));
    for (const Axis axis : kAxes) inside = inside && at[axis] >= clipping.box->low[axis] && at[axis] <= clipping.box->high[axis];
  }
  return inside == (clipping.mode == ClipMode::kKeep);
}

// Whether a sample at p is drawn.
bool Keeps(const ClipRegion& region, const Vec3& p) {
  if (region.empty()) return true;
  const bool inside = std::ranges::all_of(region.sides, [&](const HalfSpace& side) { return side.Distance(p) >= 0; });
  return inside == (region.mode == ClipMode::kKeep);
}

TEST(Clip, KeepsWhatTheBoxAndAllPlanesLeave) {
  Random random(21);
  int kept = 0, points = 0;
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(random.trace());
    const VolumeGeometry geometry = RandomGeometry(random, World::kScene);
    const Clipping clipping = RandomClipping(random, geometry);
    ASSERT_TRUE(Validate(clipping).ok()) << Validate(clipping).message();
    const ClipRegion region = MakeClipRegion(clipping, geometry).value();
    for (int n = 0; n < 50; ++n) {
      Vec3 p;
      for (const Axis axis : kAxes) p[axis] = random.Real(-0.499, geometry.size[axis] - 0.501);
      ASSERT_EQ(Keeps(region, p), Keeps(clipping, geometry, p));
      kept += Keeps(region, p) ? 1 : 0;
      ++points;
    }
  }
  EXPECT_GT(kept, points / 10);
  EXPECT_LT(kept, points * 9 / 10);
}

TEST(Clip, DropsNoBoxThatHoldsAPointWhichIsKept) {
  Random random(22);
  int dropped = 0;
  for (int i = 0; i < 1000; ++i) {
    SCOPED_TRACE(random.trace());
    const VolumeGeometry geometry = RandomGeometry(random, World::kScene);
    const ClipRegion region = MakeClipRegion(RandomClipping(random, geometry), geometry).value();
    const Box box = RandomBox(random, geometry.bounds());
    bool any = false;
    for (int n = 0; n < 50; ++n) {
      Vec3 p;
      for (const Axis axis : kAxes) p[axis] = random.Real(box.begin[axis] - 0.5, box.end[axis] - 0.5);
      any = any || Keeps(region, p);
    }
    if (region.MayKeep(box)) continue;
    ++dropped;
    EXPECT_FALSE(any);
  }
  EXPECT_GT(dropped, 50);
}

TEST(Clip, KeepsAllOfABoxOnlyIfItKeepsEveryPointRoundIt) {
  Random random(24);
  int whole = 0;
  for (int i = 0; i < 1000; ++i) {
    SCOPED_TRACE(random.trace());
    const VolumeGeometry geometry = RandomGeometry(random, World::kScene);
    const ClipRegion region = MakeClipRegion(RandomClipping(random, geometry), geometry).value();
    const Box box = RandomBox(random, geometry.bounds());
    const double margin = 0.5 * Least(geometry.spacing);
    if (!region.KeepsAll(box, margin)) continue;
    if (!region.empty()) ++whole;
    EXPECT_TRUE(region.MayKeep(box));
    for (int n = 0; n < 50; ++n) {
      // A unit of data space is at least the least spacing, so a step of less than half a voxel along one axis stays within the margin.
      Vec3 p;
      for (const Axis axis : kAxes) p[axis] = random.Real(box.begin[axis] - 0.5, box.end[axis] - 0.5);
      const int axis = n % 3;
      p[axis] += random.Real(-0.99, 0.99) * margin / geometry.spacing[axis];
      EXPECT_TRUE(Keeps(region, p));
    }
  }
  EXPECT_GT(whole, 50);
}

// In every direction no kept point lies beyond the corners, and the corners themselves are kept.
TEST(Clip, CornersAreThoseOfWhatIsLeftOfABox) {
  Random random(25);
  int with_points = 0;
  for (int i = 0; i < 1000; ++i) {
    SCOPED_TRACE(random.trace());
    const VolumeGeometry geometry = RandomGeometry(random, World::kScene);
    Clipping clipping = RandomClipping(random, geometry);
    clipping.mode = ClipMode::kKeep;
    const ClipRegion region = MakeClipRegion(clipping, geometry).value();
    const Box box = RandomBox(random, geometry.bounds());
    const std::vector<Vec3> corners = CornersOf(region, box);
    for (const Vec3& corner : corners) {
      for (const HalfSpace& side : region.sides) EXPECT_GE(side.Distance(corner), -1e-6);
    }
    bool any = false;
    for (int n = 0; n < 50; ++n) {
      Vec3 p, direction;
      for (const Axis axis : kAxes) {
        p[axis] = random.Real(box.begin[axis] - 0.5, box.end[axis] - 0.5);
        direction[axis] = random.Real(-1, 1);
      }
      if (!Keeps(region, p)) continue;
      any = true;
      EXPECT_TRUE(std::ranges::any_of(corners, [&](const Vec3& corner) { return Dot(direction, corner) >= Dot(direction, p) - 1e-6; }));
    }
    with_points += any && !region.empty() ? 1 : 0;
  }
  EXPECT_GT(with_points, 100);
  EXPECT_EQ(CornersOf({}, {{1, 2, 3}, {4, 5, 6}}).size(), 8U);
}

TEST(Clip, DistancesArePhysical) {
  Random random(23);
  const VolumeGeometry geometry = RandomGeometry(random, World::kScene);
  const ClipRegion region = MakeClipRegion({.planes = {{{3, -4, 12}, 0}}, .mode = ClipMode::kCutAway}, geometry).value();
  ASSERT_EQ(region.sides.size(), 1U);
  EXPECT_NEAR(Length(region.sides[0].normal / geometry.spacing), 1, 1e-12);
}

// Renderers compute with it in single precision.
TEST(Clip, APlaneFarAwayClipsAsOneNearby) {
  for (const double spacing : {1e-30, 1.0, 1e22}) {
    const VolumeGeometry geometry{{10, 20, 30}, {spacing, spacing, spacing}};
    for (const double at : {1e30, 1e300}) {
      const ClipRegion gone = MakeClipRegion({.planes = {{{1, 0, 0}, -at}}}, geometry).value();
      ASSERT_EQ(gone.sides.size(), 1U);
      EXPECT_FALSE(gone.MayKeep(geometry.bounds()));
      EXPECT_TRUE(std::isfinite(float(gone.sides[0].offset / spacing)));
      EXPECT_TRUE(MakeClipRegion({.planes = {{{1, 0, 0}, at}}}, geometry).value().empty());
      const ClipSlab slab{.normal = {0, 0, 1}, .through = Vec3{0, 0, at}};
      EXPECT_FALSE(MakeClipRegion({.slab = slab}, geometry).value().MayKeep(geometry.bounds()));
    }
  }
}

TEST(Clip, ABoxAroundTheVolumeLeavesNothingToDo) {
  const VolumeGeometry geometry{{10, 20, 30}, {1, 2, 3}};
  EXPECT_TRUE(MakeClipRegion({.box = ClipBox{{0, 0, 0}, {100, 100, 100}, ClipUnit::kPercent}}, geometry).value().empty());
  EXPECT_TRUE(MakeClipRegion({.box = ClipBox{{0, -1e9, 0}, {10, 1e9, 30}, ClipUnit::kVoxels}}, geometry).value().empty());
  EXPECT_EQ(MakeClipRegion({.box = ClipBox{{0, -1e9, 0}, {9, 1e9, 30}, ClipUnit::kVoxels}}, geometry).value().sides.size(), 1U);
  const ClipRegion all_gone =
      MakeClipRegion({.box = ClipBox{{0, 0, 0}, {100, 100, 100}, ClipUnit::kPercent}, .mode = ClipMode::kCutAway}, geometry).value();
  EXPECT_FALSE(Keeps(all_gone, {5, 5, 5}));
}

TEST(Clip, InvalidOnesAreErrorsThatNameTheField) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto box = [](const Vec3& low, const Vec3& high) { return Clipping{.box = ClipBox{low, high}}; };
  const struct {
    Clipping clipping;
    std::string names;
  } kCases[] = {
      {box({0, 5, 0}, {1, 5, 1}), "clipping.box is 5:5 along y"},
      {box({0, kNan, 0}, {1, 5, 1}), "clipping.box.low.y"},
      {box({0, 0, -2e300}, {1, 5, 1}), "clipping.box.low.z"},
      {{.planes = {{{0, 0, 0}, 1}}}, "clipping.clip_planes[0].normal"},
      {{.planes = {{{1, 0, 0}, 1}, {{kNan, 0, 0}, 1}}}, "clipping.clip_planes[1].normal.x"},
      {{.planes = {{{1, 0, 0}, kNan}}}, "clipping.clip_planes[0].offset"},
      {{.planes = std::vector<ClipPlane>(17, {{1, 0, 0}, 1})}, "clipping.clip_planes has 17 items, at most 16"},
      {{.mode = ClipMode(3)}, "clipping.mode is 3"},
      {{.box = ClipBox{{0, 0, 0}, {1, 1, 1}, ClipUnit(4)}}, "clipping.box.unit is 4"},
  };
  for (const auto& [clipping, names] : kCases) {
    const Status status = Validate(clipping);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << names;
    EXPECT_NE(status.message().find(names), std::string::npos) << status.message();
  }
}

}  // namespace
}  // namespace slabstream
