#include "common/classification/count_occupied.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"
#include "tests/support/random_transfer.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

OccupancyGrid CountOneByOne(const Volume& volume, const ClassificationTable& table) {
  const Index3 size = volume.description.geometry.size, cells = OccupancyCells(size);
  OccupancyGrid grid{size, std::vector<CellOccupancy>(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z))};
  VisitScalarType(volume.block.type, [&]<class T>(const T*) {
    for (Index3 v; v.z < size.z; ++v.z) {
      for (v.y = 0; v.y < size.y; ++v.y) {
        for (v.x = 0; v.x < size.x; ++v.x) {
          const auto sample = double(volume.block.samples<T>()[volume.block.Offset(v)]);
          if (!std::isfinite(sample) || table.opacity[std::size_t(table.BinOf(sample))] == 0) continue;
          const Index3 cell = {v.x / kOccupancyCell, v.y / kOccupancyCell, v.z / kOccupancyCell};
          const std::size_t number =
              (std::size_t(cell.z) * std::size_t(cells.y) + std::size_t(cell.y)) * std::size_t(cells.x) + std::size_t(cell.x);
          CellOccupancy& counts = grid.cells[number];
          ++counts.voxels;
          counts.lines_x |= LineSet{1} << (8 * (v.z % 8) + v.y % 8);
          counts.lines_y |= LineSet{1} << (8 * (v.z % 8) + v.x % 8);
        }
      }
    }
  });
  return grid;
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
    const ClassificationTable table = Classify(RandomTransfer(random), volume.description, Summarize(volume).range);
    const OccupancyGrid expected = CountOneByOne(volume, table);
    EXPECT_EQ(CountOccupied(volume.block, table), expected);
    EXPECT_EQ(CountOccupied(BrickedVoxels(volume.block), table), expected);
  }
}

}  // namespace
}  // namespace slabstream
