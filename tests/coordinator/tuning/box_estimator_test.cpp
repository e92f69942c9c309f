// Estimates of boxes: where their images lie, how they add up.
#include "coordinator/tuning/box_estimator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/decomposition/decomposition.h"
#include "tests/common/planning/support.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

OccupancyGrid FilledGrid(const Index3& size, const Box& filled) {
  OccupancyGrid grid{size, {}};
  const Index3 cells = OccupancyCells(size);
  for (Index3 cell; cell.z < cells.z; ++cell.z) {
    for (cell.y = 0; cell.y < cells.y; ++cell.y) {
      for (cell.x = 0; cell.x < cells.x; ++cell.x) {
        const Box part = Intersection(OccupancyCellBox(cell, size), filled);
        grid.cells.push_back(part.empty() ? CellOccupancy{} : FullCell(part));
      }
    }
  }
  return grid;
}

// A volume that is drawn everywhere.
struct FullVolume {
  Index3 size = {64, 64, 64};
  VolumeSummary summary = FullGridSummary(size);
  OccupancyGrid grid = FilledGrid(size, {{0, 0, 0}, size});
  WorkField learnt = {size, std::vector<double>(grid.cells.size(), 0.5)};  // seconds of each cell
};

FrameSetup SetupOf(const Index3& size, const RendererKind* renderer, const ViewParameters& view = {}, int side = 256) {
  FrameRequest request = SomeRequest();
  request.renderer = renderer->name();
  request.view = view;
  request.size = {side, side};
  return SetupOf(request, FullGridSummary(size));
}

TEST(BoxEstimator, AnOpaqueBlockSeenFromTheFrontCoversItsRectangle) {
  const Index3 size = {128, 128, 128};
  const VolumeSummary summary = FullGridSummary(size);
  const Box block = {{32, 0, 48}, {96, 128, 112}};
  const OccupancyGrid grid = FilledGrid(size, block);
  for (const RendererKind* renderer : Renderers()) {
    const FrameSetup setup = SetupOf(size, renderer);  // along +y
    for (const int pixel_side : {1, 3}) {
      const BoxEstimator estimator(setup, summary, grid, nullptr, pixel_side);
      const BoxEstimator::Estimate estimate = estimator.Of({{0, 0, 0}, size});
      const double pixels = estimate.coverage.pixels() * pixel_side * pixel_side;
      // 64 x 64 voxels, as large as they are in the frame; footprints reach a voxel further.
      double scale = 0;
      if (renderer->along_slices()) {
        const SlicePlacement slice = PlaceSlice(setup.sheets, 64);
        scale = slice.scale_u * slice.scale_v;
      } else {
        const Camera::ImagePoint a = setup.camera.Project({0, 64, 0}), b = setup.camera.Project({1, 64, 0});
        scale = (b.x - a.x) * (b.x - a.x);
      }
      EXPECT_NEAR(pixels / (64 * 64 * scale), 1, 0.12) << renderer->name() << ", pixels of " << pixel_side;
      EXPECT_GT(estimate.seconds, 0);
    }
  }
}

TEST(BoxEstimator, BoxesWithoutAnythingCostAndShowNothing) {
  const Index3 size = {64, 64, 64};
  const VolumeSummary summary = FullSummary(size);
  const OccupancyGrid grid = FilledGrid(size, {{0, 0, 0}, {64, 64, 16}});
  const FrameSetup setup = SetupOf(size, Splatting());
  const BoxEstimator estimator(setup, summary, grid, nullptr, 1);
  const BoxEstimator::Estimate nothing = estimator.Of({{0, 0, 16}, {64, 64, 64}});
  EXPECT_EQ(nothing.seconds, 0);
  EXPECT_EQ(nothing.coverage.pixels(), 0);
}

