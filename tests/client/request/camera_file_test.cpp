#include "client/request/camera_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/view/default_view.h"

namespace slabstream {
namespace {

TEST(CameraFile, IsReadBackAsItWas) {
  const ViewParameters views[] = {
      {},
      {.projection = Projection::kPerspective,
       .azimuth_degrees = 0.1,
       .elevation_degrees = -20,
       .roll_degrees = 3,
       .zoom = 2.5,
       .fov_degrees = 17},
      {.projection = Projection::kPerspective, .look_at = Vec3{1, 2.25, -3}, .distance = 400},
      {.look_at = Vec3{1e-9, 0, 0}, .eye = Vec3{100, 0, 0}, .up = Vec3{0, 1, 1}},
      {.azimuth_degrees = 180, .fit = true, .of_patient = true},
      kUnstatedView,
      {.elevation_degrees = std::nullopt, .fit = std::nullopt},
  };
  for (const ViewParameters& view : views) {
    const Result<ViewParameters> read = ParseCamera(CameraText(view));
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(*read, view);
  }
}

TEST(CameraFile, MistakesNameFieldValueAndLimit) {
  const std::pair<const char*, const char*> cases[] = {
      {"{\"azimuth\": 1e7}", "azimuth"},
      {"{\"zoom\": 0}", "zoom"},
      {"{\"zom\": 1}", "zom"},
      {"{\"look_at\": [1, 2]}", "look-at '1,2' is not X,Y,Z"},
      {"{\"eye\": [1, 2, \"x\"]}", "eye"},
      {"{\"of_patient\": 3}", "of-patient '3' is neither true nor false"},
      {"{\"up\": [0, 0, 1]}", "view.up needs view.eye"},
      {"[1]", "must be an object"},
      {"{", "not JSON"},
  };
  for (const auto& [text, expected] : cases) {
    const Result<ViewParameters> read = ParseCamera(text);
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_EQ(read.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(read.status().message(), testing::AllOf(testing::HasSubstr(expected), testing::Not(testing::HasSubstr("\n")))) << text;
  }
}

TEST(CameraPathFile, IsAListOfCameras) {
  const Result<PathText> path = ParseCameraPath(R"([{"time": -1, "azimuth": 30}, {"time": 2.5, "look-at": [1, 2, 3], "fit": false}])");
  ASSERT_TRUE(path.ok()) << path.status().message();
  EXPECT_TRUE(path->timed);
  EXPECT_EQ(path->seconds(), 3.5);
  ViewParameters first = kUnstatedView, second = kUnstatedView;
  first.azimuth_degrees = 30;
  second.look_at = Vec3{1, 2, 3};
  second.fit = false;
  EXPECT_EQ(path->cameras[0].view, first);
  EXPECT_EQ(path->cameras[1].view, second);
  const Result<PathText> even = ParseCameraPath("[{}, {}, {}]");
  ASSERT_TRUE(even.ok());
  EXPECT_FALSE(even->timed);
  EXPECT_EQ(even->cameras[2].seconds - even->cameras[1].seconds, even->cameras[1].seconds - even->cameras[0].seconds);
}

TEST(CameraPathFile, MistakesNameTheCamera) {
  const std::pair<const char*, const char*> cases[] = {
      {"{}", "a path is a list of 2 to 1000 cameras"},
      {"[{}]", "a path is a list of 2 to 1000 cameras"},
      {"[{}, {\"zoom\": 0}]", "camera 2 of the path: zoom"},
      {"[{}, 3]", "camera 2 of the path: "},
      {"[{\"tim\": 3}, {}]", "camera 1 of the path: "},
      {"[{\"time\": \"x\"}, {}]", "camera 1 of the path: "},
      {"[{\"time\": 3}, {}]", "camera 2 of the path has no time, but the first one has one"},
      {"[{}, {\"time\": 3}]", "camera 2 of the path has a time, but the first one has none"},
      {"[", "not JSON"},
  };
  for (const auto& [text, expected] : cases) {
    const Result<PathText> read = ParseCameraPath(text);
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_EQ(read.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(read.status().message(), testing::AllOf(testing::HasSubstr(expected), testing::Not(testing::HasSubstr("\n")))) << text;
  }
}

}  // namespace
}  // namespace slabstream
