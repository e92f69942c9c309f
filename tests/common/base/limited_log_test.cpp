#include "common/base/limited_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Time kStart{seconds(1000)};

TEST(LimitedLog, WritesSomeAtOnceThenOneASecondAndCountsTheRest) {
  LimitedLog log;
  int written = 0;
  for (int i = 0; i < 100000; ++i) written += log.LineFor("bad", kStart + milliseconds(i)).has_value();  // for 100 s
  EXPECT_EQ(written, LimitedLog::kAtOnce + 99);
  EXPECT_EQ(log.LineFor("worse", kStart + seconds(100)), "worse (999 more were left out before)");
}

TEST(LimitedLog, WritesWhateverIsRare) {
  LimitedLog log;
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(log.LineFor("bad", kStart + i * LimitedLog::kEach), "bad");
}

TEST(LimitedLog, EarnsNoMoreThanItWritesAtOnce) {
  LimitedLog log;
  int written = 0;
  for (int i = 0; i < 100; ++i) written += log.LineFor("bad", kStart).has_value();
  for (int i = 0; i < 100; ++i) written += log.LineFor("bad", kStart + seconds(3600)).has_value();
  EXPECT_EQ(written, 2 * LimitedLog::kAtOnce);
}

}  // namespace
}  // namespace slabstream
