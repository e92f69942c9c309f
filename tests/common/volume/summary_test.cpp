#include "common/volume/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "common/volume/box_assembly.h"
#include "tests/support/random_box.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The definition, voxel by voxel.
VolumeSummary SummarizeByDefinition(const Volume& volume) {
  const Index3 size = volume.description.geometry.size;
  const auto value_at = [&](const Index3& v) {
    const double stored = VisitScalarType(volume.description.type,
                                          [&]<class T>(const T*) { return double(volume.block.samples<T>()[volume.block.Offset(v)]); });
    return std::isfinite(stored) ? float(volume.description.mapping.FromStored(stored)) : float(stored);
  };
  const auto range_of = [&](const Box& box, ValueRange if_empty) {
    ValueRange range = {kInfinity, -kInfinity};
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x) {
          const float value = value_at({x, y, z});
          if (std::isfinite(value)) range = {std::min(range.min, value), std::max(range.max, value)};
        }
      }
    }
    return range.min > range.max ? if_empty : range;
  };

  VolumeSummary summary;
  summary.description = volume.description;
  const Box bounds = volume.description.geometry.bounds();
  summary.range = range_of(bounds, {0, 0});
  const auto bricks = [](std::int32_t side) { return int(std::ceil(side / double(kBrick))); };
  summary.brick_counts = {bricks(size.x), bricks(size.y), bricks(size.z)};
  for (int z = 0; z < summary.brick_counts.z; ++z) {
    for (int y = 0; y < summary.brick_counts.y; ++y) {
      for (int x = 0; x < summary.brick_counts.x; ++x) {
        const Index3 begin = {x * kBrick, y * kBrick, z * kBrick};
        const Index3 end = {begin.x + kBrick, begin.y + kBrick, begin.z + kBrick};
        summary.bricks.push_back(range_of(Intersection({begin, end}, bounds), kNoFiniteValue));
      }
    }
  }
  for (std::int32_t z = 0; z < size.z; ++z) {
    for (std::int32_t y = 0; y < size.y; ++y) {
      for (std::int32_t x = 0; x < size.x; ++x) {
        const float value = value_at({x, y, z});
        if (std::isfinite(value)) {
          ++summary.histogram[std::size_t(HistogramBin(summary.range, value))];
        } else {
          ++summary.non_finite;
        }
      }
    }
  }
  return summary;
}

void ExpectEqual(const VolumeSummary& found, const VolumeSummary& expected) {
  EXPECT_EQ(found.range, expected.range);
  EXPECT_EQ(found.histogram, expected.histogram);
  EXPECT_EQ(found.brick_counts, expected.brick_counts);
  EXPECT_EQ(found.bricks, expected.bricks);
  EXPECT_EQ(found.non_finite, expected.non_finite);
  EXPECT_EQ(found, expected);
}

TEST(Summary, IsWhatItsDefinitionSaysForEveryTypeAndOddSizes) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    for (const Index3& size : {Index3{1, 1, 1}, Index3{16, 16, 16}, Index3{17, 1, 33}, Index3{15, 31, 2}, Index3{40, 19, 21}}) {
      for (const ValueMapping& mapping : {ValueMapping{}, ValueMapping{1, -32768}, ValueMapping{-0.25, 3}}) {
        SCOPED_TRACE(testing::Message() << "type " << int(type) << " size " << size.x << " " << size.y << " " << size.z << " scale "
                                        << mapping.scale);
        Volume volume = RandomVolume(random, size, type);
        volume.description.mapping = mapping;
        ExpectEqual(Summarize(volume), SummarizeByDefinition(volume));
      }
    }
  }
}

TEST(Summary, OfBricksHasThoseOfTheVolumeAndTheStatisticsOfTheSurvey) {
  Random random(63);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    Volume volume = RandomVolume(random, {50, 33, 20}, type);
    volume.description.mapping = {0.5, -100};
    const VolumeSummary whole = Summarize(volume);
    VolumeSummary surveyed = whole;
    surveyed.range = {-7, 7};
    surveyed.histogram.fill(3);
    const VolumeSummary of_bricks = SummaryOfBricks(volume, surveyed);
    EXPECT_EQ(of_bricks, WithStatistics(whole, surveyed));
  }
}

TEST(Summary, LeavesValuesOutThatAreNotFinite) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  const Volume volume = MakeTestVolume({37, 20, 18}, ScalarType::kFloat32, [&](const Index3& v) -> float {
    if (v.x < 16 && v.y < 16 && v.z < 16) return kNan;  // a brick without any finite value
    const int kind = random.Integer(0, 9);
    return kind == 0 ? kNan : kind == 1 ? kInfinity : kind == 2 ? -kInfinity : float(random.Real(-5, 5));
  });
  const VolumeSummary summary = Summarize(volume);
  ExpectEqual(summary, SummarizeByDefinition(volume));
  EXPECT_EQ(summary.bricks.front(), kNoFiniteValue);
  EXPECT_GT(summary.bricks.front().min, summary.bricks.front().max);
}

