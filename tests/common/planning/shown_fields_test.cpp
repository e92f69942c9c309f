// Which fields a request shows, and how: what the request says, what the dataset says, and what is left to the values.
#include "common/planning/shown_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/planning/levels.h"
#include "tests/common/planning/support.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

DatasetFields Channels(int count) { return {.fields = std::vector<FieldInfo>(std::size_t(count))}; }
std::vector<int> Shown(const FrameRequest& request, const DatasetFields& dataset) { return FieldsToShow(request, dataset).value().numbers; }

TEST(ShownFields, AreTheFirstFourIfTheDatasetSaysNothing) {
  EXPECT_THAT(Shown({}, Channels(1)), ElementsAre(0));
  EXPECT_THAT(Shown({}, Channels(6)), ElementsAre(0, 1, 2, 3));
}

TEST(ShownFields, AreThoseThatTheDatasetSays) {
  DatasetFields dataset = Channels(7);
  dataset.fields[1].shown = dataset.fields[4].shown = false;
  EXPECT_THAT(Shown({}, dataset), ElementsAre(0, 2, 3, 5, 6));
  for (FieldInfo& field : dataset.fields) field.shown = false;
  EXPECT_THAT(Shown({}, dataset), ElementsAre(0, 1, 2, 3)) << "a file that shows nothing says nothing";
}

TEST(ShownFields, ALookOfTheOverlayDoesNotColourTheVolume) {
  DatasetFields dataset = Channels(1);
  dataset.fields.push_back({.name = "overlay", .channel = false, .shown = false});
  const ShownFields shown = {.dataset = std::make_shared<const DatasetFields>(dataset), .others = {{.number = 1}}};
  EXPECT_FALSE(ShowsAsChannel({}, shown).value());
  EXPECT_FALSE(ShowsAsChannel({.fields = {{.field = "overlay", .choice = "hot"}}}, shown).value());
  EXPECT_TRUE(ShowsAsChannel({.fields = {{.field = "0", .gamma = 2}}}, shown).value());
  EXPECT_TRUE(ShowsAsChannel({.channels = {"0"}, .fields = {{.field = "overlay"}}}, shown).value());
}

TEST(ShownFields, AreThoseOfTheRequestByNameOrNumber) {
  DatasetFields dataset = Channels(3);
  dataset.fields[1].name = "2";  // a name counts before a number
  dataset.fields.push_back({.name = "overlay", .channel = false, .shown = false});
  EXPECT_THAT(Shown({.channels = {"2"}}, dataset), ElementsAre(1));
  EXPECT_THAT(Shown({.channels = {"0", "2"}}, dataset), ElementsAre(0, 1));
  EXPECT_THAT(Shown({.fields = {{.field = "0", .shown = false}}}, dataset), ElementsAre(1, 2));
  EXPECT_THAT(Shown({.fields = {{.field = "0", .weight = 0}}}, dataset), ElementsAre(1, 2)) << "without weight nothing shows";
  EXPECT_THAT(Shown({.fields = {{.field = "overlay"}}}, dataset), ElementsAre(0, 1, 2, 3)) << "to name an overlay shows it";
  const FieldNumbers overlay = FieldsToShow({.channels = {"overlay"}}, dataset).value();
  EXPECT_THAT(overlay.numbers, ElementsAre(0, 3)) << "a channel is the volume in any case";
  EXPECT_FALSE(overlay.volume_shows);
}

TEST(ShownFields, AreNotMoreThanAPictureCanShow) {
  DatasetFields dataset = Channels(20);
  FrameRequest request;
  for (int i = 0; i < 17; ++i) request.fields.push_back({.field = std::to_string(i), .shown = true});
  EXPECT_THAT(FieldsToShow(request, dataset).status().message(), HasSubstr("17 fields of dataset \"\" would show, at most 16 can"));
}

TEST(ShownFields, ATimeIsANumberOrANumberWithAUnit) {
  DatasetFields dataset;
  dataset.times = {.count = 10, .step = 0.5, .unit = "min"};
  dataset.time = 3;
  const auto time = [&](const std::string& text) { return TimeToShow({.time = text}, dataset).value(); };
  EXPECT_EQ(time(""), 3);
  EXPECT_EQ(time("0"), 0);
  EXPECT_EQ(time("9"), 9);
  EXPECT_EQ(time("last"), 9);
  EXPECT_EQ(time("60s"), 2);
  EXPECT_EQ(time("1.6min"), 3) << "the nearest one";
  EXPECT_EQ(time("61000ms"), 2);
  for (const char* wrong : {"10", "-1", "1x", "s", "6min", "nan", "1e400s", "-20s", "0x1"}) {
    EXPECT_FALSE(TimeToShow({.time = wrong}, dataset).ok()) << wrong;
  }
}

