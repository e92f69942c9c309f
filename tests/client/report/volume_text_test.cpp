// Whole numbers are told to the last digit, as people and programs read them.
#include "client/report/volume_text.h"
#include "common/json/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <utility>

namespace slabstream {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST(VolumeText, TellsWholeNumbersToTheLastDigit) {
  const auto texts = [](double value, std::int64_t rest = 0) {
    const VolumeSample sample{.inside = true, .value = value, .rest = rest};
    return std::pair(SampleText(sample), SampleJson(sample)["value"].dump());
  };
  for (const auto& [value, rest, text] : {std::tuple{12857642016.0, 0, "12857642016"},
                                          {0x1p64, -1, "18446744073709551615"},
                                          {-0x1p63, 0, "-9223372036854775808"},
                                          {0x1p53, 1, "9007199254740993"},
                                          {0.0, 0, "0"}}) {
    const auto [told, json] = texts(value, rest);
    EXPECT_THAT(told, EndsWith(std::string("  value ") + text));
    EXPECT_EQ(json, text);
  }
  EXPECT_THAT(texts(0.25).first, EndsWith("  value 0.25"));
  EXPECT_EQ(texts(0.25).second, "0.25");
  EXPECT_EQ(texts(1e300).second, "1e+300");
  EXPECT_THAT(SampleText({.inside = true}), EndsWith("  value not finite"));
}

TEST(VolumeText, TellsEveryDigitOfAValueAndOfAPoint) {
  const auto told = [](double value) { return SampleText({.at = {2000000003, 3e22, -0.5}, .inside = true, .value = value}); };
  EXPECT_THAT(told(double(0.1F)), EndsWith("  value 0.1"));
  EXPECT_THAT(told(double(1234.5678F)), EndsWith("  value 1234.5677"));
  EXPECT_THAT(told(double(1e-30F)), EndsWith("  value 1e-30"));
  EXPECT_THAT(told(0.1), EndsWith("  value 0.1"));
  EXPECT_THAT(told(1.0 / 3), EndsWith("  value 0.3333333333333333"));
  EXPECT_THAT(told(1), StartsWith("2000000003 3e+22 -0.5  voxel"));
}

TEST(VolumeText, TellsTheValueOfEachFieldByItsName) {
  const VolumeSample sample{.inside = true, .value = 12, .fields = {{"DAPI", 12}, {"Actin", 0.5}, {"overlay"}}};
  EXPECT_THAT(SampleText(sample), EndsWith("  value 12  Actin 0.5  overlay none"));
  EXPECT_EQ(SampleJson(sample)["fields"].dump(),
            R"([{"name":"DAPI","value":12},{"name":"Actin","value":0.5},{"name":"overlay","value":null}])");
  EXPECT_FALSE(SampleJson({.inside = false}).contains("fields")) << "nothing is there";
}

TEST(VolumeText, TellsTheShapeThatWasPicked) {
  const FrameRequest frame{.shapes = {{.shape = "skin"}, {.shape = "vessel"}}};
  const auto json = [&](const PickReply& reply) { return PickJson(reply, frame).dump(); };
  const VolumeSample outside{.at = {1.5, -2.5, 0.25}};
  const std::string begin = R"({"hit":true,"depth":9.5,"at":[1.5,-2.5,0.25],"inside":false,"voxel":null,"value":null)";
  EXPECT_EQ(json({.sample = outside, .depth = 9.5}), begin + "}");
  EXPECT_EQ(json({.sample = outside, .depth = 9.5, .shape = 1, .value = 0.5}),
            begin + R"(,"shape":"vessel","shape_number":1,"shape_value":0.5})");
  EXPECT_EQ(json({.sample = outside, .depth = 9.5, .shape = 2}), begin + R"(,"shape":"plane","shape_number":2,"shape_value":null})");
  EXPECT_EQ(json({}), R"({"hit":false})");
}

StatisticsReply TwoLabels(const Orientation& orientation) {
  const Label left{3, {1, 0.5F, 0}, "left, \"upper\""}, gone{7, {}, ""};
  const VolumeDescription description{.geometry = {{4, 4, 4}, {2, 2, 0.5}, orientation}};
  return {.description = description, .labels = {{left, {9, 1, 16777217, 0.25, -1, 0.5}}, {gone, {}}}};
}

TEST(LabelStatistics, HaveVolumesInMillilitresWhereTheUnitIsKnown) {
  const Json patient = LabelStatisticsJson(TwoLabels({.world = World::kPatient}));
  EXPECT_EQ(patient["unit"], "ml");
  EXPECT_DOUBLE_EQ(patient["labels"][0]["volume"].get<double>(), 10 * 2 * 2 * 0.5 / 1000)
      << "those that are not finite are of the label, too";
  EXPECT_EQ(patient["labels"][0]["color"], "#ff8000");
  EXPECT_TRUE(patient["labels"][1]["mean"].is_null());
  const Json small = LabelStatisticsJson(TwoLabels({.world = World::kScene, .unit = LengthUnit::kMicrometre}));
  EXPECT_EQ(small["unit"], "\u00b5m^3");
  EXPECT_DOUBLE_EQ(small["labels"][0]["volume"].get<double>(), 20);
}

TEST(LabelStatistics, AreATableWithQuotedNames) {
  EXPECT_EQ(LabelStatisticsCsv(TwoLabels({.world = World::kPatient})),
            "value,name,volume (ml),voxels,non_finite,mean,deviation,least,largest\r\n"
            "3,\"left, \"\"upper\"\"\",0.02,9,1,16777217,0.25,-1,0.5\r\n"
            "7,,0,0,0,,,,\r\n");
  EXPECT_THAT(LabelStatisticsText(TwoLabels({})), HasSubstr("none"));
}

}  // namespace
}  // namespace slabstream
