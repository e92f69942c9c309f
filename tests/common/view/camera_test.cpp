#include "common/view/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/view/supersampled_voxel.h"
#include "common/wire/validate_request.h"
#include "tests/common/view/random_view.h"
#include "tests/common/view/view_limits.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

const VolumeGeometry kGeometry = {{40, 31, 17}, {1, 0.5, 2}};

Vec3 Centre(const VolumeGeometry& geometry) { return 0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1}); }

double Radius(const VolumeGeometry& geometry) { return 0.5 * Length(ToVec3(geometry.size) * geometry.spacing); }

Vec3 Physical(const Vec3& data_point, const VolumeGeometry& geometry) { return geometry.spacing * (data_point - Centre(geometry)); }

Vec3 DataFromPhysical(const Vec3& point, const VolumeGeometry& geometry) { return point / geometry.spacing + Centre(geometry); }

TEST(Camera, LooksAsTheConventionSays) {
  struct Case {
    double azimuth, elevation, roll;
    Vec3 forward, right, up;
  };
  const Case cases[] = {
      {0, 0, 0, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}},      {90, 0, 0, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      {180, 0, 0, {0, -1, 0}, {-1, 0, 0}, {0, 0, 1}},  {-90, 0, 0, {1, 0, 0}, {0, -1, 0}, {0, 0, 1}},
      {0, 90, 0, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}},    {0, -90, 0, {0, 0, 1}, {1, 0, 0}, {0, -1, 0}},
      {90, 90, 0, {0, 0, -1}, {0, 1, 0}, {-1, 0, 0}},  {0, 0, 90, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}},
      {450, 0, 360, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::Message() << "azimuth " << c.azimuth << " elevation " << c.elevation << " roll " << c.roll);
    ViewParameters view;
    view.azimuth_degrees = c.azimuth;
    view.elevation_degrees = c.elevation;
    view.roll_degrees = c.roll;
    const Camera camera = MakeCamera(view, {64, 48}, kGeometry);
    // Exact: axis-parallel views have axis-parallel rays.
    EXPECT_EQ(camera.view_direction, c.forward);
    EXPECT_EQ(camera.right, c.right);
    EXPECT_EQ(camera.up, c.up);
    // The eye lies against the view direction.
    const Vec3 eye = Physical(camera.eye, kGeometry);
    ExpectNear(Normalized(eye), -c.forward, 1e-12);
  }
}

TEST(Camera, PutsPlusXToTheRightAndPlusZToTheTop) {
  const Camera camera = MakeCamera({}, {100, 100}, kGeometry);
  const Vec3 centre = Centre(kGeometry);
  EXPECT_GT(camera.Project(centre + Vec3{5, 0, 0}).x, 50);
  EXPECT_LT(camera.Project(centre + Vec3{0, 0, 5}).y, 50);
  EXPECT_GT(camera.Project(centre + Vec3{0, 5, 0}).depth, camera.Project(centre).depth);
}

TEST(Camera, RollTurnsThePictureClockwise) {
  ViewParameters view;
  view.roll_degrees = 90;
  const Camera camera = MakeCamera(view, {100, 100}, kGeometry);
  const Camera::ImagePoint top = camera.Project(Centre(kGeometry) + Vec3{0, 0, 5});  // was above the centre
  EXPECT_GT(top.x, 51);
  EXPECT_NEAR(top.y, 50, 1e-9);
}

TEST(Camera, FrameIsOrthonormalForAnyAngles) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 500; ++i) {
    const Camera camera = MakeCamera(RandomView(random), {33, 57}, kGeometry);
    EXPECT_NEAR(Length(camera.right), 1, 1e-12);
    EXPECT_NEAR(Length(camera.up), 1, 1e-12);
    ExpectNear(Cross(camera.right, camera.view_direction), camera.up, 1e-12);
  }
}