TEST(Summary, OfNothingFiniteHasAnEmptyHistogram) {
  const VolumeSummary summary = Summarize(MakeTestVolume({3, 3, 3}, ScalarType::kFloat32, [](const Index3&) { return kNan; }));
  EXPECT_EQ(summary.range, (ValueRange{0, 0}));
  EXPECT_EQ(summary.non_finite, 27);
  EXPECT_THAT(summary.histogram, testing::Each(0));
}

TEST(Summary, OfOneValueIsOneBin) {
  for (const ScalarType type : kTypes) {
    const VolumeSummary summary = Summarize(MakeTestVolume({5, 4, 3}, type, [](const Index3&) { return 7; }));
    EXPECT_EQ(summary.range, (ValueRange{7, 7}));
    EXPECT_EQ(summary.histogram.front(), 60U);
    EXPECT_EQ(std::accumulate(summary.histogram.begin(), summary.histogram.end(), std::uint64_t{0}), 60U);
  }
}

std::uint64_t Counted(const VolumeSummary& summary) {
  return std::accumulate(summary.histogram.begin(), summary.histogram.end(), std::uint64_t{0});
}

// A dark time with many voxels read, and a bright one with few: half of all values are dark.
TEST(OverTimes, GivesEachTimeTheSameWeight) {
  const VolumeSummary dark = Summarize(MakeTestVolume({64, 32, 32}, ScalarType::kUint16, [](const Index3& v) { return v.x % 10; }));
  const VolumeSummary bright = Summarize(MakeTestVolume({8, 8, 8}, ScalarType::kUint16, [](const Index3& v) { return 1000 + v.x; }));
  const VolumeSummary both = OverTimes(dark, std::vector{bright});
  EXPECT_EQ(both.range, (ValueRange{0, 1007}));
  EXPECT_EQ(both.times, 2);
  EXPECT_EQ(both.bricks, dark.bricks) << "bricks are those of its own time";
  EXPECT_NEAR(double(Counted(both)), double(Counted(dark)), 4);
  const std::uint64_t below =
      std::accumulate(both.histogram.begin(), both.histogram.begin() + HistogramBin(both.range, 500), std::uint64_t{0});
  EXPECT_NEAR(double(below), double(Counted(dark)) / 2, 2);
}

TEST(OverTimes, IsThatOfTheVolumeWhereTimesAreEqual) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    const VolumeSummary one = Summarize(RandomVolume(random, {20, 21, 22}, type));
    const VolumeSummary over = OverTimes(one, std::vector{one, one});
    EXPECT_EQ(over.range, one.range);
    for (int bin = 0; bin < kHistogramBins; ++bin) {
      EXPECT_NEAR(double(over.histogram.at(std::size_t(bin))), double(one.histogram.at(std::size_t(bin))), 1) << bin;
    }
  }
}

TEST(OverTimes, KeepsWhatIsRare) {
  const auto of = [](float first) {
    return Summarize(
        MakeTestVolume({2, 2, 2}, ScalarType::kUint8, [=](const Index3& v) { return first + float(v.x + 2 * v.y + 4 * v.z); }));
  };
  const VolumeSummary over = OverTimes(of(0), std::vector{of(80), of(200)});
  for (const int value : {0, 7, 80, 87, 200, 207}) EXPECT_GE(over.histogram.at(std::size_t(HistogramBin(over.range, value))), 1U) << value;
}

TEST(OverTimes, TakesTimesOfOneValueAndOfNone) {
  const auto of = [](float value) {
    return Summarize(MakeTestVolume({4, 4, 4}, ScalarType::kFloat32, [=](const Index3&) { return value; }));
  };
  const VolumeSummary over = OverTimes(of(kNan), std::vector{of(3), of(-5)});
  EXPECT_EQ(over.range, (ValueRange{-5, 3}));
  EXPECT_EQ(over.non_finite, 64) << "of its own time";
  EXPECT_EQ(over.histogram.front(), 32U);
  EXPECT_EQ(over.histogram.back(), 32U);
  EXPECT_EQ(OverTimes(of(kNan), std::vector{of(kNan)}).range, (ValueRange{0, 0}));
  EXPECT_EQ(OverTimes(of(3), {}), of(3));
}

