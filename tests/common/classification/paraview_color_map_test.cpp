#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "common/classification/transfer_function.h"
#include "tests/support/random.h"
#include "tests/support/random_transfer.h"

namespace slabstream {
namespace {

TEST(ParaViewColorMap, AnErrorIsOneLineHoweverTheFileIsMade) {
  for (const std::string& json :
       {std::string("{\"RGBPoints\": \n nonsense"), "[\"" + std::string(100'000, 'x'), std::string(1'000'000, '[')}) {
    const Status status = ParseParaViewColorMap(json, "map.json").status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
    EXPECT_LE(status.message().size(), 1024U);
  }
}

using testing::HasSubstr;

// As ParaView 5.11 exports a preset, with the fields that do not matter here.
constexpr const char* kExported = R"([
	{
		"ColorSpace" : "RGB",
		"Creator" : "ParaView",
		"DefaultMap" : true,
		"Name" : "bone",
		"NanColor" : [ 1.0, 0.0, 0.0 ],
		"Points" : [ 0.0, 0.0, 0.5, 0.0, 120.0, 0.25, 1.0, 0.75, 255, 1, 0.5, 0 ],
		"RGBPoints" : [ 0.0, 0.0, 0.0, 0.0, 255.0, 1.0, 0.5, 0.25 ]
	}
])";

TEST(ParaViewColorMap, IsReadAsExported) {
  const Result<TransferFunction> transfer = ParseParaViewColorMap(kExported, "bone.json");
  ASSERT_TRUE(transfer.ok()) << transfer.status().message();
  ASSERT_EQ(transfer->colors.size(), 2U);
  EXPECT_EQ(transfer->colors[1], (ColorPoint{255, {1, 0.5F, 0.25F}}));
  ASSERT_EQ(transfer->opacities.size(), 3U);
  EXPECT_EQ(transfer->opacities[1].value, 120);
  EXPECT_EQ(transfer->opacities[1].opacity, 0.25);
  EXPECT_NEAR(transfer->opacities[1].midpoint, 1, 2e-5) << "moved away from the end, as VTK does";
  EXPECT_EQ(transfer->opacities[1].sharpness, 0.75);
  EXPECT_EQ(transfer->opacity_distance, 1);
}

TEST(ParaViewColorMap, WithoutPointsRisesOverTheColours) {
  const Result<TransferFunction> transfer = ParseParaViewColorMap(R"({"RGBPoints": [-10, 0, 0, 0, 30, 1, 1, 1]})", "ramp");
  ASSERT_TRUE(transfer.ok());
  EXPECT_EQ(transfer->Opacity(-10), 0);
  EXPECT_EQ(transfer->Opacity(10), 0.5);
  EXPECT_EQ(transfer->Opacity(30), 1);
}

TEST(ParaViewColorMap, MayHaveAMaterial) {
  const auto material = [](const std::string& fields) {
    const std::string json = R"({"RGBPoints": [0, 0, 0, 0], "Material": )" + fields + "}";
    const Result<TransferFunction> transfer = ParseParaViewColorMap(json, "map.json");
    EXPECT_TRUE(transfer.ok()) << transfer.status().message();
    return transfer->material;
  };
  EXPECT_EQ(material("{}"), Material());
  EXPECT_EQ(material(R"({"specular": 0.75, "shininess": 80})"), (Material{.specular = 0.75F, .shininess = 80}));
  EXPECT_EQ(material(R"({"ambient": 0, "diffuse": 1, "specular": 0.5, "shininess": 1})"), (Material{0, 1, 0.5F, 1}));
  EXPECT_EQ(ParseParaViewColorMap(kExported, "bone.json")->material, std::nullopt);
}

TEST(ParaViewColorMap, MayHaveRegions) {
  const Result<TransferFunction> read = ParseParaViewColorMap(
      R"({"Regions": [{"Values": [10, 20], "Slopes": [0, 5], "Color": [1, 0.5, 0], "Opacity": 0.25, "Softness": 0.5},
                      {"Corners": [0, 0, 9, 0, 4, 3], "Color": [0, 0, 1]}], "Material": {"specular": 1}})",
      "map.json");
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->regions.size(), 2);
  EXPECT_EQ(read->regions[0], (TransferRegion{{{10, 0}, {20, 0}, {20, 5}, {10, 5}}, {1, 0.5F, 0}, 0.25, 0.5}));
  EXPECT_EQ(read->regions[1], (TransferRegion{{{0, 0}, {9, 0}, {4, 3}}, {0, 0, 1}, 1, 0.25}));
  EXPECT_EQ(read->material, Material{.specular = 1});
  EXPECT_GT(read->Opacity(15), 0) << "it has curves, too";
  const Result<TransferFunction> again = ParseParaViewColorMap(FormatParaViewColorMap(*read, "again"), "again.json");
  ASSERT_TRUE(again.ok()) << again.status().message();
  EXPECT_EQ(*again, *read);
}