TEST(Camera, BoundingSphereTouchesTheShorterSideAtZoomOne) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  const double radius = Radius(kGeometry);
  for (int i = 0; i < 100; ++i) {
    ViewParameters view = RandomView(random);
    view.zoom = 1;
    const ImageSize size = {random.Integer(20, 300), random.Integer(20, 300)};
    const Camera camera = MakeCamera(view, size, kGeometry);
    // The silhouette as seen from the eye: orthographic, the great circle; perspective, where tangents touch the sphere.
    const double distance = Length(Physical(camera.eye, kGeometry));
    const double towards_eye = view.projection == Projection::kPerspective ? radius * radius / distance : 0;
    const double ring = std::sqrt(radius * radius - towards_eye * towards_eye);
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (int degree = 0; degree < 360; ++degree) {
      const double angle = degree * std::numbers::pi / 180;
      const Vec3 point = ring * std::cos(angle) * camera.right + ring * std::sin(angle) * camera.up - towards_eye * camera.view_direction;
      const auto [x, y, depth] = camera.Project(DataFromPhysical(point, kGeometry));
      left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
      EXPECT_GT(depth, 0);
    }
    const double side = std::min(camera.width, camera.height);
    EXPECT_NEAR(right - left, side, 1e-6 * side);
    EXPECT_NEAR(bottom - top, side, 1e-6 * side);
    EXPECT_NEAR(left + right, camera.width, 1e-6 * side);
    EXPECT_NEAR(top + bottom, camera.height, 1e-6 * side);
  }
}

TEST(Camera, ProjectAndRayAtAreInverse) {
  Random random(13);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 1000; ++i) {
    const ViewParameters view = RandomView(random);
    const Camera camera = MakeCamera(view, {random.Integer(1, 500), random.Integer(1, 500)}, kGeometry);
    const Vec3 point = {random.Real(-0.5, 39.5), random.Real(-0.5, 30.5), random.Real(-0.5, 16.5)};
    const auto [x, y, depth] = camera.Project(point);
    EXPECT_GT(depth, 0);
    const Camera::Ray ray = camera.RayAt(x, y);
    ExpectNear(ray.origin + depth * ray.direction, point, 1e-8);
    // Depth is the distance from the eye plane.
    EXPECT_NEAR(depth, Dot(Physical(point, kGeometry) - Physical(camera.eye, kGeometry), camera.view_direction), 1e-9);
  }
}

TEST(Camera, TraversesTheAxisNearestToTheViewDirectionInAllOctants) {
  for (double azimuth : {45, 135, 225, 315}) {
    for (double elevation : {-30, 30}) {
      ViewParameters view;
      view.azimuth_degrees = azimuth + 10;
      view.elevation_degrees = elevation;
      const Camera camera = MakeCamera(view, {64, 64}, kGeometry);
      const Vec3 d = camera.view_direction;
      for (Axis axis : kAxes) EXPECT_LE(std::abs(d[axis]), std::abs(d[camera.traversal_axis]));
      EXPECT_EQ(camera.ascending, d[camera.traversal_axis] > 0);
      // Slices come nearest first.
      Vec3 next = Centre(kGeometry);
      next[camera.traversal_axis] += camera.ascending ? 1 : -1;
      EXPECT_GT(camera.Project(next).depth, camera.Project(Centre(kGeometry)).depth);
    }
  }
}

TEST(Camera, TiesOfTheTraversalAxisGoToTheHigherAxis) {
  const double magic = std::atan(1 / std::sqrt(2.0)) * 180 / std::numbers::pi;  // elevation at which all three axes tie
  for (double turn : {-720, -360, 0, 360, 720}) {
    for (double azimuth : {45, 135, 225, 315}) {
      ViewParameters view;
      view.azimuth_degrees = turn + azimuth;
      EXPECT_EQ(MakeCamera(view, {64, 64}, kGeometry).traversal_axis, Axis::kY);
      view.elevation_degrees = magic;
      EXPECT_EQ(MakeCamera(view, {64, 64}, kGeometry).traversal_axis, Axis::kZ);
    }
  }
}

