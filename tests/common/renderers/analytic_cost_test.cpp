// Predicted costs of boxes behave like render times, and layouts made by them are even.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <vector>

#include "common/planning/layout.h"
#include "common/renderers/sampling_rate.h"
#include "common/renderers/splat/splat_cost.h"
#include "tests/common/planning/support.h"
#include "tests/support/random_box.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

// Of a cell: `voxel` is counted from any cell's first one.
void Occupy(const Index3& voxel, CellOccupancy& cell) {
  const std::int32_t x = voxel.x % kOccupancyCell, y = voxel.y % kOccupancyCell, z = voxel.z % kOccupancyCell;
  cell.lines_x |= LinesIn(z, z + 1, y, y + 1);
  cell.lines_y |= LinesIn(z, z + 1, x, x + 1);
  ++cell.voxels;
}

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

constexpr Vec3 kCubes = {1, 1, 1};

using ByView = std::array<double, 2>;  // seconds seen along x and seen along y
ByView Of(const AnalyticCost& cost, const Box& box) { return {cost(box, {.along = Axis::kX}), cost(box, {.along = Axis::kY})}; }

OccupancyGrid RandomGrid(Random& random, const Index3& size) {
  OccupancyGrid grid = EmptyGrid(size);
  const Index3 cells = OccupancyCells(size);
  std::set<std::size_t> occupied;
  for (int voxels = random.Integer(1, 2000); voxels > 0; --voxels) {
    const Index3 v = {random.Integer(0, size.x - 1), random.Integer(0, size.y - 1), random.Integer(0, size.z - 1)};
    const Index3 cell = {v.x / kOccupancyCell, v.y / kOccupancyCell, v.z / kOccupancyCell};
    if (!occupied.insert(std::size_t((v.z * size.y + v.y) * size.x + v.x)).second) continue;
    Occupy(v, grid.cells[std::size_t((cell.z * cells.y + cell.y) * cells.x + cell.x)]);
  }
  return grid;
}

TEST(AnalyticCost, IsNothingWhereNothingIsNear) {
  OccupancyGrid grid = EmptyGrid({64, 64, 64});
  grid.cells[0] = FullCell({{0, 0, 0}, {8, 8, 8}});
  const AnalyticCost cost = splat::SplatCost(grid, kCubes, 0.1);
  const ByView nothing{0, 0};
  EXPECT_EQ(Of(cost, {{10, 0, 0}, {64, 64, 64}}), nothing) << "footprints do not reach so far";
  EXPECT_EQ(Of(cost, {{9, 0, 0}, {64, 64, 64}})[0], 0) << "in no slice of the box";
  EXPECT_GT(Of(cost, {{9, 0, 0}, {64, 64, 64}})[1], 0);
  EXPECT_EQ(Of(cost, {{0, 0, 10}, {64, 64, 64}}), nothing);
  EXPECT_GT(Of(cost, {{0, 0, 9}, {64, 64, 64}})[0], 0);
  EXPECT_EQ(Of(ZBuffer()->MakeCost({.drawn = &grid}), {{8, 0, 0}, {64, 64, 64}}), nothing);
}

