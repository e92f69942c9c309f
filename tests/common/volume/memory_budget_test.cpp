#include "common/volume/memory_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

TEST(MemoryBudget, FitsALittleAndNotEverything) {
  EXPECT_GT(AvailableMemoryBytes(), 0);
  EXPECT_TRUE(CheckFitsMemory(1, "a byte").ok());
  const Status status = CheckFitsMemory(std::numeric_limits<std::int64_t>::max() - 1, "all that can be counted");
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), testing::ContainsRegex("^all that can be counted needs 8796093022207 MiB.* only [0-9]+ MiB"));
}

TEST(MemoryBudget, LimitsAreWholeNumbersWithUnits) {
  EXPECT_EQ(*ParseMemoryLimit("--memory", "512MiB"), std::uint64_t{512} << 20);
  EXPECT_EQ(*ParseMemoryLimit("--memory", "4GiB"), std::uint64_t{4} << 30);
  EXPECT_EQ(*ParseMemoryLimit("--memory", "2TiB"), std::uint64_t{2} << 40);
  EXPECT_EQ(*ParseMemoryLimit("--memory", "512M"), std::uint64_t{512} << 20);
  EXPECT_EQ(*ParseMemoryLimit("--memory", "2G"), std::uint64_t{2} << 30);
  EXPECT_EQ(*ParseMemoryLimit("--memory", "1T"), std::uint64_t{1} << 40);
  EXPECT_EQ(*ParseMemoryLimit("--memory", "1/2"), MachineMemoryBytes() / 2);
  for (const char* text :
       {"1/", "1/0", "2/3", "1/2G", "1/-2", "", "4", "4GB", "4 GiB", "GiB", "-4GiB", "1.5GiB", "4gib", "4GiBx", "2g", "iB", "G"}) {
    EXPECT_EQ(ParseMemoryLimit("--memory", text).status().message(),
              "--memory '" + std::string(text) + "' is not a size such as 512M or 4G, nor a part of the machine such as 1/4");
  }
  for (const char* text : {"0GiB", "255MiB", "1025TiB", "18014398509481985MiB", "1/1000000000"}) {
    EXPECT_EQ(ParseMemoryLimit("--memory", text).status().message(), "--memory " + std::string(text) + " is out of range [256M, 1024T]");
  }
}

TEST(MemoryBudget, AServiceStaysUnderItsShare) {
  constexpr std::uint64_t kGibi = std::uint64_t{1} << 30;
  for (const int workers : {1, 2, 3, 7, 16}) {
    const Result<MemoryShares> shares = ShareMemory(12 * kGibi + 5, workers);
    ASSERT_TRUE(shares.ok());
    const std::uint64_t all = shares->coordinator + std::uint64_t(workers) * shares->worker;
    EXPECT_LE(all, 12 * kGibi + 5);
    EXPECT_GT(all, 12 * kGibi - 16);
  }
  EXPECT_THAT(ShareMemory(kGibi, 4).status().message(),
              "memory 1024 MiB is too little for a coordinator and 4 workers, which need 1536 MiB");
  EXPECT_TRUE(ShareMemory(1536 << 20, 4).ok());
  EXPECT_TRUE(ShareMemory(768 << 20, 1).ok());
  EXPECT_LT(DefaultServiceMemory(), MachineMemoryBytes());
  EXPECT_GE(DefaultMemory().worker, kLeastMemoryBytes);
}

TEST(MemoryBudget, TheLeastLimitOfAControlGroupAndThoseAboveItCounts) {
  const TemporaryDirectory temporary;
  const std::filesystem::path root = temporary.path();
  const auto write = [&](const std::filesystem::path& path, const char* text) {
    std::filesystem::create_directories((root / path).parent_path());
    std::ofstream(root / path) << text;
  };
  constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(ControlGroupLimit("0::/a/b\n", root), kNone) << "no files";
  write("a/b/memory.max", "max\n");
  write("a/memory.max", "1000\n");
  write("memory.max", "3000\n");
  EXPECT_EQ(ControlGroupLimit("0::/a/b\n", root), 1000);
  EXPECT_EQ(ControlGroupLimit("0::/c\n", root), 3000);
  EXPECT_EQ(ControlGroupLimit("0::/\n", root), 3000);
  write("memory/x/memory.limit_in_bytes", "500\n");
  EXPECT_EQ(ControlGroupLimit("4:memory:/x\n0::/a\n", root), 500) << "version 1 beside version 2";
  EXPECT_EQ(ControlGroupLimit("4:cpu,memory:/x\n", root), 500);
  EXPECT_EQ(ControlGroupLimit("4:cpu:/x\nnonsense\n", root), kNone);
}

}  // namespace
}  // namespace slabstream
