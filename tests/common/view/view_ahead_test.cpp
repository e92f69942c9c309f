#include "common/view/view_ahead.h"

#include <gtest/gtest.h>

#include "common/view/default_view.h"
#include "tests/common/view/random_view.h"

namespace slabstream {
namespace {

constexpr VolumeGeometry kSeenVolume = {.size = {60, 80, 100}};

// Where the picture of a view shows a point.
Camera::ImagePoint Shown(const ViewParameters& view) { return MakeCamera(view, {400, 300}, kSeenVolume).Project({40, 30, 70}); }

TEST(ViewAhead, ATurnAndAZoomGoOn) {
  const ViewParameters before{.azimuth_degrees = 10, .elevation_degrees = 20, .roll_degrees = 5, .zoom = 2};
  ViewParameters now = before;
  *now.azimuth_degrees += 4;
  *now.elevation_degrees -= 2;
  now.zoom = 2.2;
  const ViewParameters ahead = ViewAhead(before, now, 2);
  EXPECT_NEAR(*ahead.azimuth_degrees, 22, 1e-9);
  EXPECT_NEAR(*ahead.elevation_degrees, 14, 1e-9);
  EXPECT_NEAR(ahead.roll_degrees, 5, 1e-9);
  EXPECT_NEAR(ahead.zoom, 2.2 * 1.1 * 1.1, 1e-9);
}

TEST(ViewAhead, ATurnPastAFullCircleIsNoTurnBack) {
  const ViewParameters before{.azimuth_degrees = 359}, now{.azimuth_degrees = 2};
  EXPECT_NEAR(Shown(ViewAhead(before, now, 1)).x, Shown({.azimuth_degrees = 5}).x, 1e-6);
}

TEST(ViewAhead, AnglesThatTheVolumeDecidesStayItsOwn) {
  const ViewParameters ahead = ViewAhead(kUnstatedView, {.azimuth_degrees = 4, .elevation_degrees = std::nullopt}, 2);
  EXPECT_EQ(ahead.azimuth_degrees, 4);
  EXPECT_EQ(ahead.elevation_degrees, std::nullopt);
}

TEST(ViewAhead, PointsMoveOn) {
  const ViewParameters before{.look_at = Vec3{0, 0, 0}, .eye = Vec3{100, 0, 0}}, now{.look_at = Vec3{1, 2, 0}, .eye = Vec3{101, 2, 3}};
  const ViewParameters ahead = ViewAhead(before, now, 3);
  EXPECT_EQ(ahead.look_at, (Vec3{4, 8, 0}));
  EXPECT_EQ(ahead.eye, (Vec3{104, 8, 12}));
  EXPECT_EQ(ViewAhead({}, now, 3).eye, now.eye) << "nobody knows whence it came";
}

TEST(ViewAhead, WhatStandsStillStays) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 100; ++round) {
    const ViewParameters view = RandomView(random);
    const Camera::ImagePoint now = Shown(view), ahead = Shown(ViewAhead(view, view, random.Real(0, 5)));
    EXPECT_NEAR(now.x, ahead.x, 1e-6);
    EXPECT_NEAR(now.y, ahead.y, 1e-6);
    EXPECT_NEAR(now.depth, ahead.depth, 1e-6);
  }
}

}  // namespace
}  // namespace slabstream