TEST(AnalyticCost, KnowsWhichRowsOfACellHoldAnything) {
  // Planes of constant z, one or two, one of which may change its height halfway along the beams.
  const auto planes = [](std::int32_t lower, std::int32_t upper, std::int32_t beyond) {
    OccupancyGrid grid = EmptyGrid({32, 32, 16});
    for (std::size_t i = 0; i < grid.cells.size(); ++i) {
      for (std::int32_t y = 0; y < 8; ++y) {
        for (std::int32_t x = 0; x < 8; ++x) {
          const bool far = i / 4 % 4 >= 2;  // y >= 16
          for (const std::int32_t z : {lower, far ? beyond : upper}) {
            if (z / 8 == std::int32_t(i) / 16) Occupy({x, y, z % 8}, grid.cells[i]);
          }
        }
      }
    }
    return grid;
  };
  const auto counts = [](const OccupancyGrid& grid, const Box& box, Axis along) {
    return splat::SplatWork(grid, kCubes, 0).Count(box, along);
  };
  const Box whole{{0, 0, 0}, {32, 32, 16}};
  const OccupancyGrid one = planes(5, 5, 5);
  EXPECT_EQ(counts(one, whole, Axis::kX).rows, 32 * 4) << "four rows of a slice, not those of four cells";
  EXPECT_EQ(counts(one, whole, Axis::kX).segments, 32 * 4 * 4);
  EXPECT_EQ(counts(one, whole, Axis::kX).runs, 32 * 4);
  EXPECT_EQ(counts(one, whole, Axis::kX).octets, 32 * 4);
  EXPECT_EQ(counts(one, {{0, 0, 0}, {32, 32, 4}}, Axis::kX).rows, 0) << "rows 4 to 7 are reached";
  EXPECT_EQ(counts(one, {{0, 0, 6}, {32, 32, 16}}, Axis::kY).rows, 32 * 2);
  EXPECT_EQ(counts(planes(5, 6, 6), whole, Axis::kX).rows, 32 * 5) << "rows that both reach count once";
  EXPECT_EQ(counts(planes(5, 7, 7), {{0, 0, 8}, {32, 32, 16}}, Axis::kX).rows, 32 * 2) << "those of the cell below, too";
  const splat::SplatCounts stepped = counts(planes(2, 2, 13), whole, Axis::kX);
  EXPECT_EQ(stepped.rows, 32 * 8) << "other rows, of the same slices";
  EXPECT_EQ(stepped.runs, 32 * 8);
}

TEST(AnalyticCost, CountsRowsByTheirPixels) {
  OccupancyGrid grid = EmptyGrid({16, 16, 16});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const Box box{{0, 0, 0}, {16, 16, 16}};
  const splat::SplatCounts cubes = splat::SplatWork(grid, kCubes, 0).Count(box, Axis::kX);
  const splat::SplatCounts tall = splat::SplatWork(grid, {0.5, 0.5, 0.75}, 0).Count(box, Axis::kX);
  EXPECT_EQ(tall.rows, 1.5 * cubes.rows);
  EXPECT_EQ(tall.segments, 1.5 * cubes.segments);
  EXPECT_EQ(tall.octets, cubes.octets) << "voxels are voxels";
}

TEST(AnalyticCost, GrowsWithTheBoxAndWithTheNumberOfBoxes) {
  const VolumeSummary summary = FullSummary({8, 8, 8});
  const TransferFunction transfer{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0}}};  // nothing is hidden
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 300; ++round) {
    const OccupancyGrid grid = RandomGrid(random, {random.Integer(8, 60), random.Integer(8, 60), random.Integer(8, 60)});
    const Box whole = RandomBox(random, {{0, 0, 0}, grid.size}), part = RandomBox(random, whole);
    for (const RendererKind* renderer : Renderers()) {
      const AnalyticCost cost = renderer->MakeCost({&grid, &summary, &transfer});
      for (std::size_t view = 0; view < 2; ++view)
        EXPECT_LE(Of(cost, part)[view], Of(cost, whole)[view] * (1 + 1e-12)) << "round " << round;
    }
    const auto axis = Axis(random.Integer(0, 2));
    if (whole.size()[axis] < 2) continue;
    Box lower = whole, upper = whole;
    lower.end[axis] = upper.begin[axis] = random.Integer(whole.begin[axis] + 1, whole.end[axis] - 1);
    const AnalyticCost cost = splat::SplatCost(grid, kCubes, 0);
    for (std::size_t view = 0; view < 2; ++view) {
      EXPECT_GE(Of(cost, lower)[view] + Of(cost, upper)[view], Of(cost, whole)[view] * (1 - 1e-12)) << "round " << round;
    }
  }
}

TEST(AnalyticCost, FollowsTheSamplingRate) {
  OccupancyGrid grid = EmptyGrid({64, 64, 64});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const VolumeSummary summary = FullSummary(grid.size);
  const TransferFunction transfer{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.001}}};  // dense, and nothing is hidden
  int with_rate = 0;
  for (const RendererKind* renderer : Renderers()) {
    if (renderer->parameters().empty() || renderer->parameters().front().name != SamplingRate().name) continue;
    SCOPED_TRACE(renderer->name());
    ++with_rate;
    std::vector<double> parameters;
    for (const RendererParameter& parameter : renderer->parameters()) parameters.push_back(parameter.standard);
    const auto at_rate = [&](double rate) {
      parameters.front() = rate;
      return renderer->MakeCost({&grid, &summary, &transfer, parameters})({{0, 0, 0}, grid.size}, {});
    };
    const double standard = parameters.front();
    EXPECT_EQ(at_rate(standard), renderer->MakeCost({&grid, &summary, &transfer})({{0, 0, 0}, grid.size}, {})) << "the default";
    // Shears resample slices once, and slicing sets up each cell once, whatever the rate.
    EXPECT_GT(at_rate(2) / at_rate(1), renderer->Can(Ability::kCells) ? 1.05 : 1.3);
    EXPECT_LT(at_rate(2) / at_rate(1), 2.2);
    EXPECT_NEAR((at_rate(4) - at_rate(2)) / (at_rate(2) - at_rate(1)), 2, 1e-9) << "what is left is done once a box and once a pixel";
  }
  EXPECT_GE(with_rate, 2);
}

