// Values and slopes against analytic volumes.
#include "coordinator/probe/joint_histogram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

Result<JointHistogram> CountIn(const Volume& volume, ValueRange range) {
  return CountJointly(volume.description, range, [&](const Box& box) {
    VoxelBlock block = MakeVoxelBlock(box, volume.block.type);
    VoxelBricks(volume.block).Read(box, 0, block.bytes);
    return Result<VoxelBlock>(std::move(block));
  });
}

std::uint64_t Total(const JointHistogram& histogram) {
  return std::accumulate(histogram.counts.begin(), histogram.counts.end(), std::uint64_t{0});
}

TEST(JointHistogram, OfARampHasOneSlope) {
  Volume volume = MakeVolume({{40, 20, 10}, {0.5, 1, 2}}, ScalarType::kUint16, [](const Index3& v) { return 7 * v.x; });
  volume.description.mapping = {-2, 100};
  const JointHistogram found = CountIn(volume, {100 - 2 * 7 * 39, 100}).value();
  EXPECT_DOUBLE_EQ(found.steepest, 7 * 2 / 0.5);
  EXPECT_EQ(Total(found), 38 * 18 * 8) << "the outermost voxels do not count";
  for (int value = 0; value < kJointValues; ++value) {
    for (int slope = 0; slope + 1 < kJointSlopes; ++slope) EXPECT_EQ(found.counts[std::size_t(value * kJointSlopes + slope)], 0);
  }
}

// On either side of a step there is half of it in the differences of two voxels.
TEST(JointHistogram, OfAStepHasBothSidesAndWhatIsFlat) {
  const Volume volume = MakeVolume({{20, 9, 9}}, ScalarType::kUint8, [](const Index3& v) { return v.x < 10 ? 0 : 200; });
  const JointHistogram found = CountIn(volume, {0, 200}).value();
  EXPECT_DOUBLE_EQ(found.steepest, 100);
  const auto at = [&](int value, int slope) { return found.counts[std::size_t(value * kJointSlopes + slope)]; };
  const int last = kJointValues - 1, steep = kJointSlopes - 1;
  EXPECT_EQ(at(0, 0), 8 * 7 * 7);
  EXPECT_EQ(at(last, 0), 8 * 7 * 7);
  EXPECT_EQ(at(0, steep), 7 * 7);
  EXPECT_EQ(at(last, steep), 7 * 7);
}

TEST(JointHistogram, OfALargeVolumeCountsAPartOfIt) {
  const Volume volume = MakeVolume({{300, 200, 160}}, ScalarType::kUint8, [](const Index3& v) { return (v.x + v.y + v.z) % 256; });
  const std::uint64_t counted = Total(CountIn(volume, {0, 255}).value());
  EXPECT_GT(counted, 1'000'000);
  EXPECT_LE(counted, 64 * 32 * 32 * 32);
}

TEST(JointHistogram, LeavesOutWhatIsNotFinite) {
  const Volume volume = MakeVolume({{9, 9, 9}}, ScalarType::kFloat32, [](const Index3& v) {
    return v == Index3{4, 4, 4} ? std::numeric_limits<double>::quiet_NaN() : double(v.z);
  });
  EXPECT_EQ(Total(CountIn(volume, {0, 8}).value()), 7 * 7 * 7 - 7) << "the voxel and its six neighbours";
}

TEST(JointHistogram, OfThinOrEvenVolumesIsThere) {
  EXPECT_EQ(Total(CountIn(MakeBlock({{5, 5, 1}}), {0, 255}).value()), 0);
  const JointHistogram even = CountIn(MakeBlock({{5, 5, 5}}), {100, 100}).value();
  EXPECT_EQ(even.steepest, 0);
  EXPECT_EQ(even.counts[0], 27);
}

TEST(JointHistogram, EndsWithTheErrorOfReading) {
  const Volume volume = MakeBlock({{40, 40, 40}});
  const Result<JointHistogram> found =
      CountJointly(volume.description, {0, 1}, [](const Box&) { return Result<VoxelBlock>(Status::DataLoss("gone")); });
  EXPECT_EQ(found.status().message(), "gone");
}

}  // namespace
}  // namespace slabstream
