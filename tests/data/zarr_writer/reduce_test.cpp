#include "data/zarr_writer/reduce.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace slabstream {
namespace {

template <class T>
T One(SampleType type, Reduction reduction, const std::vector<T>& row) {
  std::vector<T> out(1);
  const Index3 size = {2, int(row.size()) / 2, 1};
  Reduce(type, reduction, reinterpret_cast<const std::byte*>(row.data()), size, {2, 2, 1}, reinterpret_cast<std::byte*>(out.data()),
         {1, 1, 1}, {0, 0, 0});
  return out[0];
}

TEST(ReduceTest, MeansAreRoundedHalvesAwayFromZero) {
  using Signed = std::vector<std::int16_t>;
  const auto mean = [](const Signed& row) { return One(SampleType::kInt16, Reduction::kMean, row); };
  EXPECT_EQ(mean({1, 2}), 2);
  EXPECT_EQ(mean({-1, -2}), -2);
  EXPECT_EQ(mean({1, 1, 1, 2}), 1);
  EXPECT_EQ(mean({-1, -1, -1, -2}), -1);
  EXPECT_EQ(mean({-1, -1, -2, -2}), -2);
  EXPECT_EQ(mean({32767, 32767, 32767, 32767}), 32767);
  EXPECT_EQ(mean({-32768, -32768, -32768, -32768}), -32768);
}

TEST(ReduceTest, MeansLeaveOutWhatIsNoNumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  using Floats = std::vector<float>;
  EXPECT_EQ(One(SampleType::kFloat32, Reduction::kMean, Floats{nan, 1, 2, nan}), 1.5F);
  EXPECT_TRUE(std::isnan(One(SampleType::kFloat32, Reduction::kMean, Floats{nan, nan, nan, nan})));
}

TEST(ReduceTest, TheMostFrequentLabelWinsAndOfSeveralTheSmallest) {
  using Labels = std::vector<std::uint8_t>;
  const auto label = [](const Labels& row) { return One(SampleType::kUint8, Reduction::kMostFrequent, row); };
  EXPECT_EQ(label({7, 3, 3, 9}), 3);
  EXPECT_EQ(label({7, 3, 3, 7}), 3);
  EXPECT_EQ(label({9, 7, 8, 6}), 6);
  EXPECT_EQ(label({5, 5, 5, 0}), 5);
  EXPECT_EQ(label({5, 5}), 5);
}

TEST(ReduceTest, SixtyFourBitsAreExact) {
  constexpr std::uint64_t kId = 12857642016;
  using Ids = std::vector<std::uint64_t>;
  EXPECT_EQ(One(SampleType::kUint64, Reduction::kMostFrequent, Ids{kId + 1, kId, kId + 1, 7}), kId + 1);
  EXPECT_EQ(One(SampleType::kUint64, Reduction::kMostFrequent, Ids{kId + 1, kId, kId + 1, kId}), kId);
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(One(SampleType::kUint64, Reduction::kMean, Ids{kMost, kMost, kMost, kMost - 4}), kMost - 1);
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(One(SampleType::kInt64, Reduction::kMean, std::vector<std::int64_t>{kLeast, kLeast, kLeast + 1, kLeast + 1}), kLeast);
  EXPECT_EQ(One(SampleType::kFloat64, Reduction::kMean, std::vector<double>{0.1, 0.3}), 0.2);
}

TEST(ReduceTest, TheLastVoxelsHoldWhatIsLeft) {
  const std::vector<std::uint8_t> from = {1, 3, 10};
  std::vector<std::uint8_t> to(6, 99);
  Reduce(SampleType::kUint8, Reduction::kMean, reinterpret_cast<const std::byte*>(from.data()), {3, 1, 1}, {2, 2, 2},
         reinterpret_cast<std::byte*>(to.data()), {3, 2, 1}, {1, 1, 0});
  EXPECT_EQ(to, (std::vector<std::uint8_t>{99, 99, 99, 99, 2, 10}));
}

}  // namespace
}  // namespace slabstream