TEST(AnalyticCost, OfALongBoxIsLessSeenFromItsSide) {
  OccupancyGrid grid = EmptyGrid({64, 64, 16});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const auto [along_x, along_y] = Of(splat::SplatCost(grid, kCubes, 0), {{0, 16, 0}, {64, 32, 16}});
  EXPECT_LT(along_y, 0.75 * along_x) << "a quarter of the slices, the same octets";
}

TEST(AnalyticCost, LeavesOutWhatIsHidden) {
  OccupancyGrid grid = EmptyGrid({64, 64, 64});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const Box box{{0, 0, 0}, {64, 64, 64}};
  double last = std::numeric_limits<double>::infinity();
  for (const double extinction : {0.0, 0.2, 0.5, 5.0}) {
    const auto [along_x, along_y] = Of(splat::SplatCost(grid, kCubes, extinction), box);
    EXPECT_DOUBLE_EQ(along_x, along_y);
    EXPECT_LT(along_x, last) << extinction;
    last = along_x;
  }
}

TEST(AnalyticCost, SlantingRaysLeaveAThinBoxBeforeTheyAreOpaque) {
  OccupancyGrid grid = EmptyGrid({128, 64, 64});
  for (CellOccupancy& cell : grid.cells) cell = FullCell({{0, 0, 0}, {8, 8, 8}});
  const splat::SplatWork dense(grid, kCubes, 0.3), clear(grid, kCubes, 0);
  const auto drawn = [&](std::int32_t height) {
    const Box box{{0, 0, 0}, {128, 64, height}};
    return dense.Count(box, Axis::kX).segments / clear.Count(box, Axis::kX).segments;
  };
  EXPECT_EQ(drawn(8), 1) << "8 rows, 0.42 a slice: 19 slices, where 35 are needed";
  EXPECT_LT(drawn(64), 0.75);
  EXPECT_LT(drawn(64), drawn(32));
}

TEST(MedianExtinction, IsThatOfTheVoxelsThatShow) {
  const VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0.5}};
  transfer.opacity_distance = 2;
  EXPECT_NEAR(splat::MedianExtinction(transfer, summary), std::log(2) / 2, 1e-6);
  transfer.opacities = {{0, 0}, {128, 0}, {128, 0.5}};
  EXPECT_NEAR(splat::MedianExtinction(transfer, summary), std::log(2) / 2, 1e-6) << "of what is empty nothing is told";
  transfer.opacities = {{0, 0}};
  EXPECT_EQ(splat::MedianExtinction(transfer, summary), 0);
  transfer.opacities = {{0, 1}};
  EXPECT_TRUE(std::isfinite(splat::MedianExtinction(transfer, summary)));
}

TEST(DrawnTable, HoldsWhatTheRendererDraws) {
  const VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0}, {255, 0.8}};
  const ClassificationTable splat = Splatting()->DrawnTable(transfer, summary);
  const ClassificationTable zbuffer = ZBuffer()->DrawnTable(transfer, summary);
  const float half = 0.5F * MaxOpacity(splat, summary.description, summary.range);
  ASSERT_EQ(splat.opacity.size(), zbuffer.opacity.size());
  for (std::size_t bin = 0; bin < splat.opacity.size(); ++bin) {
    EXPECT_EQ(zbuffer.opacity[bin], splat.opacity[bin] >= half ? splat.opacity[bin] : 0) << bin;
  }
}

