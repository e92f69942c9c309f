#include "common/classification/classification_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/random_transfer.h"

namespace slabstream {
namespace {

// 0 for values below `edge`, 1 from there on.
TransferFunction StepAt(double edge) { return {{{0, {1, 1, 1}}}, {{edge - 1, 0}, {edge, 0}, {edge, 1}}}; }

VolumeDescription Description(ScalarType type, ValueMapping mapping = {}) { return {{{8, 8, 8}, {1, 1, 1}}, type, mapping}; }

TEST(ClassificationTable, HoldsTheTransferFunctionAtEveryStoredInteger) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 60; ++i) {
    const TransferFunction transfer = RandomTransfer(random);
    const bool bytes = random.Chance(0.5);
    const ValueMapping mapping = {random.Chance(0.3) ? -0.1 : 0.037, random.Real(-50, 50)};
    const int first = bytes ? 0 : random.Integer(0, 60000), last = bytes ? 255 : first + random.Integer(0, kMaxBins - 1);
    const auto a = float(mapping.FromStored(first)), b = float(mapping.FromStored(last));
    const ClassificationTable table =
        Classify(transfer, Description(bytes ? ScalarType::kUint8 : ScalarType::kUint16, mapping), {std::min(a, b), std::max(a, b)});
    ASSERT_LE(table.size(), last - first + 1);
    EXPECT_EQ(table.bin_from_stored_scale, 1);
    EXPECT_EQ(table.opacity_distance, transfer.opacity_distance);
    for (int stored = first; stored <= last; ++stored) {
      const int bin = table.BinOf(stored);
      ASSERT_EQ(bin, std::clamp(stored - int(table.stored_origin), 0, table.size() - 1));
      EXPECT_EQ(table.opacity[std::size_t(bin)], float(transfer.Opacity(mapping.FromStored(stored))));
      EXPECT_EQ(table.color[std::size_t(bin)], transfer.Color(mapping.FromStored(stored)));
    }
    EXPECT_EQ(table.max_opacity, *std::max_element(table.opacity.begin(), table.opacity.end()));
  }
}

TEST(ClassificationTable, EightBitVolumesHaveTheSameBinsWhateverTheirRange) {
  const ClassificationTable table = Classify(StepAt(100), Description(ScalarType::kUint8), {40, 90});
  EXPECT_EQ(table.size(), 256);
  EXPECT_EQ(table.BinOf(200), 200);
}

TEST(ClassificationTable, OfFloatsTakesTheNearestCentre) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 20; ++i) {
    const TransferFunction transfer = RandomTransfer(random);
    const ClassificationTable table = Classify(transfer, Description(ScalarType::kFloat32), {-3, 97});
    ASSERT_EQ(table.size(), kMaxBins);
    const double width = 1 / table.bin_from_stored_scale, first = table.stored_origin, last = first + (kMaxBins - 1) * width;
    EXPECT_TRUE(first >= -3 && last <= 97 + 1e-9);
    for (int sample = 0; sample < 500; ++sample) {
      const double stored = random.Real(-3, 97);
      const int bin = table.BinOf(stored);
      const double centre = first + bin * width;
      EXPECT_LE(std::abs(std::clamp(stored, first, last) - centre), width / 2 + 1e-9);
      EXPECT_LE(std::abs(table.value[std::size_t(bin)] - centre), width / 2 + 1e-9);
      EXPECT_EQ(table.opacity[std::size_t(bin)], float(transfer.Opacity(table.value[std::size_t(bin)])));
    }
  }
}

// One voxel far away from the others, such as a hot pixel or a fill value, takes no bin from them.
TEST(ClassificationTable, CoversWhatTheFunctionTellsApart) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    const TransferFunction transfer = RandomTransfer(random);
    const auto [first, last] = NodesOf(transfer);
    const bool mapped = random.Chance(0.5);
    const VolumeDescription description = Description(ScalarType::kFloat32, {mapped ? -0.5 : 1, mapped ? 20.0 : 0});
    const ClassificationTable narrow = Classify(transfer, description, {float(first) - 10, float(last) + 10});
    for (const ValueRange& wide : {ValueRange{float(first) - 10, 9.96921e36F}, ValueRange{-3e38F, 3e38F}}) {
      const ClassificationTable table = Classify(transfer, description, wide);
      EXPECT_EQ(table.opacity, narrow.opacity);
      EXPECT_EQ(table.color, narrow.color);
      EXPECT_EQ(table.stored_origin, narrow.stored_origin);
      EXPECT_EQ(table.bin_from_stored_scale, narrow.bin_from_stored_scale);
      for (const double value : {-1e38, first - 1, last + 1, 1e38}) {
        const double stored = (value - description.mapping.offset) / description.mapping.scale;
        EXPECT_EQ(table.opacity[std::size_t(table.BinOf(stored))], float(transfer.Opacity(value)));
      }
    }
  }
  // Each value of 16 bits between the points has its own bin, although all of them have not.
  const TransferFunction ramp{{{1000, {1, 1, 1}}}, {{1000, 0}, {3000, 1}}};
  const ClassificationTable table = Classify(ramp, Description(ScalarType::kUint16), {0, 65535});
  EXPECT_EQ(table.bin_from_stored_scale, 1);
  for (int value : {0, 999, 1000, 1001, 2999, 3000, 3001, 65535}) {
    EXPECT_EQ(table.opacity[std::size_t(table.BinOf(value))], float(ramp.Opacity(value))) << value;
  }
}

