// What RenderWork foretells behaves like render times, and layouts made by it are even.
#include "common/planning/render_work.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/planning/layout.h"
#include "tests/planning/support.h"
#include "tests/support/random_box.h"

namespace slabstream {
namespace {

OccupancyGrid EmptyGrid(const Index3& size) {
  const Index3 cells = OccupancyCells(size);
  return {size, std::vector<CellOccupancy>(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z))};
}

// Cells of a hollow sphere that fills the volume, all voxels of them occupied.
OccupancyGrid ShellGrid(std::int32_t side) {
  OccupancyGrid grid = EmptyGrid({side, side, side});
  const Index3 cells = OccupancyCells(grid.size);
  auto cell = grid.cells.begin();
  for (Index3 c; c.z < cells.z; ++c.z) {
    for (c.y = 0; c.y < cells.y; ++c.y) {
      for (c.x = 0; c.x < cells.x; ++c.x, ++cell) {
        const double middle = 0.5 * cells.x - 0.5, radius = Length(ToVec3(c) - Vec3{middle, middle, middle});
        if (std::abs(radius - middle + 1) < 1) *cell = FullCell(OccupancyCellBox(c, grid.size));
      }
    }
  }
  return grid;
}

OccupancyGrid RandomGrid(Random& random, const Index3& size) {
  OccupancyGrid grid = EmptyGrid(size);
  for (CellOccupancy& cell : grid.cells) {
    if (random.Chance(0.5)) continue;
    const int rows = random.Integer(1, 64);
    cell = {std::uint16_t(random.Integer(rows, 8 * rows)), std::uint8_t(rows), std::uint8_t(random.Integer(1, 64))};
  }
  return grid;
}

TEST(RenderWork, IsNothingWhereNothingIsNear) {
  OccupancyGrid grid = EmptyGrid({64, 64, 64});
  grid.cells[0] = FullCell({{0, 0, 0}, {8, 8, 8}});
  const RenderWork work(grid, RendererKind::kSplat, 0.1);
  EXPECT_EQ(work.Of({{10, 0, 0}, {64, 64, 64}}), (RenderWork::ByView{0, 0})) << "footprints do not reach so far";
  EXPECT_GT(work.Of({{9, 0, 0}, {64, 64, 64}})[0], 0);
  EXPECT_EQ(RenderWork(grid, RendererKind::kZBuffer, 0).Of({{8, 0, 0}, {64, 64, 64}}), (RenderWork::ByView{0, 0}));
}

TEST(RenderWork, GrowsWithTheBoxAndWithTheNumberOfBoxes) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 300; ++round) {
    const OccupancyGrid grid = RandomGrid(random, {random.Integer(8, 60), random.Integer(8, 60), random.Integer(8, 60)});
    const Box whole = RandomBox(random, {{0, 0, 0}, grid.size}), part = RandomBox(random, whole);
    for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
      const RenderWork work(grid, renderer, 0);
      for (std::size_t view = 0; view < 2; ++view) EXPECT_LE(work.Of(part)[view], work.Of(whole)[view] * (1 + 1e-12)) << "round " << round;
    }
    const auto axis = Axis(random.Integer(0, 2));
    if (whole.size()[axis] < 2) continue;
    Box lower = whole, upper = whole;
    lower.end[axis] = upper.begin[axis] = random.Integer(whole.begin[axis] + 1, whole.end[axis] - 1);
    const RenderWork work(grid, RendererKind::kSplat, 0);
    for (std::size_t view = 0; view < 2; ++view) {
      EXPECT_GE(work.Of(lower)[view] + work.Of(upper)[view], work.Of(whole)[view] * (1 - 1e-12)) << "round " << round;
    }
  }
}

TEST(RenderWork, OfALongBoxIsLessSeenFromItsSide) {
  OccupancyGrid grid = EmptyGrid({64, 64, 16});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const auto [along_x, along_y] = RenderWork(grid, RendererKind::kSplat, 0).Of({{0, 16, 0}, {64, 32, 16}});
  EXPECT_LT(along_y, 0.75 * along_x) << "a quarter of the slices, the same octets";
}

