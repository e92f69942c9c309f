#include "common/view/default_view.h"

#include <gtest/gtest.h>

#include "common/view/ball.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

TEST(DefaultView, APatientIsSeenFromTheFrontAndAnythingElseFromBesideAndAbove) {
  for (const World world : {World::kVoxels, World::kScene, World::kPatient}) {
    const bool patient = world == World::kPatient;
    const ViewParameters view = WithDefaults(kUnstatedView, world);
    EXPECT_EQ(view.azimuth_degrees, patient ? 180 : 30);
    EXPECT_EQ(view.elevation_degrees, patient ? 0 : 20);
    EXPECT_EQ(view.fit, true);
    EXPECT_EQ(WithDefaults(view, World::kVoxels), view) << "nothing is left to decide";
    ViewParameters turned = kUnstatedView;
    turned.azimuth_degrees = 0;
    EXPECT_EQ(WithDefaults(turned, world).azimuth_degrees, 0);
    EXPECT_EQ(WithDefaults(turned, world).elevation_degrees, patient ? 0 : 20) << "the other angle keeps its default";
  }
}

TEST(DefaultView, WhoeverSaysWhereToLookFramesNothingElse) {
  ViewParameters there = kUnstatedView;
  there.look_at = Vec3{1, 2, 3};
  EXPECT_EQ(WithDefaults(there, World::kScene).fit, false);
  EXPECT_EQ(WithDefaults(there, World::kScene).azimuth_degrees, 30);
  ViewParameters from = kUnstatedView;
  from.eye = Vec3{1, 2, 3};
  EXPECT_EQ(WithDefaults(from, World::kScene).fit, false);
  EXPECT_EQ(WithDefaults(from, World::kScene).azimuth_degrees, std::nullopt) << "the eye says the direction";
  from.fit = true;
  EXPECT_EQ(WithDefaults(from, World::kScene).fit, true);
}

TEST(DefaultView, ABallAroundTwoHoldsBothAndIsNoLargerThanItMustBe) {
  Random random(73);
  SCOPED_TRACE(random.trace());
  const auto ball = [&] { return Ball{{random.Real(-9, 9), random.Real(-9, 9), random.Real(-9, 9)}, random.Real(0.1, 12)}; };
  for (int round = 0; round < 500; ++round) {
    const Ball a = ball(), b = ball(), both = BallAround(a, b);
    for (const Ball& one : {a, b}) EXPECT_LE(Length(one.centre - both.centre) + one.radius, both.radius + 1e-9);
    const double apart = Length(a.centre - b.centre);
    EXPECT_NEAR(both.radius, std::max({a.radius, b.radius, 0.5 * (apart + a.radius + b.radius)}), 1e-9);
  }
  EXPECT_EQ(BallAround({{1, 2, 3}, 4}, {{1, 2, 3}, 4}), (Ball{{1, 2, 3}, 4}));
}

}  // namespace
}  // namespace slabstream
