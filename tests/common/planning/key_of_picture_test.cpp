// What the colours of a picture mean: bars for the fields that show, in their order, with what the picture maps to colours; labels;
// surfaces.
#include "common/planning/key_of_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/planning/support.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class KeyOfPicture : public testing::Test {
 protected:
  KeyOfPicture() {
    VolumeSummary made = FullSummary({32, 32, 32});
    made.range = {0, 100};
    for (int bin = 0; bin < kHistogramBins; ++bin) made.histogram[std::size_t(bin)] = 10;
    summary_ = std::make_shared<const VolumeSummary>(made);
  }

  // Of a picture of a dataset, all of whose fields have the same values.
  PictureKey Key(FrameRequest request, const DatasetFields& dataset) const {
    request.size = {64, 64};
    ShownAtTime shown = WhatShows(request, std::make_shared<const DatasetFields>(dataset)).value();
    for (FieldVolume& other : shown.fields.others) {
      other.levels = {{2, summary_}};
      other.of_volume = {0};
    }
    const Result<ResolvedRequest> resolved = ResolveRequest(request, 1, summary_, shown.fields);
    EXPECT_TRUE(resolved.ok()) << resolved.status().message();
    return KeyOf(*resolved);
  }

  std::shared_ptr<const VolumeSummary> summary_;
};

std::vector<std::string> NamesOf(const PictureKey& key) {
  std::vector<std::string> names;
  for (const PictureKey::Bar& bar : key.bars) names.push_back(bar.name);
  return names;
}

DatasetFields Stained() {
  return {.fields = {{.name = "DAPI", .color = std::array{0.F, 0.F, 1.F}, .window = ValueRange{5, 50}},
                     {.name = "", .color = std::array{0.F, 1.F, 0.F}, .window = ValueRange{0, 20}},
                     {.name = "Ac\ntin", .color = std::array{1.F, 0.F, 0.F}, .window = ValueRange{10, 90}},
                     {.name = "overlay", .channel = false, .shown = false}}};
}

TEST_F(KeyOfPicture, HasABarForEachFieldThatShowsInTheirOrder) {
  EXPECT_THAT(NamesOf(Key({}, Stained())), ElementsAre("DAPI", "channel 1", "Ac?tin")) << "one line each";
  EXPECT_THAT(NamesOf(Key({.channels = {"2", "DAPI"}}, Stained())), ElementsAre("DAPI", "Ac?tin"));
  EXPECT_THAT(NamesOf(Key({.channels = {"0", "overlay"}}, Stained())), ElementsAre("DAPI", "overlay"));
  EXPECT_THAT(NamesOf(Key({.channels = {"overlay"}}, Stained())), ElementsAre("overlay")) << "the volume does not show";
  DatasetFields mapped;
  mapped.fields.push_back({.name = "overlay", .channel = false, .shown = false});
  EXPECT_THAT(NamesOf(Key({.channels = {"0", "overlay"}}, mapped)), ElementsAre("volume", "overlay"));
}

TEST_F(KeyOfPicture, ColoursRunFromDarkToTheChannelsOwnOverItsRange) {
  const PictureKey key = Key({.fields = {{.field = "1", .scalar_range = ScalarRange{30, 70}, .gamma = 2}}}, Stained());
  ASSERT_EQ(key.bars.size(), 3U);
  EXPECT_EQ(key.bars[0].low(), 5);
  EXPECT_EQ(key.bars[0].high(), 50);
  EXPECT_EQ(key.bars[0].colors.front().color, (Rgb{0, 0, 0}));
  EXPECT_EQ(key.bars[0].colors.back().color, (Rgb{0, 0, 1}));
  EXPECT_EQ(key.bars[1].low(), 30);
  EXPECT_EQ(key.bars[1].high(), 70);
  const TransferFunction squared{.colors = key.bars[1].colors, .opacities = {}};
  EXPECT_NEAR(squared.Color(50).g, 0.25, 1e-3) << "the gamma shows";
  FrameRequest slice;
  slice.clipping.slab.emplace();
  slice.renderer = "mip";
  const PictureKey flat = Key(slice, Stained());
  EXPECT_EQ(flat.bars[0].colors, key.bars[0].colors) << "slices have the same colours";
}

TEST_F(KeyOfPicture, AColourMapIsWhatItIs) {
  const PictureKey key = Key({.fields = {{.field = "2", .choice = "viridis", .scalar_range = ScalarRange{10, 20}}}}, Stained());
  EXPECT_EQ(key.bars[2].low(), 10);
  EXPECT_EQ(key.bars[2].high(), 20);
  EXPECT_GT(key.bars[2].colors.size(), 8U);
}

TEST_F(KeyOfPicture, OfOneVolumeIsTheBarOfItsTransferFunctionAndItsSurfaces) {
  FrameRequest request;
  request.renderer = "raycast";
  request.brightness = 0.5;
  request.transfer.choice = TransferFunction{.colors = {{20, {1, 0, 0}}, {60, {0, 0, 1}}}, .opacities = {{20, 0}, {60, 1}}};
  request.transfer.isosurfaces = {{.value = 42, .color = {1, 1, 0}}};
  const PictureKey key = Key(request, {});
  EXPECT_EQ(key.bars, (std::vector<PictureKey::Bar>{{"volume", {{20, {0.5F, 0, 0}}, {60, {0, 0, 0.5F}}}}}));
  EXPECT_EQ(key.entries, (std::vector<PictureKey::Entry>{{"42", {0.5F, 0.5F, 0}}}));
  request.transfer.choice = "none";
  EXPECT_THAT(Key(request, {}).bars, IsEmpty()) << "no value shows";
}

}  // namespace
}  // namespace slabstream
