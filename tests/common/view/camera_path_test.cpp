#include "common/view/camera_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/common/view/random_view.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

double Apart(const ViewAxes& a, const ViewAxes& b) {
  return Length(a.right - b.right) + Length(a.up - b.up) + Length(a.forward - b.forward);
}
ViewAxes AxesAt(const CameraPath& path, double seconds) {
  const ViewParameters view = path.At(seconds);
  return AxesOf(view, view.look_at.value_or(Vec3{}));
}

ViewParameters RandomStop(Random& random, Projection projection) {
  ViewParameters view = RandomView(random);
  view.projection = projection;
  view.look_at = Vec3{random.Real(-50, 50), random.Real(-50, 50), random.Real(-50, 50)};
  if (projection == Projection::kPerspective && random.Chance(0.5)) {
    view.eye = *view.look_at + random.Real(100, 400) * RandomAxes(random)[0];
    if (random.Chance(0.5)) view.up = RandomAxes(random)[0];
  } else if (projection == Projection::kPerspective) {
    view.distance = random.Real(100, 400);
  }
  return view;
}

std::vector<PathCamera> RandomStops(Random& random, int count, double longest_step = 3) {
  const Projection projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
  std::vector<PathCamera> cameras;
  double seconds = random.Real(-5, 5);
  for (int i = 0; i < count; ++i) cameras.push_back({seconds += random.Real(0.5, longest_step), RandomStop(random, projection)});
  return cameras;
}

TEST(CameraPath, PassesThroughItsCamerasAtTheirTimes) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 200; ++round) {
    const std::vector<PathCamera> cameras = RandomStops(random, random.Integer(2, 6));
    const CameraPath path = CameraPath::Make(cameras).value();
    EXPECT_EQ(path.begin_seconds(), cameras.front().seconds);
    EXPECT_EQ(path.end_seconds(), cameras.back().seconds);
    EXPECT_EQ(path.At(cameras.front().seconds - 1), cameras.front().view);
    EXPECT_EQ(path.At(cameras.back().seconds + 1), cameras.back().view);
    for (const auto& [seconds, view] : cameras) {
      EXPECT_EQ(path.At(seconds), view) << "bit by bit, so that the picture is the camera's";
      // There is no jump, neither of what is seen nor of where from.
      for (const double beside : {seconds - 1e-7, seconds + 1e-7}) {
        const ViewParameters near = path.At(beside);
        EXPECT_LT(Apart(AxesAt(path, beside), AxesOf(view, *view.look_at)), 1e-4);
        EXPECT_LT(Length(*near.look_at - *view.look_at), 1e-3);
        EXPECT_NEAR(near.zoom, view.zoom, 1e-4 * view.zoom);
        const double distance = view.eye ? Length(*view.look_at - *view.eye) : view.distance;
        EXPECT_NEAR(near.eye ? Length(*near.look_at - *near.eye) : near.distance, distance, 1e-3);
      }
    }
  }
}

// What changes evenly goes on evenly: splines of Catmull and Rom reproduce straight lines, whatever the times are.
TEST(CameraPath, EvenMovementsStayEven) {
  const auto at = [](double t) {
    return ViewParameters{.azimuth_degrees = 20 + 15 * t, .zoom = std::exp(0.3 * t), .look_at = Vec3{t, -2 * t, 5}};
  };
  std::vector<PathCamera> cameras;
  for (const double t : {0.0, 1.0, 2.5, 3.0, 7.0}) cameras.push_back({t, at(t)});
  const CameraPath path = CameraPath::Make(cameras).value();
  for (double t = 0; t <= 7; t += 0.13) {
    const ViewParameters view = path.At(t), expected = at(t);
    EXPECT_NEAR(*view.azimuth_degrees, *expected.azimuth_degrees, 1e-9);
    EXPECT_NEAR(*view.elevation_degrees, 0, 1e-9);
    EXPECT_NEAR(view.roll_degrees, 0, 1e-9);
    EXPECT_NEAR(view.zoom, expected.zoom, 1e-9);
    EXPECT_LT(Length(*view.look_at - *expected.look_at), 1e-9);
  }
}

TEST(CameraPath, SpeedHasNoJumpAtACamera) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 100; ++round) {
    const std::vector<PathCamera> cameras = RandomStops(random, 4);
    const CameraPath path = CameraPath::Make(cameras).value();
    for (const std::size_t i : {1U, 2U}) {
      constexpr double kStep = 1e-5;
      const double seconds = cameras[i].seconds;
      const ViewAxes before = AxesAt(path, seconds - kStep), there = AxesAt(path, seconds), after = AxesAt(path, seconds + kStep);
      EXPECT_LT(Length((there.forward - before.forward) - (after.forward - there.forward)), 1e-2 * kStep);
      const auto target = [&](double t) { return *path.At(t).look_at; };
      EXPECT_LT(Length((target(seconds) - target(seconds - kStep)) - (target(seconds + kStep) - target(seconds))), 1e-1 * kStep);
    }
  }
}

TEST(CameraPath, TurnsTheShortestWay) {
  const CameraPath path = CameraPath::Make(std::vector<PathCamera>{{0, {.azimuth_degrees = 350}}, {1, {.azimuth_degrees = 10}}}).value();
  EXPECT_NEAR(std::cos((*path.At(0.5).azimuth_degrees) * std::numbers::pi / 180), 1, 1e-12);
  // Over a pole, where azimuth means nothing.
  const CameraPath over =
      CameraPath::Make(std::vector<PathCamera>{{0, {.elevation_degrees = 80}},
                                               {1, {.azimuth_degrees = 180, .elevation_degrees = 80, .roll_degrees = 180}}})
          .value();
  EXPECT_NEAR(*over.At(0.5).elevation_degrees, 90, 1e-6);
  EXPECT_LT(Length(AxesAt(over, 0.5).up - Vec3{0, 1, 0}), 1e-6);
}

TEST(CameraPath, SaysWhichCameraDoesNotSuit) {
  const ViewParameters plain{.look_at = Vec3{}};
  const auto refusal = [](std::vector<PathCamera> cameras) {
    const Result<CameraPath> path = CameraPath::Make(cameras);
    EXPECT_EQ(path.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(path.status().message(), testing::Not(HasSubstr("\n")));
    return path.status().message();
  };
  EXPECT_EQ(refusal({{0, plain}}), "a path has 1 cameras, but must have 2 to 1000");
  EXPECT_EQ(refusal({{0, plain}, {1, plain}, {1, plain}}),
            "camera 3 of the path has the time 1, which must be more than 1 of the one before");
  ViewParameters perspective = plain;
  perspective.projection = Projection::kPerspective;
  EXPECT_EQ(refusal({{0, plain}, {1, perspective}}), "camera 2 of the path is perspective, but the first one is orthographic");
  EXPECT_EQ(refusal({{0, plain}, {1, {}}}), "camera 2 of the path has no look-at, but the first one has");
  EXPECT_EQ(refusal({{0, {.eye = Vec3{1, 2, 3}}}, {1, {}}}), "camera 1 of the path has an eye, but no look-at");
  ViewParameters near = perspective;
  near.distance = 3;
  EXPECT_EQ(refusal({{0, perspective}, {1, near}}), "camera 2 of the path has a distance or an eye, but the first one has none");
}

}  // namespace
}  // namespace slabstream