TEST(ClassificationTable, AStepStandsWhereTheFunctionHasIt) {
  for (const double edge : {0.0, 5.0, 1e-20, -3e6, 1e30}) {
    const TransferFunction step{{{edge, {1, 1, 1}}}, {{edge, 0}, {edge, 1}}};
    const ClassificationTable table = Classify(step, Description(ScalarType::kFloat32), {-3e38F, 3e38F});
    const double near = std::max(std::abs(edge) * 0x1p-19, 1e-37);
    EXPECT_EQ(table.opacity[std::size_t(table.BinOf(edge - near))], 0) << edge;
    EXPECT_EQ(table.opacity[std::size_t(table.BinOf(edge))], 1) << edge;
    EXPECT_EQ(table.opacity[std::size_t(table.BinOf(edge + near))], 1) << edge;
  }
}

TEST(ClassificationTable, KeepsABackgroundAtTheFootOfARampEmpty) {
  const ClassificationTable table = Classify({{{0, {1, 1, 1}}}, {{0, 0}, {5, 1}}}, Description(ScalarType::kFloat32), {0, 5});
  EXPECT_EQ(table.opacity[std::size_t(table.BinOf(0))], 0);
  EXPECT_EQ(table.opacity[std::size_t(table.BinOf(5))], 1);
}

TEST(ClassificationTable, OfOneValueIsOneBin) {
  for (const ScalarType type : {ScalarType::kUint16, ScalarType::kFloat32}) {
    const ClassificationTable table = Classify(StepAt(3), Description(type), {7, 7});
    EXPECT_EQ(table.size(), 1);
    EXPECT_EQ(table.max_opacity, 1);
    EXPECT_EQ(table.BinOf(7), 0);
    EXPECT_EQ(table.BinOf(-1e30), 0);
    EXPECT_EQ(table.BinOf(1e30), 0);
  }
}

TEST(ClassificationTable, TakesTheWidestRangeOfFloats) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  const ClassificationTable table = Classify(StepAt(0), Description(ScalarType::kFloat32), {-kLargest, kLargest});
  EXPECT_EQ(table.opacity[std::size_t(table.BinOf(-1e38))], 0);
  EXPECT_EQ(table.opacity[std::size_t(table.BinOf(1e38))], 1);
}

// What lets a planner leave a brick out without changing the picture: no sample of it may get an opacity from the table.
TEST(MaxOpacityOfTable, IsExactlyTheLargestThatAnySampleOfABrickGets) {
  Random random(6);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    for (int i = 0; i < 200; ++i) {
      const bool mapped = random.Chance(0.5);
      const ValueMapping mapping = mapped ? ValueMapping{random.Chance(0.3) ? -0.3 : 0.011, random.Real(-90, 90)} : ValueMapping{};
      const VolumeDescription description = Description(type, mapping);
      const double first = type == ScalarType::kFloat32 ? -100 : 0, last = type == ScalarType::kUint8 ? 255 : 9000;
      const auto data = [&](double a, double b) {
        const auto x = float(mapping.FromStored(a)), y = float(mapping.FromStored(b));
        return ValueRange{std::min(x, y), std::max(x, y)};
      };
      const ClassificationTable table = Classify(RandomTransfer(random), description, data(first, last));

      float expected = 0;
      double low = last, high = first;
      for (int sample = 0; sample < 8; ++sample) {
        double stored = random.Real(first, last);
        stored = type == ScalarType::kFloat32 ? double(float(stored)) : std::floor(stored);
        low = std::min(low, stored);
        high = std::max(high, stored);
      }
      for (int bin = table.BinOf(low); bin <= table.BinOf(high); ++bin) expected = std::max(expected, table.opacity[std::size_t(bin)]);
      const float found = MaxOpacity(table, description, data(low, high));
      if (type == ScalarType::kFloat32 && mapped) {
        EXPECT_GE(found, expected);
      } else {
        EXPECT_EQ(found, expected);
      }
    }
  }
  const ClassificationTable opaque = Classify({{{0, {1, 1, 1}}}, {{0, 1}}}, Description(ScalarType::kFloat32), {0, 1});
  EXPECT_EQ(MaxOpacity(opaque, Description(ScalarType::kFloat32), kNoFiniteValue), 0);
}

}  // namespace
}  // namespace slabstream