// Isosurfaces pass only where there is a voxel of at least the isovalue.
TEST(DrawnTable, HoldsTheVoxelsAboveAnIsovalue) {
  const VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer{{{0, {1, 1, 1}}}, {{0, 0}}};
  transfer.isosurfaces = {{99.6, {1, 0, 0}, 0.1}, {200, {0, 1, 0}, 1}};
  for (const RendererKind* renderer : {ZBuffer(), FindRenderer("raycast")}) {
    const ClassificationTable drawn = renderer->DrawnTable(transfer, summary);
    for (int bin = 0; bin < drawn.size(); ++bin) EXPECT_EQ(drawn.opacity[std::size_t(bin)] > 0, bin >= 100) << renderer->name() << bin;
  }
  const ClassificationTable zbuffer = ZBuffer()->Table(transfer, summary.description, summary.range);
  EXPECT_EQ(zbuffer.color[199], (Rgb{1, 0, 0}));
  EXPECT_EQ(zbuffer.color[200], (Rgb{0, 1, 0}));
}

TEST(AnalyticCost, OfSurfacesAloneIsThatOfTheCellsTheyPassThrough) {
  const VolumeSummary summary = FullSummary({16, 16, 16});
  TransferFunction transfer{{{0, {1, 1, 1}}}, {{0, 0}}};
  transfer.isosurfaces = {{100, {1, 0, 0}, 1}};
  OccupancyGrid grid = EmptyGrid({16, 16, 16});
  for (std::size_t i = 0; i < 4; ++i) grid.cells[i] = FullCell({{0, 0, 0}, {8, 8, 8}});  // z < 8
  const auto raycast = FindRenderer("raycast")->MakeCost({&grid, &summary, &transfer});
  const Box lower{{0, 0, 0}, {16, 16, 8}}, upper{{0, 0, 8}, {16, 16, 16}};
  const double full = Of(raycast, lower)[0];
  EXPECT_GT(full, 0) << "rays leap through it, and boxes are cut before voxels are counted";
  EXPECT_EQ(Of(raycast, upper)[0], 0);
  for (std::size_t i = 0; i < 4; ++i) grid.cells[i].voxels -= 1;
  EXPECT_GT(Of(raycast, lower)[0], full);
}

// By what is predicted of the layout's boxes, each with a slot of its own: a frame on average over views, and how uneven the worse view is.
struct Predicted {
  double frame = 0, imbalance = 0;
};
Predicted PredictionOf(const Layout& layout, const AnalyticCost& cost) {
  Predicted predicted;
  for (std::size_t view = 0; view < 2; ++view) {
    std::vector<double> times;
    for (std::size_t box = 0; box < layout.owners.size(); ++box) {
      if (layout.owners[box] != kNoSlot) times.push_back(Of(cost, layout.partition.boxes()[box])[view]);
    }
    const double slowest = *std::ranges::max_element(times), sum = std::accumulate(times.begin(), times.end(), 0.0);
    predicted.frame += slowest / 2;
    predicted.imbalance = std::max(predicted.imbalance, slowest * double(times.size()) / sum);
  }
  return predicted;
}

TEST(MakeLayout, BoxesOfAKdTreeTakeEquallyLong) {
  const OccupancyGrid grid = ShellGrid(256);
  const VolumeSummary summary = FullSummary(grid.size);
  const TransferFunction transfer = std::get<TransferFunction>(SomeRequest().transfer.choice);
  for (const RendererKind* renderer : Renderers()) {
    const AnalyticCost cost = renderer->MakeCost({&grid, &summary, &transfer});
    const ClassifiedVolume volume(1, transfer, renderer);
    for (const std::uint32_t slots : {2U, 3U, 5U, 8U, 13U}) {
      SCOPED_TRACE(std::to_string(slots) + " slots, renderer " + std::string(renderer->name()));
      ResolvedPolicy resolved = ResolvePolicy({.decomposition = "kd-tree", .groups = 1}, summary.description.geometry);
      const LayoutRequest request{
          .summary = &summary, .volume = &volume, .policy = &resolved, .slots = slots, .known = {.occupied = &grid}};
      const Predicted occupied = PredictionOf(MakeLayout(request), cost);
      if (renderer->along_slices()) {
        EXPECT_LT(occupied.imbalance, 1.12);
      }
      resolved.balance_by = BalanceBy::kVoxels;
      EXPECT_LE(occupied.frame, PredictionOf(MakeLayout(request), cost).frame) << "than boxes of equal volume";
    }
  }
}

}  // namespace
}  // namespace slabstream
