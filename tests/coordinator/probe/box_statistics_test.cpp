// Statistics of boxes against sums over all voxels.
#include "coordinator/probe/box_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Of the voxels whose centres `lies` accepts, by two passes in data values.
BoxStatistics Expected(const Volume& volume, const std::function<float(const Index3&)>& value,
                       const std::function<bool(const Vec3&)>& lies) {
  BoxStatistics expected{.least = std::numeric_limits<double>::infinity(), .largest = -std::numeric_limits<double>::infinity()};
  const VolumeGeometry& geometry = volume.description.geometry;
  std::vector<double> values;
  for (std::size_t number = 0; number < CountIn(geometry.size); ++number) {
    const Index3 voxel = PlaceIn(geometry.size, number);
    if (!lies(geometry.ToWorld(ToVec3(voxel)))) continue;
    const double data = volume.description.mapping.FromStored(value(voxel));
    if (std::isfinite(data)) {
      values.push_back(data);
    } else {
      ++expected.non_finite;
    }
  }
  expected.voxels = values.size();
  for (const double each : values) {
    expected.mean += each / double(values.size());
    expected.least = std::min(expected.least, each);
    expected.largest = std::max(expected.largest, each);
  }
  for (const double each : values) expected.deviation += (each - expected.mean) * (each - expected.mean) / double(values.size());
  expected.deviation = std::sqrt(expected.deviation);
  return expected;
}

void ExpectNear(const BoxStatistics& found, const BoxStatistics& expected) {
  EXPECT_EQ(found.voxels, expected.voxels);
  EXPECT_EQ(found.non_finite, expected.non_finite);
  EXPECT_NEAR(found.mean, expected.mean, 1e-9 * std::max(1.0, std::abs(expected.mean)));
  EXPECT_NEAR(found.deviation, expected.deviation, 1e-9 * std::max(1.0, expected.deviation));
  EXPECT_EQ(found.least, expected.least);
  EXPECT_EQ(found.largest, expected.largest);
}

constexpr ClipBox kEverything = {{-1e300, -1e300, -1e300}, {1e300, 1e300, 1e300}};

bool Within(const Vec3& p, const Vec3& low, const Vec3& high) {
  for (int i = 0; i < 3; ++i) {
    if (p[i] < low[i] - 1e-9 || p[i] > high[i] + 1e-9) return false;
  }
  return true;
}

float Rough(const Index3& v) { return float((v.x * 7 + v.y * 13 + v.z * 29) % 97); }

TEST(BoxStatistics, AreThoseOfTheVoxelsWhoseCentresLieInTheBoxOrOnItsSides) {
  VolumeGeometry geometry{{37, 21, 18}, {0.5, 1, 2}};
  geometry.orientation.world = World::kPatient;
  geometry.orientation.origin = {-3, 4, 10};
  Volume volume = MakeVolume(geometry, ScalarType::kUint16, Rough);
  volume.description.mapping = {-2, 100};  // falls: the least stored value is the largest
  for (const auto& [low, high] : {std::pair(Vec3{-3, 4, 10}, Vec3{0, 10, 20}), std::pair(Vec3{-1.2, 5.5, 11}, Vec3{2.1, 9.5, 40}),
                                  std::pair(Vec3{-100, -100, -100}, Vec3{100, 100, 100})}) {
    const Result<BoxStatistics> found = StatisticsIn({volume.block, volume.description}, {low, high});
    ASSERT_TRUE(found.ok()) << found.status().message();
    ExpectNear(*found, Expected(volume, Rough, [&](const Vec3& p) { return Within(p, low, high); }));
    const BrickedVoxels bricks(volume.block);
    EXPECT_EQ(*StatisticsIn({bricks, volume.description}, {low, high}), *found) << "it does not matter how voxels are stored";
  }
}

TEST(BoxStatistics, BoxesLieAlongTheWorldWhereVolumesDoNot) {
  VolumeGeometry geometry{{20, 22, 24}, {1, 1.5, 0.8}};
  const double c = std::cos(std::numbers::pi / 7), s = std::sin(std::numbers::pi / 7);
  geometry.orientation = {World::kScene, {5, -6, 7}, {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}};
  const Volume volume = MakeVolume(geometry, ScalarType::kFloat32, Rough);
  const Vec3 low = {-2.03, 1.01, 10.05}, high = {9.07, 17.02, 20.01};
  const Result<BoxStatistics> found = StatisticsIn({volume.block, volume.description}, {low, high});
  ASSERT_TRUE(found.ok());
  ASSERT_GT(found->voxels, 100U);
  ExpectNear(*found, Expected(volume, Rough, [&](const Vec3& p) { return Within(p, low, high); }));
}

TEST(BoxStatistics, ValuesThatAreNotFiniteAreCountedApart) {
  const auto value = [](const Index3& v) { return v.x == 3 ? std::numeric_limits<float>::quiet_NaN() : v.y == 2 ? -INFINITY : Rough(v); };
  const Volume volume = MakeVolume({{8, 8, 8}}, ScalarType::kFloat32, value);
  const Result<BoxStatistics> found = StatisticsIn({volume.block, volume.description}, {{0, 0, 0}, {7, 7, 7}});
  ASSERT_TRUE(found.ok());
  ExpectNear(*found, Expected(volume, value, [](const Vec3&) { return true; }));
  EXPECT_EQ(found->non_finite, 8U * 8 + 7 * 8);
}