TEST(HistogramBin, GivesUpTo256IntegersABinEach) {
  for (int last = 1; last < kHistogramBins; ++last) {
    int before = -1;
    for (int value = 0; value <= last; ++value) {
      const int bin = HistogramBin({-3.0F, float(last - 3)}, value - 3);
      EXPECT_GT(bin, before) << value << " of " << last;
      before = bin;
    }
    EXPECT_EQ(before, kHistogramBins - 1);
  }
}

TEST(HistogramBin, TakesTheWidestRangeOfFloats) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  EXPECT_EQ(HistogramBin({-kLargest, kLargest}, -kLargest), 0);
  EXPECT_EQ(HistogramBin({-kLargest, kLargest}, 0), kHistogramBins / 2);
  EXPECT_EQ(HistogramBin({-kLargest, kLargest}, kLargest), kHistogramBins - 1);
}

// ---------------------------------------------------------------- piece by piece

// Boxes of whole bricks that tile the volume, in any order.
std::vector<Box> RandomPieces(Random& random, const Box& bounds) {
  Index3 side;
  for (const Axis axis : kAxes) side[axis] = kBrick * random.Integer(1, 3);
  std::vector<Box> pieces = CutAtBlocks(bounds, side);
  for (std::size_t i = 0; i < pieces.size(); ++i) std::swap(pieces[i], pieces[random.Integer(i, pieces.size() - 1)]);
  return pieces;
}

TEST(PiecewiseSummaryTest, OfAnyPiecesIsThatOfTheWhole) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const ScalarType type = kTypes[random.Integer<std::size_t>(0, 2)];
    Volume volume = RandomVolume(random, {random.Integer(1, 70), random.Integer(1, 70), random.Integer(1, 40)}, type);
    volume.description.mapping = {random.Real(-3, 3), random.Real(-100, 100)};
    if (type == ScalarType::kFloat32) {
      const auto samples = std::span(volume.block.samples<float>(), std::size_t(volume.block.box.voxel_count()));
      for (float& sample : samples) sample = random.Chance(0.01) ? kNan : sample;
    }
    const std::vector<Box> boxes = RandomPieces(random, volume.block.box);
    PiecewiseSummary pieces(volume.description);
    for (const Box& box : boxes) {
      if (random.Chance(0.5)) {
        pieces.Add(CutBlock(volume.block, box));
      } else {
        pieces.Add(volume.block, box);
      }
    }
    if (pieces.EndOfPieces()) {
      for (const Box& box : boxes) pieces.AddAgain(CutBlock(volume.block, box));
    }
    ExpectEqual(pieces.Take(), Summarize(volume));
  }
}

TEST(PiecewiseSummaryTest, BricksOutsideAllPiecesHaveAnyValue) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    const Volume volume = RandomVolume(random, {40, 20, 20}, type);
    const Box piece = {{16, 0, 0}, {32, 16, 16}};  // brick 1 alone
    PiecewiseSummary pieces(volume.description);
    pieces.Add(CutBlock(volume.block, piece));
    if (pieces.EndOfPieces()) pieces.AddAgain(CutBlock(volume.block, piece));
    const VolumeSummary some = pieces.Take(), all = Summarize(volume);
    const ValueRange any = AnyValue(volume.description);
    for (std::size_t brick = 0; brick < some.bricks.size(); ++brick) {
      EXPECT_EQ(some.bricks[brick], brick == 1 ? all.bricks[1] : any);
      EXPECT_LE(any.min, all.bricks[brick].min);
      EXPECT_GE(any.max, all.bricks[brick].max);
    }
    EXPECT_EQ(some.range, all.bricks[1]);
    EXPECT_EQ(std::accumulate(some.histogram.begin(), some.histogram.end(), std::uint64_t{0}), std::uint64_t(piece.voxel_count()));
  }
}

TEST(PiecewiseSummaryTest, SamplesCountForRangeAndHistogramAlone) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    const Volume volume = RandomVolume(random, {40, 30, 20}, type);
    const Box box = RandomBox(random, volume.block.box);
    const VoxelBlock sample = CutBlock(volume.block, box);
    PiecewiseSummary pieces(volume.description);
    pieces.AddSample(sample);
    if (pieces.EndOfPieces()) pieces.AddAgain(sample);
    const VolumeSummary of_sample = pieces.Take();
    Volume alone;
    alone.description = {{box.size()}, type};
    alone.block = sample;
    alone.block.box = {{0, 0, 0}, box.size()};
    const VolumeSummary expected = Summarize(alone);
    EXPECT_EQ(of_sample.range, expected.range);
    EXPECT_EQ(of_sample.histogram, expected.histogram);
    EXPECT_THAT(of_sample.bricks, testing::Each(AnyValue(volume.description)));
  }
}

}  // namespace
}  // namespace slabstream
