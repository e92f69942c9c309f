#include "data/stores/seen_objects.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "common/base/time.h"

namespace slabstream {
namespace {

TEST(SeenObjects, TheFirstVersionCounts) {
  SeenObjects seen;
  EXPECT_TRUE(seen.Agrees("a", "")) << "a server that tells none";
  EXPECT_TRUE(seen.Agrees("a", "1"));
  EXPECT_TRUE(seen.Agrees("a", ""));
  EXPECT_TRUE(seen.Agrees("b", "2"));
  EXPECT_FALSE(seen.Agrees("a", "2"));
  EXPECT_TRUE(seen.Agrees("a", "1"));
}

TEST(SeenObjects, WhatTheServerSaysCountsForAWhile) {
  SeenObjects seen;
  const Time begin = MonotonicNow();
  const Duration almost = SeenObjects::kFresh - std::chrono::nanoseconds(1);
  EXPECT_FALSE(seen.IsFresh("a", "1", begin));
  seen.NoteVersion("a", "1", begin);
  EXPECT_TRUE(seen.IsFresh("a", "1", begin + almost));
  EXPECT_FALSE(seen.IsFresh("a", "1", begin + SeenObjects::kFresh));
  EXPECT_FALSE(seen.IsFresh("a", "2", begin));
  seen.NoteMissing("b", begin);
  EXPECT_TRUE(seen.IsMissing("b", begin + almost));
  EXPECT_FALSE(seen.IsMissing("b", begin + SeenObjects::kFresh));
  EXPECT_FALSE(seen.IsMissing("a", begin));
}

TEST(SeenObjects, WhatItSaidLastCounts) {
  SeenObjects seen;
  const Time now = MonotonicNow();
  seen.NoteMissing("a", now);
  seen.NoteVersion("a", "1", now);
  EXPECT_FALSE(seen.IsMissing("a", now));
  EXPECT_TRUE(seen.IsFresh("a", "1", now));
  seen.NoteMissing("a", now);
  EXPECT_FALSE(seen.IsFresh("a", "1", now));
  EXPECT_FALSE(seen.Agrees("a", "2")) << "another object came where one was";
}

TEST(SeenObjects, ForgetsTheOldest) {
  SeenObjects seen;
  const Time now = MonotonicNow();
  for (std::size_t i = 0; i <= SeenObjects::kMost; ++i) seen.NoteMissing(std::to_string(i), now);
  EXPECT_FALSE(seen.IsMissing("0", now));
  EXPECT_TRUE(seen.IsMissing("1", now));
}

}  // namespace
}  // namespace slabstream
