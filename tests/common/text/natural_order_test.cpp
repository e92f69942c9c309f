#include "common/text/natural_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace slabstream {
namespace {

TEST(NaturalOrder, NumbersInNamesSortByValue) {
  std::vector<std::string> names = {"ts@10", "ts@2", "ts@02", "a10b2", "a9b11", "a10b1", "ts", "b"};
  std::ranges::sort(names, {}, InNaturalOrder);
  EXPECT_THAT(names, testing::ElementsAre("a9b11", "a10b1", "a10b2", "b", "ts", "ts@02", "ts@2", "ts@10"));
}

}  // namespace
}  // namespace slabstream
