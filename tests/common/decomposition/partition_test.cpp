#include "common/decomposition/partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "common/decomposition/decomposition.h"
#include "tests/common/decomposition/random_partition.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using Node = Partition::Node;

void ExpectTiles(const Partition& partition, const Box& bounds) {
  EXPECT_EQ(partition.bounds(), bounds);
  std::int64_t voxels = 0;
  const auto boxes = partition.boxes();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    EXPECT_FALSE(boxes[i].empty());
    EXPECT_TRUE(bounds.Contains(boxes[i]));
    voxels += boxes[i].voxel_count();
    for (std::size_t j = 0; j < i; ++j) EXPECT_TRUE(Intersection(boxes[i], boxes[j]).empty()) << i << " and " << j;
  }
  EXPECT_EQ(voxels, bounds.voxel_count());  // disjoint and of the right size: they cover
}

constexpr std::int32_t kHaloVoxels = 8;

// A few blobs of cells with random numbers of voxels, the rest empty.
OccupancyGrid RandomGrid(Random& random, const Index3& size) {
  const Index3 cells = OccupancyCells(size);
  OccupancyGrid grid{size, std::vector<CellOccupancy>(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z))};
  for (int blob = random.Integer(0, 4); blob > 0; --blob) {
    const Box box = {{random.Integer(0, cells.x - 1), random.Integer(0, cells.y - 1), random.Integer(0, cells.z - 1)}, cells};
    const std::int32_t side = random.Integer(1, 5);
    for (std::size_t i = 0; i < grid.cells.size(); ++i) {
      const Index3 cell = {std::int32_t(i) % cells.x, std::int32_t(i) / cells.x % cells.y, std::int32_t(i) / cells.x / cells.y};
      const Box blob_box = {box.begin, {box.begin.x + side, box.begin.y + side, box.begin.z + side}};
      if (blob_box.Contains(cell))
        grid.cells[i].voxels = std::uint16_t(random.Integer<std::int64_t>(1, OccupancyCellBox(cell, size).voxel_count()));
    }
  }
  return grid;
}

TEST(Decompositions, EveryOneTilesTheVolumeForEveryNumberOfBoxes) {
  Random random(70);
  SCOPED_TRACE(random.trace());
  for (const DecompositionEntry& entry : Decompositions()) {
    for (const Index3& size : {Index3{1, 1, 1}, Index3{64, 3, 7}, Index3{13, 17, 31}, Index3{5, 1, 100}, Index3{90, 80, 70}}) {
      const WorkField voxels = WorkField::Uniform(size), occupied(RandomGrid(random, size));
      for (const WorkField* work : {&voxels, &occupied}) {
        for (Axis axis : kAxes) {
          for (int boxes : {1, 2, 3, 5, 7, 8, 13, 31, 64, 97, 1000}) {
            SCOPED_TRACE(testing::Message() << entry.name << " " << size.x << "x" << size.y << "x" << size.z << " " << Letter(axis) << " "
                                            << boxes << " uniform " << work->uniform());
            const Partition partition = entry.make({.work = work,
                                                    .boxes = boxes,
                                                    .most_boxes = 2000,
                                                    .together = random.Integer(1, boxes),
                                                    .axis = axis,
                                                    .halo = kHaloVoxels,
                                                    .shape = random.Integer(0, entry.shapes - 1)});
            ExpectTiles(partition, {{0, 0, 0}, size});
          }
        }
      }
    }
  }
}

// How a partition is cut, but for where: axes of the planes with something on both sides, and the boxes below.
std::string PatternOf(const Partition& partition, std::uint32_t node, BoxId boxes) {
  const Node& n = partition.nodes()[node];
  if (n.leaf) return n.box < boxes ? "." : "";
  const std::string lower = PatternOf(partition, n.lower, boxes), upper = PatternOf(partition, n.upper, boxes);
  if (lower.empty() || upper.empty()) return lower + upper;
  return std::string(1, Letter(n.axis)) + "(" + lower + upper + ")";
}