TEST(BoxEstimator, WhatTheFrontHidesCostsAndShowsNothing) {
  const FullVolume volume;
  const auto& [size, summary, grid, learnt] = volume;
  const Box near = {{0, 0, 0}, {64, 32, 64}}, far = {{0, 32, 0}, {64, 64, 64}};
  for (const RendererKind* renderer : {Splatting(), FindRenderer("raycast")}) {
    FrameSetup setup = SetupOf(size, renderer);  // along +y
    const BoxEstimator::Estimate seen = BoxEstimator(setup, summary, grid, nullptr, 1).Of(far);
    EXPECT_GT(seen.seconds, 0);
    setup.front.tile = FrontTile(setup);
    setup.front.tiles_x = setup.front.tiles_y = (FrameBounds(setup).width() - 1) / setup.front.tile + 1;
    OpaqueFront::Depths depths;
    depths.fill(24);  // slices
    setup.front.tiles.assign(std::size_t(setup.front.tiles_x) * std::size_t(setup.front.tiles_y), depths);
    ASSERT_TRUE(CheckFits(setup.front, setup).ok());
    const BoxEstimator estimator(setup, summary, grid, nullptr, 1), by_measured(setup, summary, grid, &learnt, 1);
    EXPECT_EQ(estimator.Of(far).seconds, 0) << renderer->name();
    EXPECT_EQ(estimator.Of(far).coverage.pixels(), 0) << renderer->name();
    const BoxEstimator::Estimate in_front = BoxEstimator(SetupOf(size, renderer), summary, grid, nullptr, 1).Of(near);
    EXPECT_NEAR(estimator.Of(near).seconds, 0.75 * in_front.seconds, 1e-6 * in_front.seconds) << renderer->name();
    EXPECT_EQ(by_measured.Of(far).coverage.pixels(), 0) << renderer->name();
    EXPECT_NEAR(by_measured.Of(far).seconds, 0.5 * 8 * 8 * 4, 1e-6) << "measured times do not have what was hidden";
  }
}

TEST(BoxEstimator, SharesAreSharesAndBoxesCoverWhatTheWholeCovers) {
  Random random(4711);
  SCOPED_TRACE(random.trace());
  const Index3 size = {90, 77, 133};
  const VolumeSummary summary = FullSummary(size);
  for (int round = 0; round < 20; ++round) {
    OccupancyGrid grid{size, {}};
    const Index3 cells = OccupancyCells(size);
    const double filled = random.Real(0, 1);
    for (Index3 cell; cell.z < cells.z; ++cell.z) {
      for (cell.y = 0; cell.y < cells.y; ++cell.y) {
        for (cell.x = 0; cell.x < cells.x; ++cell.x) {
          CellOccupancy some = FullCell(OccupancyCellBox(cell, size));
          some.voxels = std::uint16_t(random.Integer(0, int(some.voxels)));
          grid.cells.push_back(random.Chance(filled) ? some : CellOccupancy{});
        }
      }
    }
    const FrameSetup setup = SetupOf(size, random.Chance(0.5) ? Splatting() : ZBuffer(), RandomView(random));
    const BoxEstimator estimator(setup, summary, grid, nullptr, random.Integer(1, 4));
    const BoxEstimator::Estimate whole = estimator.Of({{0, 0, 0}, size});
    double sum = 0;
    const WorkField work(grid);
    const Partition boxes = MakeSubcubes({.work = &work, .boxes = random.Integer(1, 12)});
    for (const Box& box : boxes.boxes()) {
      const BoxEstimator::Estimate part = estimator.Of(box);
      EXPECT_TRUE(std::isfinite(part.seconds) && part.seconds >= 0);
      for (const float share : part.coverage.share) EXPECT_TRUE(share >= 0 && share <= 1) << share;
      EXPECT_LE(part.coverage.pixels(), 1.1 * whole.coverage.pixels() + 1) << "round " << round;
      sum += part.coverage.pixels();
    }
    EXPECT_GE(sum, 0.8 * whole.coverage.pixels() - 1) << "round " << round;
  }
}

TEST(BoxEstimator, WhatWasLearntCounts) {
  const FullVolume volume;
  const auto& [size, summary, grid, learnt] = volume;
  const FrameSetup setup = SetupOf(size, ZBuffer());
  const BoxEstimator estimator(setup, summary, grid, &learnt, 1);
  EXPECT_NEAR(estimator.Of({{0, 0, 0}, {64, 64, 32}}).seconds, 0.5 * 8 * 8 * 4, 1e-6);
}

}  // namespace
}  // namespace slabstream