TEST(ParaViewColorMap, SaysInOneLineWhatIsWrong) {
  const struct {
    std::string json, named;
  } wrong[] = {
      {"", "not JSON"},
      {"{", "not JSON"},
      {R"({"RGBPoints": [NaN, 0, 0, 0]})", "not JSON"},
      {R"({"RGBPoints": [1e999, 0, 0, 0]})", "not JSON"},
      {"[]", "the array is empty"},
      {"[1]", "expected an object"},
      {"\"text\"", "expected an object"},
      {"{}", "RGBPoints is missing"},
      {R"({"RGBPoints": {}})", "RGBPoints is not an array"},
      {R"({"RGBPoints": []})", "RGBPoints has 0 numbers"},
      {R"({"RGBPoints": [0, 0, 0]})", "RGBPoints has 3 numbers"},
      {R"({"RGBPoints": [0, 0, "x", 0]})", "RGBPoints[2] is not a number"},
      {R"({"RGBPoints": [0, 0, 2, 0]})", "green of colour point 0 is 2"},
      {R"({"RGBPoints": [1, 0, 0, 0, 0, 0, 0, 0]})", "value of colour point 1 is 0"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Points": [0, 2, 0.5, 0]})", "opacity of opacity point 0 is 2"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Points": null})", "Points is not an array"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Material": 1})", "Material is not an object"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Material": {"diffuse": "0.5"}})", "Material.diffuse is not a number"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Material": {"gloss": 1}})",
       "Material has the field \"gloss\", must be one of: ambient, diffuse, specular, shininess"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Material": {"specular": 7}})", "specular of the material is 7, but must lie in [0, 1]"},
      {R"({"RGBPoints": [0, 0, 0, 0], "Material": {"shininess": 0}})", "shininess of the material is 0, but must lie in [1, 1000]"},
      {R"({"RGBPoints": [)" +
           [] {
             std::string s = "0";
             for (int i = 1; i < 4 * 4097; ++i) s += ",0";
             return s;
           }() +
           "]}",
       "has 16388 numbers"},
      {R"({"Regions": 1})", "Regions must be an array of 1 to 16 regions"},
      {R"({"Regions": []})", "Regions must be an array of 1 to 16 regions"},
      {R"({"Regions": [1]})", "Regions[0] is not an object"},
      {R"({"Regions": [{"Color": [1, 1, 1]}]})", "Regions[0] must have either Corners or Values and Slopes"},
      {R"({"Regions": [{"Values": [0, 1], "Color": [1, 1, 1]}]})", "Regions[0] must have either Corners or Values and Slopes"},
      {R"({"Regions": [{"Values": [0, 1], "Slopes": [0, 1], "Corners": [0, 0, 1, 0, 1, 1], "Color": [1, 1, 1]}]})", "must have either"},
      {R"({"Regions": [{"Values": [0, 1], "Slopes": [0, 1]}]})", "Regions[0] has no Color"},
      {R"({"Regions": [{"Values": [0], "Slopes": [0, 1], "Color": [1, 1, 1]}]})", "Regions[0] Values has 1 numbers, must have 2"},
      {R"({"Regions": [{"Corners": [0, 1, 2, 3], "Color": [1, 1, 1]}]})", "Corners has 4 numbers, must have 6 to 64, 2 a corner"},
      {R"({"Regions": [{"Corners": [0, 1, 2, 3, 4, 5, 6], "Color": [1, 1, 1]}]})", "Corners has 7 numbers"},
      {R"({"Regions": [{"Corners": [0, 1, 2, "3", 4, 5], "Color": [1, 1, 1]}]})", "Corners has something at 3 that is not a number"},
      {R"({"Regions": [{"Values": [0, 1], "Slopes": [0, 1], "Color": [1, 1, 1], "Opacity": "1"}]})", "Regions[0] Opacity is not a number"},
      {R"({"Regions": [{"Values": [0, 1], "Slopes": [0, 1], "Color": [1, 1, 1], "Softness": 2}]})", "softness of region 0 is 2"},
      {R"({"Regions": [{"Values": [1, 1], "Slopes": [0, 1], "Color": [1, 1, 1]}]})", "all corners of region 0 have the value 1"},
      {R"({"Regions": [{"Shape": 1}]})", "Regions[0] has the field \"Shape\", must be one of: Corners, Values"},
      {R"({"Regions": [], "RGBPoints": [0, 0, 0, 0]})", "one of both must go"},
      {std::string(100000, '['), "values nest more than 64 deep"},
  };
  for (const auto& [json, named] : wrong) {
    const Status status = ParseParaViewColorMap(json, "map.json").status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << named;
    EXPECT_THAT(status.message(), testing::StartsWith("map.json: "));
    EXPECT_THAT(status.message(), HasSubstr(named));
    EXPECT_THAT(status.message(), testing::Not(HasSubstr("\n")));
  }
}

TEST(ParaViewColorMap, WhatIsWrittenIsReadAgain) {
  Random random(8);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    TransferFunction transfer = RandomTransfer(random);
    const Result<TransferFunction> read = ParseParaViewColorMap(FormatParaViewColorMap(transfer, "a \"name\"\xff"), "map.json");
    ASSERT_TRUE(read.ok()) << read.status().message();
    transfer.opacity_distance = 1;  // not part of a colour map
    EXPECT_EQ(*read, transfer);
  }
}

TEST(ParaViewColorMap, SurvivesAlteredAndShortenedText) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  const std::string whole = kExported;
  for (int i = 0; i < 3000; ++i) {
    std::string text = whole.substr(0, random.Integer<std::size_t>(0, whole.size()));
    for (int flips = random.Integer(0, 4); flips > 0 && !text.empty(); --flips) {
      text[random.Integer<std::size_t>(0, text.size() - 1)] = char(random.Integer(0, 255));
    }
    const Result<TransferFunction> transfer = ParseParaViewColorMap(text, "map.json");
    if (transfer.ok()) {
      EXPECT_TRUE(Validate(*transfer).ok()) << text;
    } else {
      EXPECT_THAT(transfer.status().message(), testing::Not(HasSubstr("\n")));
    }
  }
}

}  // namespace
}  // namespace slabstream