TEST(Decompositions, ResizedBoxesAreCutAlongTheSameAxes) {
  Random random(76);
  SCOPED_TRACE(random.trace());
  for (const DecompositionEntry& entry : Decompositions()) {
    for (int i = 0; i < 200; ++i) {
      const Index3 size = {random.Integer(30, 90), random.Integer(30, 90), random.Integer(30, 90)};
      const Box bounds = {{0, 0, 0}, size};
      const WorkField work(RandomGrid(random, size)), other_work(RandomGrid(random, size));
      DecompositionRequest request{.work = &work,
                                   .boxes = random.Integer(1, 40),
                                   .most_boxes = 2000,
                                   .axis = kAxes[random.Integer<std::size_t>(0, 2)],
                                   .halo = kHaloVoxels};
      request.together = request.boxes;
      const Partition made = entry.make(request);
      request.resized = &made;
      EXPECT_EQ(entry.make(request), made) << entry.name << ": the same work";
      request.work = &other_work;
      const Partition resized = entry.make(request);
      ExpectTiles(resized, bounds);
      // Uniform work fills every box, and there is room for all: nothing has to change but planes.
      const WorkField voxels = WorkField::Uniform(size);
      DecompositionRequest even = request;
      even.work = &voxels;
      even.resized = nullptr;
      const Partition full = entry.make(even);
      DecompositionRequest uneven = request;
      std::vector<double> heavier =
          MacrocellWork({size, std::vector<CellOccupancy>(std::size_t(OccupancyCells(size).x) * std::size_t(OccupancyCells(size).y) *
                                                              std::size_t(OccupancyCells(size).z),
                                                          CellOccupancy{.voxels = 1})});
      for (double& cell : heavier) cell *= random.Real(1, 3);
      const WorkField heavier_work(size, heavier);
      uneven.work = &heavier_work;
      uneven.resized = &full;
      const Partition moved = entry.make(uneven);
      ExpectTiles(moved, bounds);
      EXPECT_EQ(PatternOf(moved, 0, 2000), PatternOf(full, 0, 2000)) << entry.name;
    }
  }
}

// Beams and subcubes have as many boxes as are wanted, or as there is room for.
TEST(Decompositions, MakeAsManyBoxesAsWanted) {
  const Index3 size = {13, 17, 31};
  const WorkField voxels = WorkField::Uniform(size);
  for (int boxes : {1, 2, 3, 7, 13, 64, 300, 3000, 7000}) {
    EXPECT_EQ(MakeSlabs({.work = &voxels, .boxes = boxes, .axis = Axis::kX}).boxes().size(), std::size_t(std::min(boxes, 13)));
    EXPECT_EQ(MakeBeams({.work = &voxels, .boxes = boxes, .axis = Axis::kX}).boxes().size(), std::size_t(std::min(boxes, 13 * 31)));
    EXPECT_EQ(MakeSubcubes({.work = &voxels, .boxes = boxes}).boxes().size(), std::size_t(std::min(boxes, 13 * 17 * 31)));
  }
  EXPECT_EQ(MakeOctree({.work = &voxels, .boxes = 9}).boxes().size(), 64U);
  EXPECT_EQ(MakeOctree({.work = &voxels, .boxes = 9, .most_boxes = 63}).boxes().size(), 8U);
}

TEST(Slabs, BeginWhereTheirShareOfSlicesDoes) {
  const Index3 size = {29, 64, 101};
  const WorkField voxels = WorkField::Uniform(size);
  for (Axis axis : kAxes) {
    const int slices = size[axis];
    for (int wanted = 1; wanted <= 130; ++wanted) {
      const Partition partition = MakeSlabs({.work = &voxels, .boxes = wanted, .axis = axis});
      const int slabs = std::min(wanted, slices);
      ASSERT_EQ(partition.boxes().size(), std::size_t(slabs));
      for (int i = 0; i < slabs; ++i) EXPECT_EQ(partition.boxes()[std::size_t(i)].begin[axis], i * slices / slabs);
    }
  }
}

