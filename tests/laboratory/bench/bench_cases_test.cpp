#include "laboratory/bench/bench_cases.h"
#include "common/wire/validate_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST(BenchCases, NamesAreStableUniqueAndFitForFiles) {
  std::vector<std::string> names;
  for (const BenchCase& c : StandardBenchCases()) names.push_back(c.name);
  EXPECT_EQ(names, (std::vector<std::string>{"class1-256", "class2-256", "class1-256-opaque", "class2-256-opaque", "class1-512",
                                             "zbuffer-class1-256", "raycast-class1-256", "raycast-class2-256", "shear-class1-256",
                                             "shear-class2-256", "mip-class1-256", "mip-class2-256", "raycast-class1-256-opaque",
                                             "raycast-class2-256-opaque", "raycast-brain", "brain"}));
}

TEST(BenchCases, AllTransferFunctionsAndRequestsAreValid) {
  for (const BenchCase& c : StandardBenchCases()) {
    EXPECT_TRUE(Validate(std::get<TransferFunction>(c.transfer.choice)).ok()) << c.name;
    for (const Projection projection : c.renderer->projections()) {
      EXPECT_TRUE(Validate(BenchRequest(c, BenchView(projection, 11, 12), {})).ok()) << c.name;
    }
  }
}

TEST(BenchCases, SpheresHaveTheOpacityAndOccupancyThatTheirCaseStates) {
  const std::pair<std::string, double> occupancies[] = {{"class1-256", 0.05}, {"class2-256", 0.40}};
  for (const auto& [name, occupancy] : occupancies) {
    const Result<BenchCase> c = ParseBenchCase(name, false);
    ASSERT_TRUE(c.ok());
    const Result<std::shared_ptr<const Volume>> volume = LoadBenchVolume(*c);
    ASSERT_TRUE(volume.ok());
    EXPECT_NEAR(MeasureOccupancy(**volume), occupancy, 0.001);
    const auto& transfer = std::get<TransferFunction>(c->transfer.choice);
    EXPECT_EQ(transfer.Opacity(0), 0);
    for (const double value : {128, 200, 255}) EXPECT_DOUBLE_EQ(transfer.Opacity(value), *c->opacity);
  }
}

TEST(BenchCases, TheSideOfACubeFillsThePicture) {
  constexpr int kVoxels = 256, kPixels = 512;
  ViewParameters view = BenchView(Projection::kOrthographic, 0, 12);
  EXPECT_EQ(view.elevation_degrees, 20);
  view.elevation_degrees = 0;
  const Camera camera = MakeCamera(view, {kPixels, kPixels}, {.size = {kVoxels, kVoxels, kVoxels}});
  EXPECT_NEAR(camera.Project({-0.5, 0, -0.5}).x, 0, 0.1);
  EXPECT_NEAR(camera.Project({kVoxels - 0.5, 0, -0.5}).x, kPixels, 0.1);
  EXPECT_NEAR(camera.Project({-0.5, 0, kVoxels - 0.5}).y, 0, 0.1);
}

TEST(BenchCases, ATurnIsEvenlySpaced) {
  for (int i = 0; i < 12; ++i) EXPECT_DOUBLE_EQ(*BenchView(Projection::kPerspective, i, 12).azimuth_degrees, 30.0 * i);
}

class BenchFilesTest : public testing::Test {
 protected:
  std::string Touch(const std::string& name) const {
    std::ofstream(directory_.path() + "/" + name) << "x";
    return directory_.path() + "/" + name;
  }
  TemporaryDirectory directory_{"/tmp"};
};

TEST_F(BenchFilesTest, AFileMayNameItsTransferFunction) {
  const std::string head = Touch("head.nii.gz"), odd = Touch("a:ct-bone.nrrd");
  const struct {
    std::string text, name, dataset, preset;
  } cases[] = {
      {head, "head-auto", "head", "auto"},
      {head + ":ct-bone", "head-ct-bone", "head", "ct-bone"},
      {odd, "a:ct-bone-auto", "a:ct-bone", "auto"},
      {odd + ":opaque", "a:ct-bone-opaque", "a:ct-bone", "opaque"},
  };
  for (const auto& expected : cases) {
    const Result<BenchCase> c = ParseBenchCase(expected.text, false);
    ASSERT_TRUE(c.ok()) << c.status().message();
    EXPECT_EQ(c->name, expected.name);
    EXPECT_EQ(c->dataset, expected.dataset);
    EXPECT_EQ(std::get<std::string>(c->transfer.choice), expected.preset);
    EXPECT_TRUE(std::filesystem::exists(std::get<std::string>(c->volume)));
  }
}

TEST_F(BenchFilesTest, ACurveMayComeFromAFile) {
  const std::string head = Touch("head.nrrd"), map = directory_.path() + "/warm.json";
  std::ofstream(map) << R"({"RGBPoints": [0, 0, 0, 0, 9, 1, 0.5, 0]})";
  const Result<BenchCase> c = ParseBenchCase(head + ":" + map, false);
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->name, "head-warm");
  EXPECT_EQ(std::get<TransferFunction>(c->transfer.choice).colors.size(), 2U);
}

TEST_F(BenchFilesTest, WhatIsWrongIsNamed) {
  const std::string head = Touch("head.nrrd"), notes = Touch("notes.txt");
  const std::pair<std::string, std::string> cases[] = {
      {"class3-256", "CASE 'class3-256' is neither a file nor a standard case"},
      {"", "CASE ''"},
      {notes, "notes.txt: not a volume"},
      {head + ":bone", "'bone' is not one of auto,"},
      {head + ":", "'' is not one of auto,"},
      {head + ":no/map.json", "'no/map.json' does not exist"},
  };
  for (const auto& [text, needle] : cases) {
    const Result<BenchCase> c = ParseBenchCase(text, false);
    ASSERT_FALSE(c.ok()) << text;
    EXPECT_THAT(c.status().message(), HasSubstr(needle));
  }
}

TEST(BenchCases, AtAServiceNamesAreThoseOfDatasets) {
  const Result<BenchCase> c = ParseBenchCase("head:ct-skin", true);
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->dataset, "head");
  EXPECT_EQ(c->name, "head-ct-skin");
  EXPECT_EQ(ParseBenchCase("zbuffer-class1-256", true)->dataset, "class1-256");
}

}  // namespace
}  // namespace slabstream
