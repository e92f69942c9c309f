#include "client/cli/laboratory.h"

#include <gtest/gtest.h>

#include <vector>

namespace slabstream {
namespace {

bool Is(const std::vector<const char*>& words) { return IsOfLaboratory(words); }

TEST(LaboratoryTest, TheFirstCommandDecides) {
  EXPECT_TRUE(Is({"bench"}));
  EXPECT_TRUE(Is({"experiment", "sweep", "render"}));
  EXPECT_TRUE(Is({"--log-level", "debug", "bench", "--list"}));
  EXPECT_TRUE(Is({"--log-level=debug", "--help", "experiment"}));
  EXPECT_FALSE(Is({}));
  EXPECT_FALSE(Is({"--log-level", "bench"}));
  EXPECT_FALSE(Is({"render", "bench"}));
  EXPECT_FALSE(Is({"benchmark"}));
}

TEST(LaboratoryTest, WhatIsAskedAboutItsCommandsIsItsOwnToAnswer) {
  EXPECT_TRUE(Is({"help", "experiment", "sweep"}));
  EXPECT_TRUE(Is({"options", "bench"}));
  EXPECT_TRUE(Is({"man", "bench"}));
  EXPECT_FALSE(Is({"help"}));
  EXPECT_FALSE(Is({"help", "render"}));
}

TEST(LaboratoryTest, CompletionIsItsOwnBehindItsCommand) {
  EXPECT_TRUE(Is({"complete", "bench", "--si"}));
  EXPECT_TRUE(Is({"complete", "help", "experiment", ""}));
  EXPECT_FALSE(Is({"complete"}));
  EXPECT_FALSE(Is({"complete", "bench"}));
  EXPECT_FALSE(Is({"complete", "help", "bench"}));
  EXPECT_FALSE(Is({"complete", "render", "bench", ""}));
}

}  // namespace
}  // namespace slabstream
