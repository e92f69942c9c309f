#include "common/classification/count_occupied.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/common/classification/occupied_grid.h"
#include "tests/support/random.h"
#include "tests/support/random_transfer.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

OccupancyGrid CountOneByOne(const Volume& volume, const ClassificationTable& table) {
  const Index3 size = volume.description.geometry.size;
  std::vector<bool> occupied(CountIn(size));
  VisitScalarType(volume.block.type, [&]<class T>(const T*) {
    for (std::size_t i = 0; i < occupied.size(); ++i) {
      const auto sample = double(volume.block.samples<T>()[volume.block.Offset(PlaceIn(size, i))]);
      occupied[i] = std::isfinite(sample) && table.opacity[std::size_t(table.BinOf(sample))] != 0;
    }
  });
  return GridOf(size, occupied);
}

TEST(CountOccupied, CountsWhatTheTableShows) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 60; ++i) {
    const Index3 size = {random.Integer(1, 50), random.Integer(1, 50), random.Integer(1, 50)};
    const auto type = ScalarType(random.Integer(1, 3));
    // Stretches of one value, noise between them.
    Volume volume = MakeTestVolume(
        size, type, [&](const Index3& v) -> double { return (v.x / 20 + v.y / 17 + v.z / 16) % 2 == 0 ? 60 : random.Integer(0, 100); });
    if (type == ScalarType::kFloat32) {
      volume.block.samples<float>()[0] = std::numeric_limits<float>::quiet_NaN();
      volume.block.samples<float>()[std::size_t(volume.block.box.voxel_count()) - 1] = std::numeric_limits<float>::infinity();
    }
    const VolumeSummary summary = Summarize(volume);
    const ClassificationTable table = Classify(RandomTransfer(random), volume.description, summary.range);
    const OccupancyGrid expected = CountOneByOne(volume, table);
    EXPECT_EQ(CountOccupied(volume.block, table), expected);
    EXPECT_EQ(CountOccupied(BrickedVoxels(volume.block), table), expected);
    EXPECT_EQ(CountOccupied(volume.block, table, &summary), expected);
  }
}

}  // namespace
}  // namespace slabstream
