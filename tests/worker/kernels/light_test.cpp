// Normals in 15 bits and Phong's light.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/simd_targets.h"
#include "worker/kernels/normal_code.h"
#include "worker/kernels/phong_table.h"

namespace slabstream {
namespace {

TEST(NormalCode, IsWithinItsErrorForEveryDirection) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  double worst = 1;
  for (int i = 0; i < 200000; ++i) {
    const Vec3 n = Normalized({normal(random), normal(random), normal(random)});
    const Vec3 decoded = DecodeNormal(EncodeNormal(float(3 * n.x), float(3 * n.y), float(3 * n.z)));
    worst = std::min(worst, std::abs(Dot(n, decoded)));
  }
  EXPECT_LT(std::acos(worst) * 57.29577951308232, 0.8) << "seed " << seed;
}

TEST(NormalCode, HasExactAxesAndOneCodeForNone) {
  EXPECT_EQ(DecodeNormal(EncodeNormal(0, 0, -5)), (Vec3{0, 0, 1}));
  EXPECT_EQ(std::abs(DecodeNormal(EncodeNormal(2, 0, 0)).x), 1);
  EXPECT_EQ(std::abs(DecodeNormal(EncodeNormal(0, -2, 0)).y), 1);
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  EXPECT_EQ(EncodeNormal(0, 0, 0), kNoGradient);
  EXPECT_EQ(EncodeNormal(nan, 1, 1), kNoGradient);
  EXPECT_EQ(EncodeNormal(infinite, 1, 1), kNoGradient);
}

// The bound of phong.h.
TEST(PhongTable, IsTheDefinitionOnEveryInstructionSet) {
  const Vec3 view = Normalized(Vec3{0.3, 0.5, -0.8});
  for (float shininess : {1.0F, 20.0F, 150.0F, 1000.0F}) {
    for (const std::vector<Vec3>& lights :
         {std::vector<Vec3>{}, std::vector<Vec3>{{1, 2, 3}}, std::vector<Vec3>{{-1, 0, 0.5}, {0, 3, 0}}}) {
      Shading shading;
      shading.lights = lights;
      shading.ambient = 0.1F, shading.diffuse = 0.6F, shading.specular = 0.4F, shading.shininess = shininess;
      const Phong phong(shading, view);
      std::vector<PhongFactors> expected;
      for (std::uint16_t code = 0; code < kNoGradient; ++code) expected.push_back(phong.AtNormal(DecodeNormal(code)));
      expected.push_back(phong.WithoutGradient());
      const double bound = 2e-7 * std::max(20.0, double(shininess)) * double(std::max<std::size_t>(lights.size(), 1));
      ForEachTarget([&] {
        const std::vector<PhongFactors> got = PhongTable(shading, view);
        ASSERT_EQ(got.size(), expected.size());
        for (std::size_t code = 0; code < got.size(); ++code) {
          ASSERT_NEAR(got[code].diffuse, expected[code].diffuse, bound) << "shininess " << shininess << " code " << code;
          ASSERT_NEAR(got[code].specular, expected[code].specular, bound) << "shininess " << shininess << " code " << code;
        }
      });
    }
  }
  Shading plain;
  plain.model = ShadingModel::kNone;
  for (const PhongFactors& factors : PhongTable(plain, view)) {
    EXPECT_EQ(factors.diffuse, 1);
    EXPECT_EQ(factors.specular, 0);
  }
}

TEST(Phong, LightsBothSidesAndEveryLight) {
  Shading shading;
  shading.lights = {{0, 0, 2}, {3, 0, 0}};
  shading.ambient = 0.1F, shading.diffuse = 0.5F, shading.specular = 0.25F, shading.shininess = 4;
  const Phong phong(shading, {0, 0, -1});
  const PhongFactors towards = phong.AtNormal({0, 0, 1}), away = phong.AtNormal({0, 0, -1});
  EXPECT_FLOAT_EQ(towards.diffuse, 0.1F + 0.5F);  // the first light head on, the second grazing
  EXPECT_FLOAT_EQ(towards.specular, 0.25F);       // the first one's mirror image is in the eye
  EXPECT_FLOAT_EQ(away.diffuse, towards.diffuse);
  EXPECT_FLOAT_EQ(away.specular, towards.specular);
  EXPECT_FLOAT_EQ(phong.WithoutGradient().diffuse, 0.1F + 2 * 0.25F);  // half of what each light gives head on
  EXPECT_FLOAT_EQ(phong.WithoutGradient().specular, 0.0F);
  EXPECT_FLOAT_EQ(phong.AtNormal({0, 1, 0}).diffuse, 0.1F);  // both graze: the rim is ambient
  EXPECT_FLOAT_EQ(phong.AtNormal({0, 1, 0}).specular, 0.0F);
  shading.model = ShadingModel::kNone;
  EXPECT_FLOAT_EQ(Phong(shading, {0, 0, -1}).AtNormal({1, 0, 0}).diffuse, 1.0F);
}

}  // namespace
}  // namespace slabstream