// Whatever is cut, no plane is further from its share of the work than a slice.
TEST(Slabs, OfEqualWorkAreEqualUpToASlice) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    const Index3 size = {random.Integer(20, 90), random.Integer(20, 90), random.Integer(20, 90)};
    const WorkField work(RandomGrid(random, size));
    const Axis axis = kAxes[random.Integer<std::size_t>(0, 2)];
    const int boxes = random.Integer(2, 7);
    const Partition slabs = MakeSlabs({.work = &work, .boxes = boxes, .axis = axis});
    double before = 0;
    for (int slab = 0; slab + 1 < boxes; ++slab) {
      const Box& box = slabs.boxes()[std::size_t(slab)];
      before += work.Sum(box);
      Box slice = box;
      slice.begin[axis] = box.end[axis] - 1;
      slice.end[axis] = box.end[axis] + 1;
      if (box.size()[axis] > 1) {
        EXPECT_LE(std::abs(before - work.total() * (slab + 1) / boxes), work.Sum(slice) + 1e-9 * work.total());
      }
    }
  }
}

TEST(KdTree, CutsAwayNothingThatAnyBoxNeeds) {
  Random random(73);
  SCOPED_TRACE(random.trace());
  std::size_t cut_away = 0;
  for (int i = 0; i < 100; ++i) {
    const Index3 size = {random.Integer(1, 150), random.Integer(1, 150), random.Integer(1, 150)};
    const Box bounds = {{0, 0, 0}, size};
    const WorkField work(RandomGrid(random, size));
    const int boxes = random.Integer(1, 20);
    const Partition partition = MakeKdTree({.work = &work, .boxes = boxes, .halo = kHaloVoxels});
    double sum = 0;
    for (std::size_t box = 0; box < partition.boxes().size(); ++box) {
      sum += work.Sum(partition.boxes()[box]);
      if (box < std::size_t(boxes) && work.total() > 0) continue;
      ++cut_away;
      EXPECT_TRUE(work.Hull(Grown(partition.boxes()[box], kHaloVoxels, bounds)).empty()) << box << " of " << boxes;
    }
    EXPECT_NEAR(sum, work.total(), 1e-9 * work.total());
  }
  EXPECT_GT(cut_away, 100U);
}

TEST(KdTree, ShapesDifferInHowThinBoxesAreAlongTheFirstAxis) {
  const WorkField voxels = WorkField::Uniform({160, 160, 160});
  std::set<std::int32_t> thinnest;
  for (int shape = 0; shape < kKdTreeShapes; ++shape) {
    const Partition partition = MakeKdTree({.work = &voxels, .boxes = 16, .axis = Axis::kZ, .halo = kHaloVoxels, .shape = shape});
    std::int32_t height = 160;
    for (const Box& box : partition.boxes()) height = std::min(height, box.size().z);
    thinnest.insert(height);
  }
  EXPECT_EQ(thinnest, (std::set<std::int32_t>{10, 20, 40}));
}

TEST(KdTree, CutsOtherAxesWhereTheFirstOneHasOneSlice) {
  const WorkField work = WorkField::Uniform({4, 4, 2});
  for (const int boxes : {3, 8, 32}) {
    const Partition partition = MakeKdTree({.work = &work, .boxes = boxes, .most_boxes = 64, .axis = Axis::kZ});
    EXPECT_EQ(partition.boxes().size(), std::size_t(boxes));
  }
}

TEST(KdTree, HugsWhatIsOccupied) {
  // One occupied cell in the middle of 160^3 voxels.
  OccupancyGrid grid{{160, 160, 160}, std::vector<CellOccupancy>(20 * 20 * 20)};
  grid.cells[(10 * 20 + 10) * 20 + 10] = FullCell({{80, 80, 80}, {88, 88, 88}});
  const WorkField work(grid);
  const Partition partition = MakeKdTree({.work = &work, .boxes = 1, .halo = kHaloVoxels});
  EXPECT_EQ(partition.boxes()[0], (Box{{72, 72, 72}, {96, 96, 96}}));
  EXPECT_EQ(partition.boxes().size(), 7U);
}

