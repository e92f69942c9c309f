#include "common/classification/transfer_region.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/classification/region_table.h"
#include "tests/support/random.h"
#include "tests/support/random_transfer.h"

namespace slabstream {
namespace {

constexpr Rgb kOneColor = {1, 0, 0}, kOtherColor = {0, 0, 1};

TransferRegion BoxOf(RegionCorner from, RegionCorner to, double opacity, double softness, const Rgb& color = kOneColor) {
  return {{from, {to.value, from.slope}, to, {from.value, to.slope}}, color, opacity, softness};
}

TEST(TransferRegion, HasItsOpacityInsideAndNoneOutside) {
  const std::vector<TransferRegion> hard = {BoxOf({10, 5}, {20, 9}, 0.6, 0)};
  EXPECT_DOUBLE_EQ(LookAt(hard, 15, 7).opacity, 0.6);
  EXPECT_EQ(LookAt(hard, 15, 7).color, kOneColor);
  EXPECT_DOUBLE_EQ(LookAt(hard, 10.001, 5.001).opacity, 0.6);
  for (const auto& [value, slope] : {RegionCorner{9.999, 7}, {20.001, 7}, {15, 4.999}, {15, 9.001}, {15, 0}}) {
    EXPECT_EQ(LookAt(hard, value, slope).opacity, 0) << value << " " << slope;
  }
  // A triangle with its right angle at the origin.
  const std::vector<TransferRegion> triangle = {{{{0, 0}, {4, 0}, {0, 4}}, kOneColor, 1, 0}};
  EXPECT_EQ(LookAt(triangle, 1, 2.9).opacity, 1);
  EXPECT_EQ(LookAt(triangle, 1, 3.1).opacity, 0);
}

TEST(TransferRegion, BorderRisesLinearly) {
  // 10 wide and 4 high; half of the way to the middle is soft.
  const std::vector<TransferRegion> soft = {BoxOf({10, 6}, {20, 10}, 0.8, 0.5)};
  for (const double share : {0.0, 0.05, 0.125, 0.2, 0.25, 0.4, 0.5}) {
    const double expected = 0.8 * std::min(share / 0.25, 1.0);
    EXPECT_NEAR(LookAt(soft, 10 + 10 * share, 8).opacity, expected, 1e-12) << share;
    EXPECT_NEAR(LookAt(soft, 20 - 10 * share, 8).opacity, expected, 1e-12) << share;
    EXPECT_NEAR(LookAt(soft, 15, 6 + 4 * share).opacity, expected, 1e-12) << share;
    EXPECT_NEAR(LookAt(soft, 15, 10 - 4 * share).opacity, expected, 1e-12) << share;
  }
  // There are no slopes below 0, so nothing is soft there.
  const std::vector<TransferRegion> flat = {BoxOf({10, 0}, {20, 10}, 0.8, 1)};
  EXPECT_DOUBLE_EQ(LookAt(flat, 15, 0).opacity, 0.8);
}

TEST(TransferRegion, ThatOverlapMixLikeLayers) {
  const std::vector<TransferRegion> both = {BoxOf({0, 0}, {10, 10}, 0.5, 0), BoxOf({5, 0}, {15, 10}, 0.25, 0, kOtherColor)};
  const RegionLook look = LookAt(both, 7, 3);
  EXPECT_DOUBLE_EQ(look.opacity, 1 - 0.5 * 0.75);
  EXPECT_FLOAT_EQ(look.color.r, 2.0F / 3);
  EXPECT_FLOAT_EQ(look.color.b, 1.0F / 3);
}

std::vector<TransferRegion> RandomRegions(Random& random) {
  std::vector<TransferRegion> regions;
  for (int i = random.Integer(1, 4); i > 0; --i) {
    TransferRegion region{{}, {float(random.Real(0, 1)), float(random.Real(0, 1)), float(random.Real(0, 1))}};
    for (int corner = random.Integer(3, 7); corner > 0; --corner) {
      region.corners.push_back({random.Real(0, 100), random.Chance(0.3) ? 0 : random.Real(0, 40)});
    }
    region.corners.front().slope = 41;  // so that it has an area
    region.corners.back().slope = 0;
    region.opacity = random.Real(0.1, 1);
    region.softness = random.Chance(0.3) ? 0 : random.Real(0, 1);
    regions.push_back(region);
  }
  return regions;
}

// What is skipped by the curves must not show by the regions.
TEST(WithCurvesOfRegions, ShowsNothingWhereTheCurvesAreZero) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const TransferFunction transfer = WithCurvesOfRegions({.colors = {}, .opacities = {}, .regions = RandomRegions(random)});
    ASSERT_TRUE(Validate(transfer).ok()) << Validate(transfer).message();
    for (int k = 0; k < 100; ++k) {
      const double value = random.Real(-10, 110);
      double most = 0;
      for (const TransferRegion& region : transfer.regions) most = std::max(most, LookAt({region}, value, random.Real(0, 45)).opacity);
      EXPECT_LE(most, transfer.Opacity(value) + 1e-9) << value;
      EXPECT_LE(most, MaxOpacity(transfer, value - 1, value + 1) + 1e-9) << value;
    }
  }
}

