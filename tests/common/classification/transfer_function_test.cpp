#include "common/classification/transfer_function.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/support/random_transfer.h"

namespace slabstream {
namespace {

const Rgb kRed = {1, 0, 0}, kBlue = {0, 0, 1};

TEST(Opacity, IsThatOfVtkPiecewiseFunction) {
  const TransferFunction transfer = {{{0, kRed}},
                                     {{0, 0, 0.5, 0},
                                      {10, 1, 0.25, 0},
                                      {20, 0.2, 0.75, 0.5},
                                      {30, 0.8, 0.3, 0.9},
                                      {40, 0.1, 0.6, 0.995},
                                      {50, 0.9, 0.5, 0.005},
                                      {60, 0.4, 0.1, 0.2},
                                      {80, 0.4, 0.5, 0}}};
  // From vtkPiecewiseFunction.GetValue of VTK 9.1 with these points.
  const struct {
    double value, opacity;
  } vtk[] = {
      {-5, 0.000000000000},   {0, 0.000000000000},    {3.3, 0.330000000000},  {7, 0.700000000000},  {10, 1.000000000000},
      {12, 0.680000000000},   {13.5, 0.546666666667}, {18, 0.306666666667},   {20, 0.200000000000}, {22, 0.200053968185},
      {26, 0.253432402377},   {27.5, 0.500000000000}, {29, 0.799381830280},   {30, 0.800000000000}, {31, 0.799999407136},
      {33, 0.450000000000},   {36, 0.100136426295},   {39.9, 0.100000000000}, {40, 0.100000000000}, {45.9, 0.100000000000},
      {46.1, 0.900000000000}, {50, 0.900000000000},   {53, 0.750000000000},   {58, 0.500000000000}, {60, 0.400000000000},
      {61, 0.400000000000},   {70, 0.400000000000},   {80, 0.400000000000},   {90, 0.400000000000},
  };
  for (const auto& [value, opacity] : vtk) EXPECT_NEAR(transfer.Opacity(value), opacity, 1e-9) << "at " << value;
}

TEST(Opacity, IsMonotoneWithinASegmentForAnyMidpointAndSharpness) {
  for (const double midpoint : {0.001, 0.2, 0.5, 0.9, 0.999}) {
    for (double sharpness = 0; sharpness <= 1; sharpness += 0.03125) {
      const TransferFunction transfer = {{{0, kRed}}, {{0, 0.9, midpoint, sharpness}, {1, 0.1}}};
      double before = 0.9;
      for (int i = 0; i <= 1000; ++i) {
        const double opacity = transfer.Opacity(i / 1000.0);
        EXPECT_LE(opacity, before) << midpoint << " " << sharpness << " " << i;
        before = opacity;
      }
      EXPECT_EQ(before, 0.1);
    }
  }
}

TEST(Color, IsLinearBetweenPointsAndConstantOutside) {
  const TransferFunction transfer = {{{10, kRed}, {20, kBlue}}, {{0, 1}}};
  EXPECT_EQ(transfer.Color(-1e300), kRed);
  EXPECT_EQ(transfer.Color(10), kRed);
  EXPECT_EQ(transfer.Color(12.5), (Rgb{0.75F, 0, 0.25F}));
  EXPECT_EQ(transfer.Color(20), kBlue);
  EXPECT_EQ(transfer.Color(1e300), kBlue);
}

TEST(Step, TakesItsUpperSide) {
  const TransferFunction transfer = {{{0, kRed}, {5, kRed}, {5, kBlue}, {9, kBlue}}, {{0, 0.25}, {5, 0.25}, {5, 0.75}, {9, 0.75}}};
  EXPECT_EQ(transfer.Color(std::nextafter(5, 0)), kRed);
  EXPECT_EQ(transfer.Color(5), kBlue);
  EXPECT_EQ(transfer.Opacity(std::nextafter(5, 0)), 0.25);
  EXPECT_EQ(transfer.Opacity(5), 0.75);
}

TEST(TransferFunction, ReachesAcrossTheWholeRangeOfDoubles) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  const TransferFunction transfer = {{{-kLargest, kRed}, {kLargest, kBlue}}, {{-kLargest, 0}, {kLargest, 1}}};
  EXPECT_EQ(transfer.Opacity(0), 0.5);
  EXPECT_EQ(transfer.Color(0), (Rgb{0.5F, 0, 0.5F}));
}

// A value of the new range looks like the value at the same share of the old one.
TEST(Stretched, KeepsTheCurves) {
  const TransferFunction curve{{{-2, {0, 0, 0}}, {3, {1, 0, 0}}, {6, {1, 1, 1}}}, {{-1, 0}, {3, 0.5, 0.3, 0.2}, {3, 0.75}, {5, 1}}};
  const TransferFunction wide = Stretched(curve, {1000, 9000});
  EXPECT_TRUE(Validate(wide).ok());
  for (int i = 0; i <= 64; ++i) {
    const double share = i / 64.0, from = -2 + 8 * share, to = 1000 + 8000 * share;
    EXPECT_NEAR(wide.Opacity(to), curve.Opacity(from), 1e-9) << share;
    EXPECT_NEAR(wide.Color(to).g, curve.Color(from).g, 1e-6) << share;
  }
  const TransferFunction widest = Stretched({{{-1e308, {}}, {1e308, {}}}, {{0, 1}}}, {-1e300, 1e300});
  EXPECT_EQ(widest.colors.front().value, -1e300);
  EXPECT_EQ(widest.colors.back().value, 1e300);
  EXPECT_EQ(widest.opacities.front().value, 0);
  EXPECT_EQ(Stretched({{{7, {}}}, {{7, 1}}}, {1, 2}).colors.front().value, 1);
}

TEST(Validate, NamesEveryFieldThatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const TransferFunction good = {{{0, kRed}, {1, kBlue}}, {{0, 0, 0.5, 0}, {1, 1, 0.5, 1}}};
  ASSERT_TRUE(Validate(good).ok());
  const struct {
    const char* named;
    std::function<void(TransferFunction&)> spoil;
  } wrong[] = {
      {"number of colour points is 0", [](TransferFunction& t) { t.colors.clear(); }},
      {"number of opacity points is 0", [](TransferFunction& t) { t.opacities.clear(); }},
      {"number of colour points is 4097", [](TransferFunction& t) { t.colors.assign(kMaxTransferPoints + 1, t.colors[0]); }},
      {"number of opacity points is 4097", [](TransferFunction& t) { t.opacities.assign(kMaxTransferPoints + 1, t.opacities[0]); }},
      {"value of colour point 1 is nan", [&](TransferFunction& t) { t.colors[1].value = nan; }},
      {"value of colour point 1 is inf", [&](TransferFunction& t) { t.colors[1].value = infinity; }},
      {"value of colour point 1 is -1", [](TransferFunction& t) { t.colors[1].value = -1; }},
      {"value of opacity point 0 is nan", [&](TransferFunction& t) { t.opacities[0].value = nan; }},
      {"value of opacity point 1 is -1", [](TransferFunction& t) { t.opacities[1].value = -1; }},
      {"red of colour point 0 is 1.5", [](TransferFunction& t) { t.colors[0].color.r = 1.5F; }},
      {"green of colour point 0 is nan", [&](TransferFunction& t) { t.colors[0].color.g = float(nan); }},
      {"blue of colour point 1 is -0.5", [](TransferFunction& t) { t.colors[1].color.b = -0.5F; }},
      {"opacity of opacity point 1 is 1.25", [](TransferFunction& t) { t.opacities[1].opacity = 1.25; }},
      {"opacity of opacity point 1 is nan", [&](TransferFunction& t) { t.opacities[1].opacity = nan; }},
      {"midpoint of opacity point 0 is 0", [](TransferFunction& t) { t.opacities[0].midpoint = 0; }},
      {"midpoint of opacity point 0 is 1", [](TransferFunction& t) { t.opacities[0].midpoint = 1; }},
      {"midpoint of opacity point 0 is nan", [&](TransferFunction& t) { t.opacities[0].midpoint = nan; }},
      {"sharpness of opacity point 0 is -1", [](TransferFunction& t) { t.opacities[0].sharpness = -1; }},
      {"sharpness of opacity point 0 is nan", [&](TransferFunction& t) { t.opacities[0].sharpness = nan; }},
      {"opacity distance is 0", [](TransferFunction& t) { t.opacity_distance = 0; }},
      {"opacity distance is 2e\\+06", [](TransferFunction& t) { t.opacity_distance = 2e6; }},
      {"opacity distance is nan", [&](TransferFunction& t) { t.opacity_distance = nan; }},
  };
  for (const auto& [named, spoil] : wrong) {
    TransferFunction transfer = good;
    spoil(transfer);
    const Status status = Validate(transfer);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << named;
    EXPECT_THAT(status.message(), testing::ContainsRegex(std::string(named) + ".*, must be"));
  }
}

TEST(Validate, NamesTheNumberOfAMaterialThatIsWrong) {
  TransferFunction transfer = {{{0, kRed}}, {{0, 1}}};
  const auto message = [&](const Material& material) {
    transfer.material = material;
    return Validate(transfer).message();
  };
  EXPECT_EQ(message({}), "");
  EXPECT_EQ(message({0, 1, 0, 1000}), "");
  EXPECT_EQ(message({.ambient = -1}), "ambient of the material is -1, but must lie in [0, 1]");
  EXPECT_EQ(message({.diffuse = 2}), "diffuse of the material is 2, but must lie in [0, 1]");
  EXPECT_EQ(message({.specular = std::numeric_limits<float>::quiet_NaN()}), "specular of the material is nan, but must lie in [0, 1]");
  EXPECT_EQ(message({.shininess = 0.5F}), "shininess of the material is 0.5, but must lie in [1, 1000]");
}

TEST(MaxOpacity, IsTheLargestOfDenseSamples) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const TransferFunction transfer = RandomTransfer(random);
    ASSERT_TRUE(Validate(transfer).ok());
    double low = random.Real(-20, 120), high = random.Real(-20, 120);
    if (low > high) std::swap(low, high);
    if (random.Chance(0.3)) low = transfer.opacities[random.Integer<std::size_t>(0, transfer.opacities.size() - 1)].value;
    if (random.Chance(0.1)) high = low;
    if (low > high) continue;

    double largest = 0;
    constexpr int kSamples = 2000;
    for (int s = 0; s <= kSamples; ++s) largest = std::max(largest, transfer.Opacity(std::lerp(low, high, s / double(kSamples))));
    for (const OpacityPoint& point : transfer.opacities) {
      if (point.value >= low && point.value <= high) largest = std::max(largest, transfer.Opacity(point.value));
      const double below = std::nextafter(point.value, -1e9);
      if (below >= low && below <= high) largest = std::max(largest, transfer.Opacity(below));
    }
    const double found = MaxOpacity(transfer, low, high);
    EXPECT_GE(found, largest) << "never less than any sample";
    EXPECT_NEAR(found, largest, 1e-9) << "and no more than needed";
  }
}

TEST(MaxOpacity, OfNoValueIsNothing) { EXPECT_EQ(MaxOpacity({{{0, kRed}}, {{0, 1}}}, 1, 0), 0); }

}  // namespace
}  // namespace slabstream