TEST(RenderWork, LeavesOutWhatIsHidden) {
  OccupancyGrid grid = EmptyGrid({64, 64, 64});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const Box box{{0, 0, 0}, {64, 64, 64}};
  double last = std::numeric_limits<double>::infinity();
  for (const double extinction : {0.0, 0.2, 0.5, 5.0}) {
    const auto [along_x, along_y] = RenderWork(grid, RendererKind::kSplat, extinction).Of(box);
    EXPECT_DOUBLE_EQ(along_x, along_y);
    EXPECT_LT(along_x, last) << extinction;
    last = along_x;
  }
}

TEST(MedianExtinction, IsThatOfTheVoxelsThatShow) {
  const VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0.5}};
  transfer.opacity_distance = 2;
  EXPECT_NEAR(MedianExtinction(transfer, summary), std::log(2) / 2, 1e-6);
  transfer.opacities = {{0, 0}, {128, 0}, {128, 0.5}};
  EXPECT_NEAR(MedianExtinction(transfer, summary), std::log(2) / 2, 1e-6) << "of what is empty nothing is told";
  transfer.opacities = {{0, 0}};
  EXPECT_EQ(MedianExtinction(transfer, summary), 0);
  transfer.opacities = {{0, 1}};
  EXPECT_TRUE(std::isfinite(MedianExtinction(transfer, summary)));
}

TEST(DrawnTable, HoldsWhatTheRendererDraws) {
  const VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0}, {255, 0.8}};
  const ClassificationTable splat = DrawnTable(transfer, summary, RendererKind::kSplat);
  const ClassificationTable zbuffer = DrawnTable(transfer, summary, RendererKind::kZBuffer);
  const float half = 0.5F * MaxOpacity(splat, summary.description, summary.range);
  ASSERT_EQ(splat.opacity.size(), zbuffer.opacity.size());
  for (std::size_t bin = 0; bin < splat.opacity.size(); ++bin) {
    EXPECT_EQ(zbuffer.opacity[bin], splat.opacity[bin] >= half ? splat.opacity[bin] : 0) << bin;
  }
}

// By what is foretold of its boxes.
double SlowestOf(const Layout& layout, const RenderWork& work, double& mean) {
  double slowest = 0, sum = 0;
  int boxes = 0;
  for (std::size_t box = 0; box < layout.owners.size(); ++box) {
    if (layout.owners[box] == kNoSlot) continue;
    const auto [x, y] = work.Of(layout.partition.boxes()[box]);
    slowest = std::max(slowest, (x + y) / 2);
    sum += (x + y) / 2;
    ++boxes;
  }
  mean = sum / boxes;
  return slowest;
}

TEST(MakeLayout, BoxesOfAKdTreeTakeEquallyLong) {
  const OccupancyGrid grid = ShellGrid(256);
  const VolumeSummary summary = FullSummary(grid.size);
  const TransferFunction transfer = std::get<TransferFunction>(SomeRequest().transfer.choice);
  for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
    const RenderWork work(grid, renderer, MedianExtinction(transfer, summary));
    for (const std::uint32_t slots : {2U, 3U, 5U, 8U, 13U}) {
      SCOPED_TRACE(std::to_string(slots) + " slots, renderer " + std::to_string(int(renderer)));
      Policy policy;
      policy.decomposition = "kd-tree";
      policy.groups = 1;
      const LayoutRequest request{.summary = &summary,
                                  .transfer = &transfer,
                                  .policy = &policy,
                                  .renderer = renderer,
                                  .slots = slots,
                                  .known = {.occupied = &grid}};
      double mean = 0;
      const double occupied = SlowestOf(MakeLayout(request), work, mean);
      if (renderer == RendererKind::kSplat) {
        EXPECT_LT(occupied, 1.15 * mean);
      }
      policy.split = "voxels";
      EXPECT_LE(occupied, SlowestOf(MakeLayout(request), work, mean)) << "than boxes of equal volume";
    }
  }
}

}  // namespace
}  // namespace slabstream