TEST(Camera, SupersamplesJustEnough) {
  Random random(14);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    ViewParameters view = RandomView(random);
    view.zoom = std::exp(random.Real(-4, 3));
    const Camera camera = MakeCamera(view, {64, 48}, kGeometry, Least(kGeometry.spacing));
    ASSERT_LT(camera.supersample, kMaxSupersample);
    EXPECT_EQ(camera.width, 64 * camera.supersample);
    EXPECT_EQ(camera.height, 48 * camera.supersample);
    double widest = 0;  // voxels a pixel, at the corners of the volume
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 q = {corner & 1 ? 39.5 : -0.5, corner & 2 ? 30.5 : -0.5, corner & 4 ? 16.5 : -0.5};
      const auto [x, y, depth] = camera.Project(q);
      const auto a = camera.RayAt(x, y), b = camera.RayAt(x + 1, y);
      const Vec3 step = (b.origin + depth * b.direction) - (a.origin + depth * a.direction);
      widest = std::max(widest, Length(step * kGeometry.spacing) / 0.5);
    }
    EXPECT_LE(widest, kMaxVoxelsPerPixel * (1 + 1e-9));
    // Half of it would not do, but for the distance between the volume and its bounding sphere.
    if (camera.supersample > 1 && view.projection == Projection::kOrthographic) {
      EXPECT_GT(2 * widest, kMaxVoxelsPerPixel * (1 - 1e-9));
    }
  }
}

// The picture's camera sees what the supersampled one sees, in wider pixels.
TEST(Camera, SupersamplingOnlyDividesPixels) {
  Random random(15);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    ViewParameters view = RandomView(random);
    view.zoom = std::exp(random.Real(-4, 1));
    const Camera wide = MakeCamera(view, {64, 48}, kGeometry), fine = MakeCamera(view, {64, 48}, kGeometry, Least(kGeometry.spacing));
    EXPECT_EQ(wide.supersample, 1);
    const Vec3 point = {random.Real(-0.5, 39.5), random.Real(-0.5, 30.5), random.Real(-0.5, 16.5)};
    const auto in_wide = wide.Project(point), in_fine = fine.Project(point);
    EXPECT_NEAR(in_fine.x, in_wide.x * fine.supersample, 1e-9 * fine.width);
    EXPECT_NEAR(in_fine.y, in_wide.y * fine.supersample, 1e-9 * fine.width);
    EXPECT_EQ(in_fine.depth, in_wide.depth);
  }
}

// Not by the shortest side of very flat voxels, which would take as many pixels as if there were cubes of that side.
TEST(Camera, SupersamplesFlatVoxelsLikeCubes) {
  EXPECT_EQ(SupersampledVoxel({{30, 40, 50}, {0.5, 0.5, 0.5}}), 0.5);
  EXPECT_EQ(SupersampledVoxel({{512, 512, 60}, {0.5, 0.5, 5}}), 0.5) << "a usual scan";
  const VolumeGeometry flat = {{24, 24, 24}, {300, 300, 1}};
  EXPECT_EQ(SupersampledVoxel(flat), 6) << "a quarter of the thinnest side";
  EXPECT_LE(MakeCamera({}, {256, 256}, flat, SupersampledVoxel(flat)).supersample, 4);
}

// Slices along the nearest axis lie too far apart for their voxels.
TEST(Camera, TraversesCloseSlices) {
  const VolumeGeometry flat = {{24, 24, 24}, {300, 300, 1}};
  const auto axis = [&](double elevation, Projection projection = Projection::kOrthographic) {
    return MakeCamera({.projection = projection, .azimuth_degrees = 20, .elevation_degrees = elevation}, {64, 64}, flat).traversal_axis;
  };
  EXPECT_EQ(axis(0), Axis::kY);
  EXPECT_EQ(axis(20), Axis::kZ);
  EXPECT_EQ(axis(-20), Axis::kZ);
  EXPECT_EQ(axis(90), Axis::kZ);
  EXPECT_EQ(axis(20, Projection::kPerspective), Axis::kZ);
  // Not slices that the eye is next to.
  const VolumeGeometry high = {{24, 24, 2400}, {300, 300, 1}};
  ViewParameters view = {.azimuth_degrees = 20, .elevation_degrees = 3};
  EXPECT_EQ(MakeCamera(view, {64, 64}, high).traversal_axis, Axis::kZ);
  view.projection = Projection::kPerspective;
  EXPECT_EQ(MakeCamera(view, {64, 64}, high).traversal_axis, Axis::kY);
}

