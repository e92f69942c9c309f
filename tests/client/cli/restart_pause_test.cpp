#include "client/cli/restart_pause.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

using std::chrono::seconds;

TEST(RestartPause, DoublesUpToItsLongestAndBeginsAgainAfterAMinute) {
  RestartPause pause;
  Time now{seconds(1000)};
  for (const int expected : {1, 2, 4, 8, 16, 30, 30}) {
    EXPECT_EQ(pause.AfterEnd(now, now + seconds(5)), seconds(expected));
    now += seconds(100);
  }
  EXPECT_EQ(pause.AfterEnd(now, now + seconds(59)), seconds(30));
  EXPECT_EQ(pause.AfterEnd(now, now + seconds(60)), seconds(1));
  EXPECT_EQ(pause.AfterEnd(now, now), seconds(2));
}

}  // namespace
}  // namespace slabstream