// As sums of squares would have it, the deviation would be 0 or not a number.
TEST(BoxStatistics, SmallDifferencesOfLargeValuesAreKept) {
  const Volume volume = MakeVolume({{64, 64, 4}}, ScalarType::kFloat32, [](const Index3& v) { return 16777214.0F + float(v.x % 2); });
  EXPECT_DOUBLE_EQ(StatisticsIn({volume.block, volume.description}, {{0, 0, 0}, {63, 63, 3}})->deviation, 0.5);
}

// As floats have them, they would be 16777216, and their mean would depend on the order of sums.
TEST(BoxStatistics, WholeNumbersAreExact) {
  const Volume volume = MakeVolume({{20, 20, 20}}, ScalarType::kFloat32, [](const Index3&) { return 16777216.0F; });
  std::vector<std::int32_t> numbers(20 * 20 * 20, 16777217);
  numbers[0] = 3;
  const MeasuredVolume measured{volume.block, volume.description, WholeNumbers{std::span<const std::int32_t>(numbers)}};
  const Result<BoxStatistics> found = StatisticsIn(measured, kEverything);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->least, 3);
  EXPECT_EQ(found->largest, 16777217);
  EXPECT_EQ(found->mean, (16777217.0 * 7999 + 3) / 8000);
}

// A part of a spacing, however small that is.
TEST(BoxStatistics, VoxelsBesideABoxOfASmallWorldDoNotCount) {
  const Volume volume = MakeVolume({{8, 8, 8}, {1e-10, 1e-10, 1e-10}}, ScalarType::kUint8, Rough);
  EXPECT_EQ(StatisticsIn({volume.block, volume.description}, {{0, 0, 0}, {3.4e-10, 1, 1}})->voxels, 4U * 8 * 8);
}

TEST(LabelStatistics, AreThoseOfTheVoxelsOfEachLabel) {
  const auto label = [](const Index3& v) { return (v.x / 5 + v.y / 3 + v.z) % 4; };
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
    Volume volume = MakeVolume({{37, 21, 18}}, type, Rough);
    volume.description.mapping = {-2, 100};
    constexpr std::uint64_t kFirst = 0xFFFFFFFFFF000000;  // beside each other, where double cannot tell them apart
    const ReadLabels labels = [&](const Index3& first, std::span<std::uint64_t> row) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        const int of = label(first + Index3{std::int32_t(i), 0, 0});
        row[i] = of == 0 ? 0 : kFirst + std::uint64_t(of);
      }
    };
    const ClipBox boxes[] = {kEverything, {{3, 2, 1}, {30, 9, 17}}};
    for (const ClipBox& box : boxes) {
      const auto found = StatisticsByLabel({volume.block, volume.description}, box, labels);
      ASSERT_TRUE(found.ok()) << found.status().message();
      ASSERT_EQ(found->size(), 3U);
      for (int number = 1; number <= 3; ++number) {
        const auto lies = [&](const Vec3& p) {
          return Within(p, box.low, box.high) && label({std::int32_t(p.x), std::int32_t(p.y), std::int32_t(p.z)}) == number;
        };
        ExpectNear(found->at(kFirst + std::uint64_t(number)), Expected(volume, Rough, lies));
      }
    }
  }
}

TEST(LabelStatistics, ValuesThatAreNotFiniteAreCountedApart) {
  const auto value = [](const Index3& v) { return v.x == 3 ? std::numeric_limits<float>::quiet_NaN() : Rough(v); };
  const Volume volume = MakeVolume({{8, 8, 8}}, ScalarType::kFloat32, value);
  const ReadLabels labels = [](const Index3& first, std::span<std::uint64_t> row) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = std::size_t(first.x) + i < 4 ? 1 : 0;
  };
  const auto found = StatisticsByLabel({volume.block, volume.description}, kEverything, labels);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->size(), 1U);
  ExpectNear(found->at(1), Expected(volume, value, [](const Vec3& p) { return p.x < 4; }));
  EXPECT_EQ(found->at(1).non_finite, 64U);
}

TEST(LabelStatistics, MoreLabelsThanAreToldAreRefused) {
  const Volume volume = MakeVolume({{17, 16, 16}}, ScalarType::kUint8, Rough);
  const ReadLabels labels = [](const Index3& first, std::span<std::uint64_t> row) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = 1 + std::uint64_t(first.z * 16 + first.y) * 17 + std::uint64_t(first.x) + i;
  };
  const auto found = StatisticsByLabel({volume.block, volume.description}, kEverything, labels);
  EXPECT_EQ(found.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(StatisticsByLabel({volume.block, volume.description}, {{0, 0, 0}, {3, 3, 3}}, labels)->size(), 64U);
}

TEST(BoxStatistics, NothingLiesBesideTheVolume) {
  const Volume volume = MakeVolume({{4, 4, 4}}, ScalarType::kUint8, Rough);
  EXPECT_EQ(*StatisticsIn({volume.block, volume.description}, {{10, 0, 0}, {12, 3, 3}}), BoxStatistics());
  EXPECT_EQ(*StatisticsIn({volume.block, volume.description}, {{0.2, 0, 0}, {0.8, 3, 3}}), BoxStatistics()) << "between two slices";
  EXPECT_EQ(StatisticsIn({volume.block, volume.description}, {{0, 0, 0}, {50, 100, 100}, ClipUnit::kPercent})->voxels, 2U * 4 * 4);
  EXPECT_EQ(StatisticsIn({volume.block, volume.description}, {{1, 1, 1}, {3, 2, 4}, ClipUnit::kVoxels})->voxels, 2U * 1 * 3);
}

}  // namespace
}  // namespace slabstream