TEST(Camera, SupersamplingIsBounded) {
  ViewParameters view;
  view.zoom = kMinZoom;
  const Camera camera = MakeCamera(view, {1, 1}, {{4096, 4096, 4096}, {1, 1, 1}}, 1);
  EXPECT_EQ(camera.supersample, kMaxSupersample);
}

TEST(Camera, ValidateNamesTheFieldAndTheLimits) {
  EXPECT_TRUE(Validate(ViewParameters{}).ok());
  const auto message = [](auto change) {
    ViewParameters view;
    change(view);
    const Status status = Validate(view);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.message();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(message([](auto& v) { v.zoom = 0; }), "view.zoom is 0, but must lie in [0.001, 10000]");
  EXPECT_EQ(message([](auto& v) { v.fov_degrees = 90; }), "view.fov_degrees is 90, but must lie in [1, 60] degrees");
  for (double bad : {kNan, kInfinity, -kInfinity, 2e6}) {
    EXPECT_NE(message([&](auto& v) { v.azimuth_degrees = bad; }).find("view.azimuth"), std::string::npos);
    EXPECT_NE(message([&](auto& v) { v.elevation_degrees = bad; }).find("view.elevation"), std::string::npos);
    EXPECT_NE(message([&](auto& v) { v.roll_degrees = bad; }).find("view.roll"), std::string::npos);
    EXPECT_NE(message([&](auto& v) { v.zoom = bad; }).find("view.zoom"), std::string::npos);
    EXPECT_NE(message([&](auto& v) { v.fov_degrees = bad; }).find("view.fov"), std::string::npos);
  }
  EXPECT_NE(message([](auto& v) { v.projection = Projection{9}; }).find("view.projection is 9"), std::string::npos);
  EXPECT_EQ(Validate(ImageSize{0, 5}).message(), "size.width is 0, but must lie in [1, 16384] pixels");
  EXPECT_EQ(Validate(ImageSize{5, 16385}).message(), "size.height is 16385, but must lie in [1, 16384] pixels");
  EXPECT_TRUE(Validate(ImageSize{16384, 4096}).ok());
  EXPECT_EQ(Validate(ImageSize{16384, 4097}).code(), StatusCode::kInvalidArgument);
}

// An oblique volume is seen as the same voxels would be that are turned in the world.
TEST(Camera, SeesAnObliqueVolumeWhereItLies) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const double a = random.Real(-1, 1), b = random.Real(-1, 1);
    VolumeGeometry oblique = kGeometry;
    oblique.orientation.axes[0] = {std::cos(a), std::sin(a), 0};
    oblique.orientation.axes[1] = {-std::sin(a) * std::cos(b), std::cos(a) * std::cos(b), std::sin(b)};
    oblique.orientation.axes[2] = Cross(oblique.orientation.axes[0], oblique.orientation.axes[1]);
    const ViewParameters view = RandomView(random);
    const Camera camera = MakeCamera(view, {200, 150}, oblique), straight = MakeCamera(view, {200, 150}, kGeometry);
    const Vec3 voxel = {random.Real(0, 39), random.Real(0, 30), random.Real(0, 16)};
    const Vec3 in_world = oblique.orientation.ToWorld(Physical(voxel, oblique));
    const Camera::ImagePoint seen = camera.Project(voxel), expected = straight.Project(DataFromPhysical(in_world, kGeometry));
    EXPECT_NEAR(seen.x, expected.x, 1e-7 * view.zoom);
    EXPECT_NEAR(seen.y, expected.y, 1e-7 * view.zoom);
    EXPECT_NEAR(seen.depth, expected.depth, 1e-9);
  }
}

VolumeGeometry RandomPlace(Random& random) {
  VolumeGeometry geometry = kGeometry;
  const double a = random.Real(-1, 1);
  geometry.orientation = {World::kPatient,
                          {random.Real(-100, 100), random.Real(-100, 100), random.Real(-100, 100)},
                          {Vec3{std::cos(a), std::sin(a), 0}, Vec3{-std::sin(a), std::cos(a), 0}, Vec3{0, 0, 1}}};
  return geometry;
}

Vec3 WorldOf(const Vec3& voxel, const VolumeGeometry& geometry) {
  return geometry.orientation.origin + geometry.orientation.ToWorld(geometry.spacing * voxel);
}

