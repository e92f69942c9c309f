#include "common/wire/validate_request.h"

#include <gtest/gtest.h>

#include <limits>

namespace slabstream {
namespace {

TEST(Shading, DefaultIsValid) { EXPECT_TRUE(Validate(Shading{}).ok()); }

TEST(Shading, ValidateNamesTheFieldAndTheLimits) {
  const auto message = [](auto change) {
    Shading shading;
    change(shading);
    const Status status = Validate(shading);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.message();
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(message([](auto& s) { s.ambient = -1; }), "shading.ambient is -1, but must lie in [0, 1]");
  EXPECT_EQ(message([](auto& s) { s.diffuse = 2; }), "shading.diffuse is 2, but must lie in [0, 1]");
  EXPECT_NE(message([&](auto& s) { s.specular = kNan; }).find("shading.specular"), std::string::npos);
  EXPECT_EQ(message([](auto& s) { s.shininess = 0; }), "shading.shininess is 0, but must lie in [1, 1000]");
  EXPECT_EQ(message([](auto& s) { s.shadows = 1.5F; }), "shading.shadows is 1.5, but must lie in [0, 1]");
  EXPECT_EQ(message([](auto& s) { s.ambient_occlusion = -1; }), "shading.ambient_occlusion is -1, but must lie in [0, 1]");
  EXPECT_EQ(message([](auto& s) { s.occlusion_radius = 2; }), "shading.occlusion_radius is 2, but must lie in [0.01, 1] longest sides");
  EXPECT_NE(message([](auto& s) { s.lights.resize(9, Vec3{0, 0, 1}); }).find("shading.lights has 9"), std::string::npos);
}

TEST(Shading, LightsMustBeDirections) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const Vec3& light : {Vec3{0, 0, 0}, Vec3{1, kInfinity, 0}, Vec3{std::numeric_limits<double>::quiet_NaN(), 0, 1}, Vec3{1e300, 0, 0},
                            Vec3{0, 1e-300, 0}}) {
    Shading shading;
    shading.lights = {{0, 0, 1}, light};
    EXPECT_NE(Validate(shading).message().find("shading.lights[1]"), std::string::npos);
  }
}

}  // namespace
}  // namespace slabstream
