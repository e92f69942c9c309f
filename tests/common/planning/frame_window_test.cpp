#include "common/planning/frame_window.h"

#include <gtest/gtest.h>

#include <limits>

namespace slabstream {
namespace {

TEST(FrameWindow, OneAndTwoWorkersHaveTwoGroupsUnderWay) {
  for (const std::size_t workers : {0, 1, 2}) EXPECT_EQ(WindowFor(workers, 1, 0), (FrameWindow{2, 2}));
}

TEST(FrameWindow, HoldsNoMoreThanFitsTheWorkersMemory) {
  EXPECT_EQ(WindowFor(8, 1, 0, 1), (FrameWindow{1, 1}));
  EXPECT_EQ(WindowFor(8, 2, 0, 1), (FrameWindow{2, 2}));
  EXPECT_EQ(WindowFor(8, 1, 0, 5), (FrameWindow{5, 5}));
  EXPECT_EQ(WindowFor(8, 1, 0, 1000), WindowFor(8, 1, 0));
}

TEST(FrameWindow, GrowsWithWorkersAndShrinksWithFrames) {
  const std::int64_t bytes[] = {
      0, 1, 1 << 20, 1 << 24, kWindowBytes / 5, kWindowBytes, 8 * kWindowBytes, std::numeric_limits<std::int64_t>::max()};
  for (std::size_t workers = 0; workers < 2000; workers += 1 + workers / 8) {
    int last = kMostInWindow;
    for (const std::int64_t frame_bytes : bytes) {
      const FrameWindow window = WindowFor(workers, 1, frame_bytes);
      EXPECT_GE(window.groups, kLeastInWindow);
      EXPECT_GE(window.frames, kLeastInWindow);
      EXPECT_LE(window.groups, last);
      EXPECT_LE(window.groups, std::max<int>(int(workers), kLeastInWindow));
      if (window.groups > kLeastInWindow) {
        EXPECT_LE(window.groups * frame_bytes, kWindowBytes) << workers << " workers";
      }
      EXPECT_LE(window.groups, WindowFor(workers + 1, 1, frame_bytes).groups);
      last = window.groups;
    }
  }
  EXPECT_EQ(WindowFor(1000, 1, 1).groups, kMostInWindow);
}

TEST(FrameWindow, TeamsHaveOneEach) {
  for (std::uint32_t teams = 1; teams <= 30; ++teams) {
    EXPECT_EQ(WindowFor(30, teams, 0).groups, int(teams) * WindowFor((30 + teams - 1) / teams, 1, 0).groups) << teams;
  }
}

}  // namespace
}  // namespace slabstream
