// Many worlds, each decided by its seed. A failure names the seed; SLABSTREAM_SEED=n runs that world alone, SLABSTREAM_SEEDS=n the first n.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <string>

#include "tests/simulator/simulation.h"

namespace slabstream {
namespace {

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

TEST(Simulator, EveryFrameEndsRightOrWithItsError) {
  const bool single = std::getenv("SLABSTREAM_SEED") != nullptr;
  const std::uint64_t begin = single ? FromEnvironment("SLABSTREAM_SEED", 0) : 1;
  const std::uint64_t end = single ? begin + 1 : begin + FromEnvironment("SLABSTREAM_SEEDS", 10000);
  Tally tally;
  int failed_worlds = 0;
  for (std::uint64_t seed = begin; seed < end && failed_worlds < 3; ++seed) {
    SCOPED_TRACE("SLABSTREAM_SEED=" + std::to_string(seed));
    const auto failures_before = testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
    Simulation(seed, tally).Run();
    const auto failures = testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
    if (failures > failures_before) ++failed_worlds;
    if (HasFatalFailure()) break;
  }
  std::cout << tally.worlds << " worlds, " << tally.requests << " requests: " << tally.pictures << " pictures (" << tally.retried
            << " after more than one attempt), " << tally.previews << " previews, " << tally.errors << " errors (" << tally.cancelled
            << " cancelled); " << tally.cached_frames << " frames from cached voxels, " << tally.workers_killed << " workers killed, "
            << tally.coordinator_restarts << " coordinator restarts; " << tally.masks << " groups with hidden tiles ("
            << tally.masks_of_retries << " of them after the first attempt), " << tally.hidden_pixels << " pixels without hidden boxes, "
            << tally.hidden_boxes << " boxes not rendered; " << tally.counts << " counts of occupied voxels, " << tally.moved_boxes
            << " boxes moved by balance; " << tally.workers_left << " workers left, " << tally.handed_over
            << " frames handed over without loss\n";
  if (tally.worlds < 1000) return;
  // The worlds must be such that something is tested, and the service such that faults rarely cost a frame.
  EXPECT_GT(tally.pictures, tally.requests * 8 / 10);
  EXPECT_GT(tally.retried, tally.worlds / 50);
  EXPECT_GT(tally.previews, tally.worlds / 10);
  EXPECT_GT(tally.cached_frames, tally.worlds / 10);
  EXPECT_GT(tally.workers_killed, tally.worlds / 4);
  EXPECT_GT(tally.coordinator_restarts, tally.worlds / 20);
  EXPECT_GT(tally.masks, tally.worlds);
  EXPECT_GT(tally.masks_of_retries, tally.worlds / 50);
  EXPECT_GT(tally.hidden_pixels, tally.worlds);
  EXPECT_GT(tally.hidden_boxes, tally.worlds);
  EXPECT_GT(tally.counts, tally.worlds / 4);
  EXPECT_GT(tally.moved_boxes, tally.worlds / 20);
  EXPECT_GT(tally.workers_left, tally.worlds / 4);
  EXPECT_GT(tally.handed_over, tally.worlds / 100);
}

}  // namespace
}  // namespace slabstream