TEST(Stretched, MovesRegions) {
  const TransferFunction transfer =
      WithCurvesOfRegions(Stretched({.colors = {}, .opacities = {}, .regions = {BoxOf({0, 2}, {10, 4}, 1, 0)}}, {100, 300}));
  EXPECT_EQ(BoundsOf(transfer.regions[0]).least, (RegionCorner{100, 2}));
  EXPECT_EQ(BoundsOf(transfer.regions[0]).greatest, (RegionCorner{300, 4}));
  EXPECT_EQ(transfer.Opacity(99), 0);
  EXPECT_EQ(transfer.Opacity(200), 1);
}

TEST(ValidateRegions, NamesWhatIsWrong) {
  const auto message = [](auto&& change) {
    std::vector<TransferRegion> regions = {BoxOf({0, 0}, {10, 10}, 1, 0), BoxOf({0, 0}, {10, 10}, 1, 0)};
    change(regions[1]);
    return Validate(regions).message();
  };
  using testing::HasSubstr;
  EXPECT_THAT(message([](auto& r) { r.corners.resize(2); }), HasSubstr("number of corners of region 1 is 2, must be in [3, 32]"));
  EXPECT_THAT(message([](auto& r) { r.corners[2].slope = -1; }), HasSubstr("slope of corner 2 of region 1 is -1"));
  EXPECT_THAT(message([](auto& r) { r.corners[0].value = NAN; }), HasSubstr("value of corner 0 of region 1 is nan"));
  EXPECT_THAT(message([](auto& r) { r.color.g = 2; }), HasSubstr("green of region 1 is 2"));
  EXPECT_THAT(message([](auto& r) { r.opacity = 1.5; }), HasSubstr("opacity of region 1 is 1.5"));
  EXPECT_THAT(message([](auto& r) { r.softness = -1; }), HasSubstr("softness of region 1 is -1"));
  EXPECT_THAT(message([](auto& r) {
                for (auto& c : r.corners) c.value = 3;
              }),
              HasSubstr("all corners of region 1 have the value 3"));
  EXPECT_THAT(message([](auto& r) {
                for (auto& c : r.corners) c.slope = 3;
              }),
              HasSubstr("all corners of region 1 have the slope 3"));
  EXPECT_THAT(Validate(std::vector(17, BoxOf({0, 0}, {1, 1}, 1, 0))).message(), HasSubstr("number of regions is 17, at most 16"));
}

// Next to a hard border a place of the table may lie on the other side; elsewhere opacities differ by what changes from place to place.
TEST(RegionTable, HoldsTheRegions) {
  const TransferFunction transfer = WithCurvesOfRegions(
      {.colors = {}, .opacities = {}, .gradient_opacities = {{0, 0.5}, {100, 1}}, .regions = {BoxOf({40, 0}, {160, 30}, 0.8, 0.5)}});
  const VolumeDescription description{.geometry = {{8, 8, 8}, {1, 1, 1}}, .type = ScalarType::kUint8, .mapping = {2, -20}};
  const RegionTable table = MakeRegionTable(transfer, Classify(transfer, description, {-20, 490}), description.mapping);
  for (int stored = 0; stored < 256; ++stored) {
    for (double slope = 0; slope < 20; slope += 0.37) {  // of stored samples
      const double expected =
          LookAt(transfer.regions, 2 * stored - 20, 2 * slope).opacity * GradientOpacity(transfer.gradient_opacities, 2 * slope);
      EXPECT_NEAR(double(table.At(float(stored), float(slope))[3]), expected, 0.03) << stored << " " << slope;
    }
  }
  EXPECT_EQ(table.At(50, 1e30F)[3], 0) << "beyond the steepest corner nothing shows";
}

}  // namespace
}  // namespace slabstream
