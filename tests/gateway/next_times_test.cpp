// What is fetched ahead while times are played.
#include "gateway/next_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> TimesAfter(const std::string& before, const std::string& now, int times) {
  std::vector<std::string> texts;
  for (const FrameRequest& next : NextTimes({.size = {640, 480}, .time = now}, before, times)) texts.push_back(next.time);
  return texts;
}

TEST(NextTimesTest, TimesGoOnAsTheyWent) {
  EXPECT_THAT(TimesAfter("3", "4", 10), ElementsAre("5", "6"));
  EXPECT_THAT(TimesAfter("4", "3", 10), ElementsAre("2", "1"));
  EXPECT_THAT(TimesAfter("0", "3", 10), ElementsAre("6", "9"));
  EXPECT_THAT(TimesAfter("8", "9", 10), ElementsAre("0", "1")) << "and begin anew";
  EXPECT_THAT(TimesAfter("9", "0", 10), ElementsAre("1", "2"));
  EXPECT_THAT(TimesAfter("0", "1", 2), ElementsAre("0")) << "no more than there are";
}

TEST(NextTimesTest, WhereNobodyPlaysNothingIsFetched) {
  EXPECT_THAT(TimesAfter("3", "3", 10), IsEmpty());
  EXPECT_THAT(TimesAfter("", "3", 10), IsEmpty());
  EXPECT_THAT(TimesAfter("3", "last", 10), IsEmpty());
  EXPECT_THAT(TimesAfter("3s", "4s", 10), IsEmpty());
  EXPECT_THAT(TimesAfter("0", "1", 1), IsEmpty());
  EXPECT_THAT(TimesAfter("-1", "0", 10), IsEmpty());
  EXPECT_THAT(TimesAfter("3", "10", 10), IsEmpty());
}

// A pixel is as much larger as its detail is finer: the width of a voxel in pixels, by which levels are chosen, is the same.
TEST(NextTimesTest, PicturesAreSmallAndOfTheSameLevels) {
  for (const double detail : {0.0, 0.5, 1.0, 4.0}) {
    const FrameRequest next = NextTimes({.size = {640, 480}, .time = "1", .detail = detail}, "0", 10).at(0);
    EXPECT_EQ(next.size, (ImageSize{40, 30}));
    EXPECT_DOUBLE_EQ(next.detail, (detail == 0 ? 1 : detail) / 16);
  }
  EXPECT_EQ(NextTimes({.size = {5, 7}, .time = "1"}, "0", 10).at(0).size, (ImageSize{1, 1}));
}

}  // namespace
}  // namespace slabstream
