#include "laboratory/experiments/walk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "laboratory/experiments/policies.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::Each;
using testing::Gt;
using testing::SizeIs;

class Walks : public testing::Test {
 protected:
  // One repeat of it, measured here.
  std::vector<WalkFrame> Measure(const Walk& walk) {
    std::vector<Trial> trials = {WalkTrial(context_, walk)};
    for (int step = 0; step < walk.frames; ++step) {
      if (IsSampled(step)) trials.push_back(FinishTrial(context_, FrameOf(walk, step)));
    }
    context_.Run(std::move(trials));
    std::vector<std::vector<WalkFrame>> repeats = RecallWalk(context_, walk);
    EXPECT_THAT(repeats, SizeIs(1));
    return std::move(repeats.front());
  }
  static Walk On(std::string_view path, const Policy& policy, int frames) {
    const BenchCase volume = ClusterCase({.size = 48}, 0.05);
    return {{volume, {48, 48}, {}, policy, 4}, FindPath(path), frames, TransferChoice{HalfShown(0.05)}};
  }
  static double Moved(const WalkFrame& frame) { return std::accumulate(frame.moved_bytes.begin(), frame.moved_bytes.end(), 0.0); }

  TemporaryDirectory folder_;
  ExperimentContext context_{
      {.quick = true, .repeats = 1}, OrThrow(TrialLog::Open(folder_ / "run", {"test", Json::object(), "", ""}, Resume::kSame)), {}};
};

TEST_F(Walks, TurntablesTurnByTwoDegreesAStepAndJumpsJumpOnce) {
  const Walk turntable = On("turntable", EqualSlabs().policy, kPathFrames), jump = On("jump", EqualSlabs().policy, kPathFrames);
  int jumps = 0;
  for (int step = 1; step < kPathFrames; ++step) {
    EXPECT_DOUBLE_EQ(*FrameOf(turntable, step).view.azimuth_degrees - *FrameOf(turntable, step - 1).view.azimuth_degrees, 2);
    const double jumped = *FrameOf(jump, step).view.azimuth_degrees - *FrameOf(jump, step - 1).view.azimuth_degrees;
    if (jumped != 0) {
      EXPECT_EQ(step, kPathFrames / 2);
      EXPECT_DOUBLE_EQ(jumped, 90);
      ++jumps;
    }
  }
  EXPECT_EQ(jumps, 1);
  EXPECT_GE(kPathFrames, 180);
}

TEST_F(Walks, OfAFileHaveNoTimeSeriesNorAnotherTransferFunctionThanANamedOne) {
  Walk walk = On("time-series", EqualSlabs().policy, 4);
  EXPECT_TRUE(IsPossible(walk));
  walk.frame.volume.volume = std::string("head.nrrd");
  EXPECT_FALSE(IsPossible(walk));
  walk.path = FindPath("transfer");
  EXPECT_TRUE(IsPossible(walk));
  walk.later.reset();
  EXPECT_FALSE(IsPossible(walk));
}

TEST_F(Walks, BoxesThatStayMoveNothingAfterTheFirstFrame) {
  const std::vector<WalkFrame> frames = Measure(On("turntable", BalancedTree().policy, 13));
  ASSERT_THAT(frames, SizeIs(13));
  // At first each worker fetches all that it draws.
  EXPECT_DOUBLE_EQ(std::ranges::max(frames[0].moved_bytes), frames[0].most_voxel_bytes);
  for (std::size_t step = 0; step < frames.size(); ++step) {
    EXPECT_EQ(Moved(frames[step]) > 0, step == 0) << step;
    EXPECT_EQ(frames[step].most_voxel_bytes, frames[0].most_voxel_bytes);
    ASSERT_THAT(frames[step].worker_seconds, SizeIs(4));
    EXPECT_THAT(frames[step].worker_seconds, Each(Gt(0)));
    EXPECT_EQ(frames[step].whole.has_value(), step == 11) << step;
  }
  EXPECT_EQ(frames[11].whole->WorkerSeconds(), frames[11].worker_seconds);
}

TEST_F(Walks, BoxesThatFollowTheTimesMoveVoxels) {
  Policy policy = EqualSlabs().policy;
  policy.balance = "planes";
  const std::vector<WalkFrame> frames = Measure(On("turntable", policy, 16));
  double moved = 0;  // by times that are measured: in one frame they may be even
  for (std::size_t step = 1; step < frames.size(); ++step) {
    moved += Moved(frames[step]);
    EXPECT_LT(Moved(frames[step]), Moved(frames[0])) << "what a worker holds does not travel again";
  }
  EXPECT_GT(moved, 0);
}

TEST_F(Walks, ATimeSeriesBringsANewVolumeEachTimeForWhichNothingIsKnown) {
  const std::vector<WalkFrame> frames = Measure(On("time-series", BalancedTree().policy, kFramesOfAVolume + 2));
  for (int step = 0; step < int(frames.size()); ++step) {
    EXPECT_EQ(Moved(frames[std::size_t(step)]) > 0, step % kFramesOfAVolume == 0) << step;
  }
}

TEST_F(Walks, ASlowWorkerTakesTwiceAsLongFromTheMiddleOn) {
  const Walk slow = On("slow-worker", BalancedTree().policy, 8);
  const std::vector<WalkFrame> frames = Measure(slow);
  const Json& steps = context_.log().All(WalkKey(context_, slow)).front()->at("steps");
  for (std::size_t step = 0; step < frames.size(); ++step) {
    const auto measured = steps[step]["seconds"].get<std::vector<double>>();  // by box, a box a worker
    const double all = std::accumulate(measured.begin(), measured.end(), 0.0);
    const std::vector<double>& slowed = frames[step].worker_seconds;
    EXPECT_NEAR(std::accumulate(slowed.begin(), slowed.end(), 0.0) - all, step < 4 ? 0 : slowed[0] * (1 - 1 / kSlowdown), 1e-9) << step;
  }
}

TEST_F(Walks, AnotherTransferFunctionDrawsLess) {
  const Walk walk = On("transfer", EqualSlabs().policy, 26);
  const std::vector<WalkFrame> frames = Measure(walk);
  const auto drawn = [&](std::size_t step) {
    double voxels = 0;
    for (const MeasuredFrame::Cost& box : frames[step].whole->boxes) voxels += box.drawn_voxels;
    return voxels;
  };
  EXPECT_LT(drawn(23), 0.9 * drawn(11));
}

}  // namespace
}  // namespace slabstream
