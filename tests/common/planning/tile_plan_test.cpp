// Who draws tiles of shapes for whom.
#include "common/planning/tile_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/frame/shape_grid.h"
#include "tests/common/planning/plan_support.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::IsEmpty;

FramePlan PlanOf(int workers, const ImageSize& size, int groups) {
  FrameRequest request = SomeRequest();
  request.renderer = "raycast";
  request.size = size;
  request.policy.groups = groups;
  FramePlan plan = Plan(request, FullSummary({64, 64, 64}), FullRoster(workers));
  plan.setup.shapes.resize(1);
  return plan;
}

// Workers by tile: those that render or display some of its pixels.
std::vector<std::set<WorkerId>> NeededBy(const FramePlan& plan, const ShapeGrid& grid) {
  std::vector<std::set<WorkerId>> needed(grid.count());
  const auto add = [&](std::int32_t x, std::int32_t y, WorkerId worker) { needed[grid.NumberOf(x, y)].insert(worker); };
  for (const Placement& placement : PlacementsOf(plan)) {
    const PixelBounds reach = ReachOf(placement.box, plan.setup);
    for (std::int32_t y = reach.y_begin; y < reach.y_end; ++y) {
      for (std::int32_t x = reach.x_begin; x < reach.x_end; ++x) add(x, y, placement.worker);
    }
  }
  const std::vector<WorkerId> displays = DisplaysOf(plan.groups.front(), plan.display);
  for (std::size_t i = 0; i < displays.size(); ++i) {
    const PixelRange share = Share(WholeFrame(plan.setup), i, displays.size());
    for (std::uint64_t pixel = share.begin; pixel < share.end; ++pixel) {
      add(std::int32_t(pixel % std::uint64_t(grid.frame.width())), std::int32_t(pixel / std::uint64_t(grid.frame.width())), displays[i]);
    }
  }
  return needed;
}

TEST(TilePlan, EachTileIsDrawnByOneWorkerForAllWhoNeedIt) {
  Random random(8);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    const int workers = random.Integer(2, 20);
    FramePlan plan = PlanOf(workers, {random.Integer(1, 300), random.Integer(1, 300)}, random.Integer(1, 3));
    const ShapeGrid grid(FrameBounds(plan.setup));
    std::vector<std::set<WorkerId>> got(grid.count());
    std::map<std::uint32_t, WorkerId> drawn_by;
    for (const TileOrder& order : PlanTiles(plan)) {
      EXPECT_NE(order.from, order.to);
      EXPECT_FALSE(order.tiles.empty());
      for (const std::uint32_t tile : order.tiles) {
        EXPECT_EQ(drawn_by.try_emplace(tile, order.from).first->second, order.from) << "tile " << tile << " is drawn twice";
        EXPECT_TRUE(got.at(tile).insert(order.to).second) << "tile " << tile << " is sent twice";
        got.at(tile).insert(order.from);
      }
    }
    const std::vector<std::set<WorkerId>> needed = NeededBy(plan, grid);
    for (std::uint32_t tile = 0; tile < grid.count(); ++tile) {
      const auto drawer = drawn_by.find(tile);
      if (drawer == drawn_by.end()) {
        EXPECT_LE(needed[tile].size(), 1U) << "tile " << tile << " is drawn by each that needs it";
        continue;
      }
      std::set<WorkerId> expected = needed[tile];
      expected.insert(drawer->second);
      EXPECT_EQ(got[tile], expected) << "tile " << tile;
    }
  }
}

TEST(TilePlan, WorkIsDivided) {
  for (const int workers : {2, 3, 4, 8, 16}) {
    const FramePlan plan = PlanOf(workers, {512, 512}, 1);
    std::map<WorkerId, std::set<std::uint32_t>> drawn;
    for (const TileOrder& order : PlanTiles(plan)) drawn[order.from].insert(order.tiles.begin(), order.tiles.end());
    ASSERT_EQ(drawn.size(), std::size_t(workers));
    for (const auto& [worker, tiles] : drawn) {
      EXPECT_LE(double(tiles.size()), 1.5 * 64 / workers + 1) << workers << " workers";
    }
  }
}

TEST(TilePlan, WithoutShapesOrOthersThereIsNothingToDraw) {
  FramePlan plan = PlanOf(8, {200, 200}, 1);
  plan.setup.shapes.clear();
  EXPECT_THAT(PlanTiles(plan), IsEmpty());
  EXPECT_THAT(PlanTiles(PlanOf(1, {200, 200}, 1)), IsEmpty());
}

}  // namespace
}  // namespace slabstream
