// Coordinates and bounds of cells as one start and one step.
#include "data/volume_io/even_steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slabstream {
namespace {

using testing::FieldsAre;
using testing::Optional;

TEST(EvenCellsTest, EvenCellsHaveTheirCentresForCoordinates) {
  EXPECT_THAT(EvenCellsOf({0, 2, 2, 4, 4, 6}), Optional(FieldsAre(1, 2)));
  EXPECT_THAT(EvenCellsOf({6, 4, 4, 2}), Optional(FieldsAre(5, -2))) << "they fall";
  EXPECT_THAT(EvenCellsOf({2, 0, 4, 2, 6, 4}), Optional(FieldsAre(1, 2))) << "the upper bound may come first";
  EXPECT_THAT(EvenCellsOf({0, 2.01, 2.01, 4}), Optional(FieldsAre(1.005, 2))) << "within 2 % of a step";
}

TEST(EvenCellsTest, ASingleCellHasItsLengthForAStep) {
  EXPECT_THAT(EvenCellsOf({10, 14}), Optional(FieldsAre(12, 4)));
  EXPECT_THAT(EvenCellsOf({14, 10}), Optional(FieldsAre(12, 4)));
  EXPECT_EQ(EvenCellsOf({10, 10}), std::nullopt);
}

TEST(EvenCellsTest, OthersHaveNone) {
  EXPECT_EQ(EvenCellsOf({}), std::nullopt);
  EXPECT_EQ(EvenCellsOf({0, 2, 2, 4, 4, 7}), std::nullopt) << "the last cell is longer";
  EXPECT_EQ(EvenCellsOf({0, 1, 2, 3, 4, 5}), std::nullopt) << "there are gaps";
  EXPECT_EQ(EvenCellsOf({0, 3, 2, 5, 4, 7}), std::nullopt) << "they overlap";
  EXPECT_EQ(EvenCellsOf({1, 3, 1, 3}), std::nullopt) << "they are one";
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const double wrong : {std::nan(""), infinity, -infinity}) {
    EXPECT_EQ(EvenCellsOf({0, wrong}), std::nullopt);
    EXPECT_EQ(EvenCellsOf({wrong, wrong}), std::nullopt);
    EXPECT_EQ(EvenCellsOf({0, 2, 2, wrong, 4, 6}), std::nullopt);
    EXPECT_EQ(EvenCellsOf({wrong, 2, 2, 4}), std::nullopt);
  }
}

}  // namespace
}  // namespace slabstream
