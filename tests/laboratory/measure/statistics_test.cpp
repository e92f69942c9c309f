#include "laboratory/measure/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/support/random.h"

namespace slabstream {
namespace {

TEST(MedianCoverage, IsThatOfTheTables) {
  // Conover, Practical Nonparametric Statistics: exact sign-test intervals of the median.
  EXPECT_NEAR(MedianCoverage(5, 1), 0.9375, 1e-9);
  EXPECT_NEAR(MedianCoverage(6, 1), 0.96875, 1e-9);
  EXPECT_NEAR(MedianCoverage(10, 2), 0.978515625, 1e-9);
  EXPECT_NEAR(MedianCoverage(10, 3), 0.890625, 1e-9);
  EXPECT_NEAR(MedianCoverage(20, 6), 0.9586, 1e-4);
  EXPECT_NEAR(MedianCoverage(1, 1), 0, 1e-12);
}

TEST(Quantile, IsTheLeastValueThatTheShareDoesNotExceed) {
  EXPECT_EQ(Quantile({5}, 0), 5);
  EXPECT_EQ(Quantile({5}, 1), 5);
  EXPECT_EQ(Quantile({4, 1, 3, 2}, 0), 1);
  EXPECT_EQ(Quantile({4, 1, 3, 2}, 0.25), 1);
  EXPECT_EQ(Quantile({4, 1, 3, 2}, 0.26), 2);
  EXPECT_EQ(Quantile({4, 1, 3, 2}, 0.75), 3);
  EXPECT_EQ(Quantile({4, 1, 3, 2}, 1), 4);
}

TEST(MedianOf, KnownValues) {
  const Estimate none = MedianOf({});
  EXPECT_EQ(none.count, 0);
  const Estimate one = MedianOf({7});
  EXPECT_EQ(one.median, 7);
  EXPECT_EQ(one.low, 7);
  EXPECT_EQ(one.high, 7);
  const Estimate five = MedianOf({5, 1, 4, 2, 3});
  EXPECT_EQ(five.median, 3);
  EXPECT_EQ(five.low, 1) << "five values reach no 95 %: all of them";
  EXPECT_EQ(five.high, 5);
  EXPECT_NEAR(five.coverage, 0.9375, 1e-9);
  const Estimate ten = MedianOf({10, 9, 8, 7, 6, 5, 4, 3, 2, 1});
  EXPECT_EQ(ten.median, 5.5);
  EXPECT_EQ(ten.low, 2);
  EXPECT_EQ(ten.high, 9);
  const Estimate same = MedianOf({3, 3, 3});
  EXPECT_EQ(same.low, same.high);
  EXPECT_EQ(same.coverage, 1);
}

TEST(MedianOf, CoversTheTrueMedianAsOftenAsItSays) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const int count : {6, 9, 15, 40}) {
    int covered = 0;
    double promised = 0;
    constexpr int kSamples = 3000;
    for (int sample = 0; sample < kSamples; ++sample) {
      std::vector<double> values(static_cast<std::size_t>(count));
      for (double& value : values) value = std::exp(3 * random.Real(0, 1));  // skewed; its median is exp(1.5)
      const Estimate estimate = MedianOf(values);
      covered += estimate.low <= std::exp(1.5) && std::exp(1.5) <= estimate.high ? 1 : 0;
      promised = estimate.coverage;
    }
    EXPECT_GE(promised, 0.95);
    EXPECT_NEAR(double(covered) / kSamples, promised, 0.02) << count;
  }
}

}  // namespace
}  // namespace slabstream
