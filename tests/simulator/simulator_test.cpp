// Many worlds, each decided by its seed. A failure prints the command that runs its world alone. SLABSTREAM_SEEDS=n runs n worlds of each
// kind, SLABSTREAM_FIRST_SEED=n begins with seed n. SLABSTREAM_PIECE=1: they are a piece of a larger run (worlds), in which rare things may
// be too rare.
#include <errno.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iostream>
#include <string>

#include "tests/simulator/simulation.h"

namespace slabstream {
namespace {

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

std::string CommandFor(std::uint64_t seed) {
  const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
  return "SLABSTREAM_SEED=" + std::to_string(seed) + " " + program_invocation_name + " --gtest_filter=*" + test;
}

// A failed CHECK ends the program: this tells of which world it was.
std::array<char, 4096> last_words;

void TellOnAbort(std::uint64_t seed) {
  const std::string words = "This world again: " + CommandFor(seed) + "\n";
  std::strncpy(last_words.data(), words.c_str(), last_words.size() - 1);
  std::signal(SIGABRT, [](int) { (void)!write(STDERR_FILENO, last_words.data(), std::strlen(last_words.data())); });
}

void Print(const Tally& tally, double processor_seconds) {
  for (std::size_t i = 0; i < kCountRules.size(); ++i) std::cout << "  " << tally[Count(i)] << " " << kCountRules[i].what << "\n";
  const double hours = tally.virtual_seconds / 3600;
  std::cout << tally[Count::kWorlds] << " worlds, " << hours << " virtual hours in " << processor_seconds
            << " s of processor time: " << hours / processor_seconds << " virtual hours a second\n";
}

// In worlds of owners (`owned`) some things never happen, and others only there.
void RunWorlds(bool owned, std::uint64_t worlds_by_default) {
  const bool single = std::getenv("SLABSTREAM_SEED") != nullptr;
  const std::uint64_t begin = FromEnvironment(single ? "SLABSTREAM_SEED" : "SLABSTREAM_FIRST_SEED", 1);
  const std::uint64_t end = begin + (single ? 1 : FromEnvironment("SLABSTREAM_SEEDS", worlds_by_default));
  Tally tally;
  int failed_worlds = 0;
  for (std::uint64_t seed = begin; seed < end && failed_worlds < 3; ++seed) {
    SCOPED_TRACE("This world again: " + CommandFor(seed));
    TellOnAbort(seed);
    const auto failures_before = testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
    Simulation(seed, owned, tally).Run();
    const auto failures = testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
    if (failures > failures_before) ++failed_worlds;
    if (testing::Test::HasFatalFailure()) break;
  }
  Print(tally, double(std::clock()) / CLOCKS_PER_SEC);
  // The worlds must be such that everything happens in them, and the service such that faults rarely cost a frame.
  const std::uint64_t worlds = tally[Count::kWorlds];
  if (worlds < 400 || std::getenv("SLABSTREAM_PIECE") != nullptr) return;
  EXPECT_GT(tally[Count::kPictures] * 3, tally[Count::kRequests] * (owned ? 1 : 2));
  for (std::size_t i = 0; i < kCountRules.size(); ++i) {
    if ((i >= std::size_t(Count::kOwners)) != owned) continue;
    EXPECT_GE(tally[Count(i)] * 1000, kCountRules[i].least * worlds) << kCountRules[i].what;
  }
}

TEST(Simulator, EveryFrameEndsRightOrWithItsError) { RunWorlds(false, 3000); }

TEST(Simulator, SoDoesEveryFrameOfVoxelsThatProcessesOwn) { RunWorlds(true, 400); }

}  // namespace
}  // namespace slabstream
