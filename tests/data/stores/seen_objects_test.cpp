#include "data/stores/seen_objects.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "common/base/time.h"

namespace slabstream {
namespace {

using Verdict = SeenObjects::Verdict;

// The first `bytes` bytes of an object of 100.
SeenObjects::News News(const std::string& version, std::uint64_t digest, std::uint64_t bytes = 10, std::uint64_t size = 100) {
  return {version, size, SeenObjects::Part{ByteSpan{0, bytes}, bytes, digest}};
}

TEST(SeenObjects, TheSameBytesAreTheSameObjectWhateverTheirVersion) {
  SeenObjects seen;
  const Time now = MonotonicNow();
  EXPECT_EQ(seen.Judge("a", News("1", 7), now), Verdict::kSame);
  EXPECT_EQ(seen.Judge("a", News("1", 7), now), Verdict::kSame);
  EXPECT_EQ(seen.Judge("a", News("", 7), now), Verdict::kSame) << "a server that tells none";
  EXPECT_EQ(seen.Judge("a", News("2", 7), now), Verdict::kSame) << "a replica";
  EXPECT_EQ(seen.Judge("a", News("2", 8), now), Verdict::kChanged);
  EXPECT_EQ(seen.Judge("a", News("1", 8), now), Verdict::kChanged) << "whatever the server says";
  EXPECT_EQ(seen.Judge("a", News("1", 7, 10, 101), now), Verdict::kChanged) << "another size";
  EXPECT_EQ(seen.Judge("b", News("2", 8), now), Verdict::kSame);
}

TEST(SeenObjects, PartsOfAnotherVersionMustBeCompared) {
  SeenObjects seen;
  const Time now = MonotonicNow();
  EXPECT_EQ(seen.Judge("a", {"0", 100, {}}, now), Verdict::kSame);
  EXPECT_EQ(seen.Judge("a", {"1", 100, {}}, now), Verdict::kSame) << "nothing was read that could be mixed with it";
  EXPECT_EQ(seen.Judge("a", News("1", 7), now), Verdict::kSame);
  EXPECT_EQ(seen.Judge("a", News("2", 9, 20), now), Verdict::kMustBeCompared);
  ASSERT_EQ(seen.parts("a").size(), 1U);
  EXPECT_EQ(seen.parts("a").front().digest, 7U);
  seen.Accept("a", News("2", 9, 20), now);
  EXPECT_EQ(seen.Judge("a", News("2", 11, 30), now), Verdict::kSame) << "this version is known now";
  EXPECT_EQ(seen.Judge("a", News("2", 13, 40), now), Verdict::kSame);
  ASSERT_EQ(seen.parts("a").size(), 3U);
  EXPECT_EQ(seen.parts("a").front().digest, 7U) << "the first part stays";
}

// Of a server that makes up a version for each answer, an object is compared once a minute.
TEST(SeenObjects, VersionsThatMeanNothingAreComparedNowAndThen) {
  SeenObjects seen;
  const Time begin = MonotonicNow();
  (void)seen.Judge("a", News("first", 1), begin);
  int compared = 0;
  const auto judge = [&](int i, Time now) {
    const SeenObjects::News news = News(std::to_string(i), std::uint64_t(100 + i), std::uint64_t(100 + i));
    if (seen.Judge("a", news, now) != Verdict::kMustBeCompared) return;
    ++compared;
    seen.Accept("a", news, now);
  };
  for (int i = 0; i < 50; ++i) judge(i, begin);
  EXPECT_EQ(compared, 8);
  judge(50, begin + SeenObjects::kFresh);
  EXPECT_EQ(compared, 9);
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
  EXPECT_FALSE(seen.IsFresh("a", "2", now));
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
