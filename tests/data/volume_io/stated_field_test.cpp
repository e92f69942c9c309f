#include "data/volume_io/stated_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slabstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Color = std::array<float, 3>;

TEST(StatedFieldTest, AWindowRunsFromDarkToBrightInFloats) {
  EXPECT_EQ(StatedWindow(-3, 99), (ValueRange{-3, 99}));
  EXPECT_EQ(StatedWindow(10, 20, {2, 5}), (ValueRange{25, 45}));
  EXPECT_EQ(StatedWindow(10, 20, {-1, 0}), (ValueRange{-20, -10}));
  for (const auto& [min, max] : {std::pair{5.0, 5.0},
                                 {6.0, 5.0},
                                 {NAN, 5.0},
                                 {5.0, NAN},
                                 {-kInfinity, 5.0},
                                 {5.0, kInfinity},
                                 {5.0, 1e300},
                                 {16777216.0, 16777217.0}}) {
    EXPECT_EQ(StatedWindow(min, max), std::nullopt) << min << " " << max;
  }
  EXPECT_EQ(StatedWindow(5, 6, {0, 1}), std::nullopt);
}

TEST(StatedFieldTest, AColorIsInItsRangeAndNotBlack) {
  EXPECT_EQ(StatedColor(0, 0.5, 1), (Color{0, 0.5, 1}));
  EXPECT_EQ(StatedColor(0, 0, 0), std::nullopt);
  EXPECT_EQ(StatedColor(0, 1.5, 0), std::nullopt);
  EXPECT_EQ(StatedColor(-0.5, 1, 0), std::nullopt);
  EXPECT_EQ(StatedColor(NAN, 1, 0), std::nullopt);
  EXPECT_EQ(ColorOfHex("00fF33"), (Color{0, 1, 0.2F}));
  EXPECT_EQ(ColorOfHex("#00ff33"), (Color{0, 1, 0.2F}));
  EXPECT_EQ(ColorOfBits(0x7f00ff33), (Color{0, 1, 0.2F}));
  for (const char* text : {"", "#", "fff", "00ff3", "00ff3g", "-0ff33", "0x00ff", "00ff3333", "magenta", "##00ff3", "000000"}) {
    EXPECT_EQ(ColorOfHex(text), std::nullopt) << text;
  }
}

TEST(StatedFieldTest, TimesHaveAStepWhereItSaysSomething) {
  const auto times = [](double step, const char* unit) { return StatedTimes(3, step, unit); };
  EXPECT_EQ(times(1.5, "s"), (TimeAxis{3, 1.5, "s"}));
  EXPECT_EQ(times(1, "s"), (TimeAxis{3, 1.0, "s"}));
  EXPECT_EQ(times(1.5, "fortnights"), (TimeAxis{3, 1.5, ""}));
  EXPECT_EQ(times(1, ""), (TimeAxis{3})) << "what is written by default";
  for (const double step : {0.0, -1.0, double(NAN), kInfinity}) EXPECT_EQ(times(step, "s"), (TimeAxis{3}));
  EXPECT_EQ(StatedTimes(3, std::nullopt, "s"), (TimeAxis{3}));
  EXPECT_EQ(StatedTimes(1, 1.5, "s"), TimeAxis());
  EXPECT_EQ(StatedTimes(3, std::vector{-1.0, 0.5, 2.0}, "s"), (TimeAxis{3, 1.5, "s"}));
  EXPECT_EQ(StatedTimes(3, std::vector{2.0, 0.5, -1.0}, "s"), (TimeAxis{3})) << "they fall";
  EXPECT_EQ(StatedTimes(3, std::vector{0.0, 1.5}, "s"), (TimeAxis{3})) << "one is missing";
  EXPECT_EQ(StatedTimes(3, std::vector{0.0, 1.5, 8.0}, "s"), (TimeAxis{3}));
  const std::pair<const char*, const char*> kUnits[] = {
      {"sec", "s"},         {"Seconds", "s"}, {"millisecond", "ms"}, {"msec", "ms"}, {"\u00b5s", "us"}, {"\u03bcs", "us"}, {"us", "us"},
      {"nanosecond", "ns"}, {" min ", "min"}, {"minutes", "min"},    {"h", "h"},     {"hours", "h"},    {"d", "d"},        {"Ms", ""}};
  for (const auto& [name, unit] : kUnits) EXPECT_EQ(times(2, name).unit, unit) << name;
}

}  // namespace
}  // namespace slabstream
