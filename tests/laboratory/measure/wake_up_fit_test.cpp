#include "laboratory/measure/wake_up_probe.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/simulator/support.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr double kAwake = 21e-6, kAsleep = 83e-6;

// Frames of one worker as the simulation has them on a machine with these wake-ups, one after the other.
std::vector<FrameInstants> SimulatedInstants(double render, int count) {
  MachineModel machine = WithoutDelays();
  machine.wake_ups = {.awake = kAwake, .asleep = kAsleep};
  MadeFrame frame(1, 1, 16, 1, render, "fan-in");
  frame.finish_seconds = 10e-6;
  const Timeline timeline = Simulate(std::vector<FrameInput>(std::size_t(count), frame.input()), machine);
  std::vector<FrameInstants> instants(std::size_t(count), FrameInstants{});
  for (std::size_t i = 0; i < instants.size(); ++i) {
    instants[i].submitted = timeline.frames[i].submitted;
    instants[i].received = timeline.frames[i].received;
  }
  for (const SimulatedSpan& span : timeline.spans) {
    FrameInstants& of_frame = instants[span.frame];
    (span.lane == Lane::kRender ? of_frame.render_begin : of_frame.finish_begin) = span.begin;
    (span.lane == Lane::kRender ? of_frame.render_end : of_frame.finish_end) = span.end;
  }
  return instants;
}

// What the simulation counts, the calibration counts: frames that were simulated with some constants give these back.
TEST(WakeUpFit, SimulatedFramesGiveTheirConstantsBack) {
  const WakeUpEstimates found = FitWakeUps(SimulatedInstants(80e-6, 9), SimulatedInstants(5e-3, 9));
  EXPECT_NEAR(found.awake.median, kAwake, 1e-9);
  EXPECT_NEAR(found.asleep.median, kAsleep, 1e-9);
  EXPECT_NEAR(found.Costs().awake, kAwake, 1e-9);
  EXPECT_NEAR(found.Costs().asleep, kAsleep, 1e-9);
}

// Every stretch of time a little longer or shorter, and in every fifth frame a thread waits for a time slice of 3 ms somewhere.
TEST(WakeUpFit, NoiseAndLostTimeSlicesHardlyCount) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  const auto disturbed = [&](std::vector<FrameInstants> frames) {
    for (FrameInstants& frame : frames) {
      double late = 0;
      const int lost = random.Chance(0.2) ? random.Integer(0, 2) : -1;
      double FrameInstants::*const instants[] = {&FrameInstants::render_begin, &FrameInstants::render_end, &FrameInstants::finish_begin,
                                                 &FrameInstants::finish_end, &FrameInstants::received};
      for (int i = 0; i < 5; ++i) {
        if (i % 2 == 0) late += random.Real(-8e-6, 8e-6);
        if (i == 2 * lost) late += 3e-3;
        frame.*instants[i] += late;
      }
    }
    return frames;
  };
  const WakeUpEstimates found = FitWakeUps(disturbed(SimulatedInstants(80e-6, 120)), disturbed(SimulatedInstants(5e-3, 40)));
  EXPECT_NEAR(found.awake.median, kAwake, 0.1 * kAwake);
  EXPECT_NEAR(found.asleep.median, kAsleep, 0.1 * kAsleep);
  for (const Estimate& estimate : {found.awake, found.asleep}) {
    EXPECT_GE(estimate.coverage, 0.95);
    EXPECT_LE(estimate.low, estimate.median);
    EXPECT_GE(estimate.high, estimate.median);
    EXPECT_LT(estimate.high - estimate.low, 0.2 * estimate.median);
  }
}

// Instants of real frames lie in order, so that no constant can come out as zero or less.
TEST(WakeUpProbe, RealFramesTakeTimeToWakeUp) {
  WakeUpProbe probe;
  const Status sampled = probe.Sample(3);
  ASSERT_TRUE(sampled.ok()) << sampled.message();
  const WakeUpEstimates found = probe.Estimates();
  EXPECT_EQ(found.awake.count, 9);
  EXPECT_EQ(found.asleep.count, 3);
  EXPECT_GT(found.awake.low, 0);
  EXPECT_GT(found.asleep.low, 0);
}

}  // namespace
}  // namespace slabstream
