#include "common/stats/report.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace slabstream {
namespace {

// They are keys of --stats and names of --trace, so scripts rely on them.
TEST(StageNames, AreDistinctIdentifiers) {
  std::set<std::string_view> names;
  for (int stage = 0; stage < kStageCount; ++stage) {
    const std::string_view name = ToString(static_cast<Stage>(stage));
    EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"), std::string_view::npos) << name;
    EXPECT_TRUE(names.insert(name).second) << name;
  }
  EXPECT_EQ(names.count("transform"), 1U);
  EXPECT_EQ(names.count(""), 0U);
}

}  // namespace
}  // namespace slabstream