// The boxes of a group are one subtree, so they follow one another in any view.
TEST(KdTree, KeepsGroupsTogether) {
  const WorkField work = WorkField::Uniform({100, 100, 100});
  Random random(74);
  SCOPED_TRACE(random.trace());
  const Partition partition = MakeKdTree({.work = &work, .boxes = 15, .together = 5});
  for (int i = 0; i < 30; ++i) {
    const std::vector<BoxId> order = VisibilityOrder(
        partition,
        MakeCamera({.azimuth_degrees = random.Real(0, 360), .elevation_degrees = random.Real(-90, 90)}, {64, 64}, {{100, 100, 100}}));
    for (std::size_t at = 0; at < order.size(); ++at) EXPECT_EQ(order[at] / 5, order[at / 5 * 5] / 5);
  }
}

TEST(Partition, RandomTreesTile) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const Box bounds = {{0, 0, 0}, {random.Integer(1, 40), random.Integer(1, 40), random.Integer(1, 40)}};
    ExpectTiles(RandomPartition(random, bounds, random.Integer(1, 60)), bounds);
  }
}

TEST(PartitionDeathTest, RefusesTreesThatDoNotTile) {
  const Box bounds = {{0, 0, 0}, {8, 8, 8}};
  const Node low = {.box = 0}, high = {.box = 1};
  const auto plane = [](std::int32_t position, std::uint32_t lower, std::uint32_t upper) {
    return Node{.leaf = false, .axis = Axis::kX, .position = position, .lower = lower, .upper = upper};
  };
  EXPECT_DEATH(Partition(bounds, {}), "");
  EXPECT_DEATH(Partition(bounds, {plane(0, 1, 2), low, high}), "position");  // an empty side
  EXPECT_DEATH(Partition(bounds, {plane(8, 1, 2), low, high}), "position");
  EXPECT_DEATH(Partition(bounds, {plane(4, 1, 1), low, high}), "two parents");
  EXPECT_DEATH(Partition(bounds, {plane(4, 1, 0), low}), "two parents");   // a cycle
  EXPECT_DEATH(Partition(bounds, {plane(4, 1, 3), low, high}), "number");  // no such node
  EXPECT_DEATH(Partition(bounds, {plane(4, 1, 2), low, low}), "two leaves");
  EXPECT_DEATH(Partition(bounds, {plane(4, 1, 2), low, {.box = 7}}), "leaf_count");
  EXPECT_DEATH(Partition(bounds, {low, high}), "hangs");
}

// ---------------------------------------------------------------- volumes in blocks

TEST(PartitionOfBlocks, TilesTheVolumeWithPlanesJustBeforeBlocks) {
  Random random(78);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 500; ++round) {
    Index3 block, size, blocks;
    for (const Axis axis : kAxes) {
      block[axis] = random.Integer(1, 64);
      size[axis] = random.Integer(1, 5 * block[axis]);
      blocks[axis] = (size[axis] - 1) / block[axis] + 1;
    }
    const Box bounds = {{0, 0, 0}, size};
    const std::int32_t before = random.Integer(0, 12);
    const Partition of_blocks = RandomPartition(random, {{0, 0, 0}, blocks}, random.Integer(1, 20));
    const Partition partition = of_blocks.OfBlocks(block, bounds, before);
    ExpectTiles(partition, bounds);
    ASSERT_EQ(partition.boxes().size(), of_blocks.boxes().size());
    for (std::size_t i = 0; i < partition.boxes().size(); ++i) {
      const Box &box = partition.boxes()[i], &counted = of_blocks.boxes()[i];
      for (const Axis axis : kAxes) {
        const std::int32_t shift = block[axis] > 2 * before ? before : 0;
        EXPECT_EQ(box.begin[axis], counted.begin[axis] == 0 ? 0 : counted.begin[axis] * block[axis] - shift);
        if (counted.end[axis] == blocks[axis]) continue;
        EXPECT_EQ(box.end[axis], counted.end[axis] * block[axis] - shift);
        if (shift > 0) {
          EXPECT_LE(box.end[axis] + before, counted.end[axis] * block[axis]) << "its halo ends with its blocks";
        }
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
