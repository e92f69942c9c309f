#include "common/planning/brick_visibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/common/planning/support.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// A volume of noise around a level, so that bricks differ, with some samples that are not finite.
Volume NoiseVolume(Random& random, ScalarType type, ValueMapping mapping) {
  Volume volume;
  volume.description = {{{40, 23, 37}, {1, 1, 1}}, type, mapping};
  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), type);
  const Index3 size = volume.description.geometry.size;
  const double low = random.Real(0, 100), high = low + random.Real(0.5, 150);
  VisitScalarType(type, [&](auto* null) {
    using T = std::remove_cvref_t<decltype(*null)>;
    T* samples = volume.block.samples<T>();
    for (std::int32_t z = 0; z < size.z; ++z) {
      for (std::int32_t y = 0; y < size.y; ++y) {
        for (std::int32_t x = 0; x < size.x; ++x) {
          const double level = low + (high - low) * (0.5 + 0.5 * std::sin(0.1 * x + 0.13 * y - 0.07 * z));
          samples[volume.block.Offset({x, y, z})] = T(level + random.Real(0, 2));
        }
      }
    }
    if constexpr (std::is_same_v<T, float>) samples[0] = std::numeric_limits<float>::quiet_NaN();
  });
  return volume;
}

// Exactly what renderers draw: voxels whose bin has an opacity above zero.
bool AnyVoxelVisible(const Volume& volume, const ClassificationTable& table, const Box& box) {
  bool visible = false;
  VisitScalarType(volume.description.type, [&](auto* null) {
    using T = std::remove_cvref_t<decltype(*null)>;
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x) {
          const auto sample = double(volume.block.samples<T>()[volume.block.Offset({x, y, z})]);
          visible |= std::isfinite(sample) && table.opacity[std::size_t(table.BinOf(sample))] > 0;
        }
      }
    }
  });
  return visible;
}

Box BoxOfBrick(const VolumeSummary& summary, std::size_t brick) {
  const auto nx = std::size_t(summary.brick_counts.x), ny = std::size_t(summary.brick_counts.y);
  const Index3 begin = {std::int32_t(brick % nx) * kBrick, std::int32_t(brick / nx % ny) * kBrick, std::int32_t(brick / nx / ny) * kBrick};
  return Intersection({begin, {begin.x + kBrick, begin.y + kBrick, begin.z + kBrick}}, summary.description.geometry.bounds());
}

TEST(BrickVisibility, NeverCallsAVisibleVoxelEmpty) {
  Random random(101);
  SCOPED_TRACE(random.trace());
  int empty = 0, visible = 0;
  for (ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    for (const ValueMapping& mapping : {ValueMapping{1, 0}, ValueMapping{0.1, -1024}, ValueMapping{-3, 1e6}, ValueMapping{1e-6, 5}}) {
      for (int i = 0; i < 10; ++i) {
        const Volume volume = NoiseVolume(random, type, mapping);
        const VolumeSummary summary = Summarize(volume);
        // A curve that begins within a bin of some brick's largest value: where rounding shows.
        const double width = double(summary.range.max) - double(summary.range.min);
        const std::size_t chosen = random.Integer<std::size_t>(0, summary.bricks.size() - 1);
        const double start = double(summary.bricks[chosen].max) + random.Real(-1, 1) * width / kMaxBins;
        TransferFunction transfer;
        transfer.colors = {{0, {1, 1, 1}}};
        transfer.opacities = {{start, 0}, {start + 0.5 * width, 1e-3}, {start + width, 0}};
        const BrickVisibility bricks(summary, Classify(transfer, summary.description, summary.range));
        const ClassificationTable table = Classify(transfer, summary.description, summary.range);
        for (int k = 0; k < 20; ++k) {
          Box box = BoxOfBrick(summary, chosen);
          if (k > 0) {
            for (int axis = 0; axis < 3; ++axis) {
              box.begin[axis] = random.Integer(0, summary.description.geometry.size[axis] - 1);
              box.end[axis] = std::min(box.begin[axis] + random.Integer(1, 12), summary.description.geometry.size[axis]);
            }
          }
          const bool any = bricks.AnyVisible(box);
          ++(any ? visible : empty);
          if (!any) {
            EXPECT_FALSE(AnyVoxelVisible(volume, table, box));
          }
        }
      }
    }
  }
  EXPECT_GT(empty, 20);  // it does call boxes empty
  EXPECT_GT(visible, 20);
}

// What surrounds a body often has the value below the first visible one.
TEST(BrickVisibility, CallsABackgroundInTheBinBelowTheFirstVisibleOneEmpty) {
  VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0}, {255, 0.5}};
  for (const float value : {0.0F, 1.0F}) {
    summary.bricks = {{value, value}};
    const BrickVisibility bricks(summary, Classify(transfer, summary.description, summary.range));
    EXPECT_EQ(bricks.AnyVisible(summary.description.geometry.bounds()), value > 0);
  }
}

TEST(BrickVisibility, LooksAtEveryBrickThatTheBoxTouches) {
  const TransferFunction transfer = std::get<TransferFunction>(SomeRequest().transfer.choice);
  for (const Index3& bright : {Index3{0, 0, 0}, Index3{2, 1, 0}, Index3{1, 1, 2}}) {
    VolumeSummary summary = FullSummary({40, 32, 33});  // 3 x 2 x 3 bricks
    for (ValueRange& brick : summary.bricks) brick = {0, 50};
    summary.bricks[std::size_t((bright.z * 2 + bright.y) * 3 + bright.x)] = {0, 150};
    const BrickVisibility bricks(summary, Classify(transfer, summary.description, summary.range));
    for (std::int32_t z = 0; z < 33; z += 4) {
      for (std::int32_t y = 0; y < 32; y += 3) {
        for (std::int32_t x = 0; x < 40; x += 3) {
          const Index3 brick = {x / kBrick, y / kBrick, z / kBrick};
          EXPECT_EQ(bricks.AnyVisible({{x, y, z}, {x + 1, y + 1, z + 1}}), brick == bright);
        }
      }
    }
    EXPECT_TRUE(bricks.AnyVisible(summary.description.geometry.bounds()));
  }
}

TEST(BrickVisibility, ConstantMappingAndBricksWithoutFiniteValues) {
  const TransferFunction transfer = std::get<TransferFunction>(SomeRequest().transfer.choice);
  VolumeSummary summary = FullSummary({16, 16, 16});
  summary.bricks = {kNoFiniteValue};
  EXPECT_FALSE(
      BrickVisibility(summary, Classify(transfer, summary.description, summary.range)).AnyVisible(summary.description.geometry.bounds()));
  for (float value : {50.0F, 150.0F}) {  // every sample means the same value
    summary.description.mapping = {0, double(value)};
    summary.range = {value, value};
    summary.bricks = {summary.range};
    EXPECT_EQ(
        BrickVisibility(summary, Classify(transfer, summary.description, summary.range)).AnyVisible(summary.description.geometry.bounds()),
        value > 100);
  }
}

}  // namespace
}  // namespace slabstream