Vec3 RandomVoxel(Random& random) { return {random.Real(0, 39), random.Real(0, 30), random.Real(0, 16)}; }

TEST(Camera, ShowsItsTargetInTheMiddleOfThePicture) {
  Random random(32);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const VolumeGeometry geometry = RandomPlace(random);
    const Vec3 voxel = RandomVoxel(random);
    ViewParameters view = RandomView(random);
    view.look_at = WorldOf(voxel, geometry);
    if (view.projection == Projection::kPerspective && random.Chance(0.5)) view.distance = random.Real(1, 500);
    const Camera camera = MakeCamera(view, {200, 150}, geometry);
    const Camera::ImagePoint seen = camera.Project(voxel);
    EXPECT_NEAR(seen.x, 100, 1e-6);
    EXPECT_NEAR(seen.y, 75, 1e-6);
    if (view.distance > 0) {
      EXPECT_NEAR(seen.depth, view.distance, 1e-9);
    }
  }
}

TEST(Camera, StandsWhereItsEyeIs) {
  Random random(33);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const VolumeGeometry geometry = RandomPlace(random);
    ViewParameters view = RandomView(random);
    view.projection = Projection::kPerspective;
    view.roll_degrees = 0;
    view.look_at = WorldOf(RandomVoxel(random), geometry);
    view.eye = *view.look_at + Vec3{random.Real(-300, 300), random.Real(-300, 300), random.Real(-300, 300)};
    view.up = Vec3{random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)};
    const Camera camera = MakeCamera(view, {200, 150}, geometry);
    ExpectNear(WorldOf(camera.eye, geometry), *view.eye, 1e-8);
    ExpectNear(geometry.orientation.ToWorld(camera.view_direction), Normalized(*view.look_at - *view.eye), 1e-12);
    const Vec3 up = geometry.orientation.ToWorld(camera.up);
    EXPECT_GT(Dot(up, *view.up), 0);
    // `up` lies in the plane of the view direction and the wanted direction.
    EXPECT_NEAR(Dot(geometry.orientation.ToWorld(camera.right), *view.up), 0, 1e-9);
  }
}

TEST(Camera, ThatIsAllowedSeesTheWholeVolumeBeforeIt) {
  Random random(34);
  SCOPED_TRACE(random.trace());
  int allowed = 0;
  for (int i = 0; i < 1000; ++i) {
    const VolumeGeometry geometry = RandomPlace(random);
    ViewParameters view = RandomView(random);
    if (random.Chance(0.7)) view.look_at = WorldOf(1.5 * RandomVoxel(random), geometry);
    if (random.Chance(0.5)) {
      view.eye = WorldOf(3 * RandomVoxel(random) - Vec3{40, 30, 16}, geometry);
    } else if (view.projection == Projection::kPerspective) {
      view.distance = random.Chance(0.5) ? random.Real(1, 100) : 0;
    }
    ASSERT_TRUE(Validate(view).ok()) << Validate(view).message();
    if (!CheckView(view, geometry).ok()) continue;
    ++allowed;
    const Camera camera = MakeCamera(view, {200, 150}, geometry);
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p = {corner & 1 ? 39.5 : -0.5, corner & 2 ? 30.5 : -0.5, corner & 4 ? 16.5 : -0.5};
      EXPECT_GT(camera.Project(p).depth, 0);
    }
    if (camera.projection != Projection::kPerspective) continue;
    const double eye = camera.eye[camera.traversal_axis];
    EXPECT_TRUE(camera.ascending ? eye < -0.5 : eye > geometry.size[camera.traversal_axis] - 0.5);
  }
  EXPECT_GT(allowed, 300);
}

