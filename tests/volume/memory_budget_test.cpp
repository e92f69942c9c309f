#include "common/volume/memory_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace slabstream {
namespace {

TEST(MemoryBudget, FitsALittleAndNotEverything) {
  EXPECT_GT(AvailableMemoryBytes(), 0);
  EXPECT_TRUE(CheckFitsMemory(1, "a byte").ok());
  const Status status = CheckFitsMemory(std::numeric_limits<std::int64_t>::max() - 1, "all that can be counted");
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), testing::ContainsRegex("^all that can be counted needs 8796093022207 MiB.* only [0-9]+ MiB"));
}

}  // namespace
}  // namespace slabstream