TEST(ShownFields, AnOverlayLeavesTheLookOfTheVolumeAlone) {
  const auto as_channel = [](const FrameRequest& request, int channels) {
    DatasetFields dataset = Channels(channels);
    dataset.fields.push_back({.name = "overlay", .channel = false, .shown = false});
    const ShownAtTime shown = WhatShows(request, std::make_shared<const DatasetFields>(dataset)).value();
    return ShowsAsChannel(request, shown.fields).value();
  };
  const FieldChoice overlay = {.field = "overlay", .shown = true};
  EXPECT_FALSE(as_channel({.fields = {overlay}}, 1)) << "it is grey, not magenta";
  EXPECT_TRUE(as_channel({.fields = {overlay, {.field = "0", .color = Rgb{0, 1, 0}}}}, 1));
  EXPECT_TRUE(as_channel({.fields = {overlay}}, 2)) << "there are others to tell it from";
  EXPECT_TRUE(as_channel({.fields = {overlay, {.field = "1", .shown = false}}}, 2));
}

TEST(ShownFields, LooksAreThoseOfTheRequestThenOfTheDatasetThenOfTheValues) {
  VolumeSummary summary = FullSummary({32, 32, 32});
  summary.range = {0, 100};
  for (int bin = 0; bin < kHistogramBins; ++bin) summary.histogram[std::size_t(bin)] = 10;
  DatasetFields dataset = Channels(2);
  const auto look = [&](const FrameRequest& request, bool full = true) { return LookOf(request, dataset, 1, summary, full).value(); };
  EXPECT_EQ(look({}).transfer.Color(50), (Rgb{0, 1, 0})) << "the second channel is green";
  dataset.fields[1].color = {1, 0.5F, 0};
  dataset.fields[1].window = ValueRange{20, 60};
  EXPECT_EQ(look({}).transfer.Color(50), (Rgb{1, 0.5F, 0}));
  EXPECT_EQ(look({}).transfer.Opacity(20), 0);
  EXPECT_DOUBLE_EQ(look({}).transfer.Opacity(40), 0.5);
  EXPECT_EQ(look({}).transfer.Opacity(60), 1);
  EXPECT_LT(look({}, false).transfer.Opacity(60), 1) << "matter lets light through";
  const FrameRequest asked = {
      .fields = {{.field = "1", .color = Rgb{0, 0, 1}, .scalar_range = ScalarRange{0, 10}, .gamma = 2, .weight = 0.5}}};
  EXPECT_EQ(look(asked).transfer.Color(5), (Rgb{0, 0, 1}));
  EXPECT_NEAR(look(asked).transfer.Opacity(5), 0.25, 1e-3);
  EXPECT_EQ(look(asked).weight, 0.5);
  EXPECT_EQ(look({.fields = {{.field = "1", .choice = "none"}}}).transfer, MakePreset("none", summary).value());
  EXPECT_FALSE(LookOf({.fields = {{.field = "1", .choice = "no such"}}}, dataset, 1, summary, true).ok());
}

// Voxels of `side` along x, y and z, a level of an eighth of the voxels after another.
VolumeLevels LevelsFrom(double side, int count) {
  VolumeLevels levels;
  for (int level = 0; level < count; ++level) {
    VolumeDescription description;
    const double spacing = side * (1 << level);
    description.geometry = {{64 >> level, 64 >> level, 64 >> level}, {spacing, spacing, spacing}};
    levels.levels.push_back(description);
  }
  return levels;
}

TEST(ShownFields, EachFieldIsDrawnFromTheLevelThatThePictureNeedsOfIt) {
  const VolumeLevels own = LevelsFrom(1, 5);
  const auto drawn = [&](int first, int count) {
    std::vector<VolumeGeometry> geometries;
    for (int level = first; level < first + count; ++level) geometries.push_back(own.levels[std::size_t(level)].geometry);
    return geometries;
  };
  // Channels: the same level as the volume, at any pixel that asks for it.
  for (int level = 0; level < 5; ++level) {
    const FieldLevels found = LevelsOfField(own, own.levels[0].geometry, drawn(level, 1), 1.5 * (1 << level));
    EXPECT_THAT(found.levels, ElementsAre(level));
    EXPECT_THAT(found.of_volume, ElementsAre(0));
  }
  const FieldLevels mixed = LevelsOfField(own, own.levels[0].geometry, drawn(1, 3), 2);
  EXPECT_THAT(mixed.levels, ElementsAre(1, 2, 3));
  EXPECT_THAT(mixed.of_volume, ElementsAre(0, 1, 2));
  // A finer field where the picture shows more than the volume has.
  EXPECT_THAT(LevelsOfField(LevelsFrom(0.25, 5), own.levels[0].geometry, drawn(0, 1), 0.3).levels, ElementsAre(0));
  EXPECT_THAT(LevelsOfField(LevelsFrom(0.25, 5), own.levels[0].geometry, drawn(0, 1), 0.6).levels, ElementsAre(1));
  // A coarser one has nothing finer.
  EXPECT_THAT(LevelsOfField(LevelsFrom(8, 2), own.levels[0].geometry, drawn(0, 1), 0.5).levels, ElementsAre(0));
}

}  // namespace
}  // namespace slabstream
