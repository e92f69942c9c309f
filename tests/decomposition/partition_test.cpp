#include "common/decomposition/partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "common/decomposition/decomposition.h"
#include "tests/decomposition/random_partition.h"
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

VolumeSummary SummaryOf(Index3 size) {
  VolumeSummary summary;
  summary.description.geometry.size = size;
  return summary;
}

TEST(Decompositions, EveryOneTilesTheVolumeForEveryNumberOfBoxes) {
  for (const DecompositionEntry& entry : Decompositions()) {
    EXPECT_EQ(FindDecomposition(entry.name), &entry);
    for (const Index3& size : {Index3{1, 1, 1}, Index3{64, 3, 7}, Index3{13, 17, 31}, Index3{5, 1, 100}}) {
      const VolumeSummary summary = SummaryOf(size);
      for (Axis axis : kAxes) {
        for (int boxes : {1, 2, 3, 5, 7, 8, 13, 31, 64, 97, 1000}) {
          SCOPED_TRACE(testing::Message() << entry.name << " " << size.x << "x" << size.y << "x" << size.z << " " << Letter(axis) << " "
                                          << boxes);
          const Partition partition = entry.make({&summary, boxes, axis});
          EXPECT_LE(partition.boxes().size(), std::size_t(boxes));
          ExpectTiles(partition, summary.description.geometry.bounds());
        }
      }
    }
  }
  EXPECT_EQ(FindDecomposition("nonsense"), nullptr);
}

TEST(Slabs, DifferByAtMostOneSliceAndAscendAlongTheAxis) {
  const VolumeSummary summary = SummaryOf({29, 64, 101});
  for (Axis axis : kAxes) {
    const int slices = summary.description.geometry.size[axis];
    for (int wanted = 1; wanted <= 130; ++wanted) {
      const Partition partition = MakeSlabs({&summary, wanted, axis});
      ASSERT_EQ(partition.boxes().size(), std::size_t(std::min(wanted, slices)));
      int thinnest = slices, thickest = 0, next = 0;
      for (const Box& box : partition.boxes()) {
        EXPECT_EQ(box.begin[axis], next);
        next = box.end[axis];
        thinnest = std::min(thinnest, box.size()[axis]);
        thickest = std::max(thickest, box.size()[axis]);
      }
      EXPECT_LE(thickest - thinnest, 1);
    }
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

}  // namespace
}  // namespace slabstream