// The outline of a ball that the view was fitted to touches the shorter side of the picture.
TEST(Camera, FitsABall) {
  Random random(35);
  SCOPED_TRACE(random.trace());
  int seen = 0;
  for (int i = 0; i < 300; ++i) {
    const VolumeGeometry geometry = RandomPlace(random);
    const Vec3 centre = RandomVoxel(random);
    const double radius = random.Real(2, 8);
    ViewParameters view = RandomView(random);
    view.zoom = 1;
    view.fit = true;
    const ViewParameters fitted = FitView(view, geometry, {geometry.ToWorld(centre), radius});
    EXPECT_EQ(fitted.fit, false);
    if (!CheckView(fitted, geometry).ok()) continue;
    ++seen;
    const Camera camera = MakeCamera(fitted, {200, 150}, geometry);
    double farthest = 0;
    for (int k = 0; k < 20000; ++k) {
      const double z = random.Real(-1, 1), angle = random.Real(0, 7), r = std::sqrt(1 - z * z);
      const Vec3 on = centre + radius * Vec3{r * std::cos(angle), r * std::sin(angle), z} / geometry.spacing;
      const Camera::ImagePoint at = camera.Project(on);
      farthest = std::max(farthest, std::hypot(at.x - 100, at.y - 75));
    }
    EXPECT_NEAR(farthest, 75, 0.2);
    if (seen == 40) break;
  }
  EXPECT_EQ(seen, 40);
}

TEST(Camera, PointsOfALargeWorldAreLikeThoseOfASmallOne) {
  for (const double scale : {1e-20, 1e22, 1e120}) {
    const VolumeGeometry scaled = {kGeometry.size, scale * kGeometry.spacing};
    for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      const ViewParameters view{.projection = projection, .look_at = Vec3{3, 4, 5}, .eye = Vec3{100, -200, 300}};
      ViewParameters large = view;
      large.look_at = scale * *view.look_at;
      large.eye = scale * *view.eye;
      ASSERT_TRUE(Validate(large).ok() && CheckView(large, scaled).ok()) << CheckView(large, scaled).message();
      const Camera expected = MakeCamera(view, {64, 48}, kGeometry), found = MakeCamera(large, {64, 48}, scaled);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found.eye[int(i)], expected.eye[int(i)], 1e-9);
    }
  }
}

TEST(Camera, SaysWhichViewsCannotBeHad) {
  const auto refusal = [](const ViewParameters& view) {
    Status status = Validate(view);
    if (status.ok()) status = CheckView(view, kGeometry);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.message();
  };
  EXPECT_EQ(refusal({.up = Vec3{0, 0, 1}}), "view.up needs view.eye; without an eye, view.roll_degrees turns the picture");
  EXPECT_EQ(refusal({.distance = 3}), "view.distance needs a perspective projection; view.zoom magnifies orthographic pictures");
  EXPECT_EQ(refusal({.projection = Projection::kPerspective, .eye = Vec3{9, 9, 9}, .distance = 3}),
            "view.distance and view.eye cannot both be given");
  EXPECT_EQ(refusal({.look_at = Vec3{1, 2, 3}, .eye = Vec3{1, 2, 3}}), "view.eye is at the point that it looks at");
  EXPECT_EQ(refusal({.look_at = Vec3{0, 0, 0}, .eye = Vec3{0, 0, 90}, .up = Vec3{0, 0, -2}}), "view.up points along the direction of view");
  EXPECT_EQ(refusal({.look_at = Vec3{1, std::numeric_limits<double>::quiet_NaN(), 3}}),
            "view.look_at.y is nan, but must lie in [-1e+300, 1e+300]");
  EXPECT_THAT(refusal({.look_at = Vec3{1e300, 0, 0}}), HasSubstr("view.look_at is 1e+300 from the volume's centre, but must be at most"));
  EXPECT_THAT(refusal({.eye = Vec3{0, 0, 1e13}}), HasSubstr("view.eye is 1e+13 from the point that it looks at, but must be at most"));
  EXPECT_THAT(refusal({.projection = Projection::kPerspective, .distance = 1e200}), HasSubstr("view.distance: the eye is 1e+200 from"));
  EXPECT_EQ(refusal({.look_at = Vec3{1, 2, 3}, .fit = true}), "view.fit and view.look_at cannot both be given");
  // The volume is 15.5 deep along y, so its middle must be more than 7.75 away.
  EXPECT_EQ(
      refusal({.projection = Projection::kPerspective, .distance = 7}),
      "view.distance: the eye is 7 from the point that it looks at, but must be at least 7.75775 in this direction, so that the whole "
      "volume is in front of it; view.zoom magnifies the picture");
}

}  // namespace
}  // namespace slabstream
