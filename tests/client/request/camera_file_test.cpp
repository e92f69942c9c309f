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

}  // namespace
}  // namespace slabstream
