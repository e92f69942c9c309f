#include "common/base/did_you_mean.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "common/base/find_named.h"

namespace slabstream {
namespace {

std::string_view MeantBy(std::string_view text) {
  static const std::vector<std::string_view> names = {"render", "turntable", "slice", "up", "down", "mri-brain", "raycast", "GFP"};
  return MostAlike(text, names);
}

TEST(DidYouMean, FewWrongLettersAreForgiven) {
  EXPECT_EQ(MeantBy("rendr"), "render");
  EXPECT_EQ(MeantBy("redner"), "render") << "swapped";
  EXPECT_EQ(MeantBy("turntabel"), "turntable");
  EXPECT_EQ(MeantBy("sliice"), "slice");
  EXPECT_EQ(MeantBy("MRI_Brain"), "mri-brain");
  EXPECT_EQ(MeantBy("gfp"), "GFP");
  EXPECT_EQ(MeantBy("ray"), "raycast") << "a part of it";
  EXPECT_EQ(MeantBy("brain"), "mri-brain");
}

TEST(DidYouMean, WhatIsLikeNothingIsNotGuessed) {
  EXPECT_EQ(MeantBy(""), "");
  EXPECT_EQ(MeantBy("x"), "");
  EXPECT_EQ(MeantBy("volume"), "");
  EXPECT_EQ(MeantBy("on"), "");
  EXPECT_EQ(MeantBy(std::string(100'000, 'r')), "");
  EXPECT_EQ(MostAlike("render", {}), "");
}

TEST(DidYouMean, ListsOfEntriesAndOfTextsAreNamesToo) {
  struct Entry {
    std::string name;
  };
  EXPECT_EQ(DidYouMean("hed", std::vector<Entry>{{"foot"}, {"head"}}), "; did you mean 'head'?");
  EXPECT_EQ(DidYouMean("hed", std::vector<std::string>{"foot", "head"}), "; did you mean 'head'?");
  EXPECT_EQ(DidYouMean("liver", std::vector<std::string>{"foot", "head"}), "");
}

}  // namespace
}  // namespace slabstream
