#include "data/volume_io/chosen_channel.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

const std::vector<FieldInfo> kThree = {{.name = "DAPI"}, {}, {.name = "GFP\n"}};

TEST(ChosenChannelTest, TheFirstOneUnlessTheOptionsTakeAnother) {
  EXPECT_EQ(ChosenChannel("a.ims", kThree, {}).value(), 0);
  EXPECT_EQ(ChosenChannel("a.ims", kThree, {.channel = 2}).value(), 2);
  EXPECT_EQ(ChosenChannel("a.ims", kThree, {.channel = 3}).status().message(),
            "a.ims: has 3 channels, so channel must be 0 to 2 (0: DAPI, 1, 2: GFP?)");
  EXPECT_EQ(ChosenChannel("a.ims", {FieldInfo{}}, {.channel = kLuminance}).status().message(),
            "a.ims: has 1 channel, so channel must be 0");
}

TEST(ChosenChannelTest, OfManyChannelsSomeAreNamed) {
  std::vector<FieldInfo> many(1000);
  EXPECT_EQ(ChosenChannel("a", many, {.channel = 1000}).status().message(), "a: has 1000 channels, so channel must be 0 to 999");
  many[999].name = "last";
  EXPECT_EQ(ChosenChannel("a", many, {.channel = 1000}).status().message(),
            "a: has 1000 channels, so channel must be 0 to 999 (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, ...)");
}

TEST(ChosenChannelTest, WhoDidNotChooseIsTold) {
  EXPECT_EQ(ShownChannelText("a.ims", kThree, 0, {}),
            "a.ims: shows channel 0 of 3; --channel takes another one: 0 to 2 (0: DAPI, 1, 2: GFP?)");
  EXPECT_EQ(ShownChannelText("a.ims", kThree, 0, {.channel = 0}), std::nullopt);
  EXPECT_EQ(ShownChannelText("a.ims", {{.name = "DAPI"}}, 0, {}), std::nullopt);
  EXPECT_EQ(ShownChannelText("a.ims", {}, 0, {}), std::nullopt);
}

}  // namespace
}  // namespace slabstream
