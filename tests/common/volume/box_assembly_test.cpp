// Boxes put together from others: every voxel comes from exactly one place.
#include "common/volume/box_assembly.h"

#include <gtest/gtest.h>

#include <tuple>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 9;

Box AnyBox(Random& random) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.begin[axis] = random.Integer(0, kSide);
    box.end[axis] = random.Integer(0, kSide);  // empty boxes, too
  }
  return box;
}

template <class Function>
void ForEachVoxel(Function&& function) {
  for (Index3 v; v.z < kSide; ++v.z) {
    for (v.y = 0; v.y < kSide; ++v.y) {
      for (v.x = 0; v.x < kSide; ++v.x) function(v);
    }
  }
}

TEST(Difference, IsAtMostSixBoxesThatTileWhatLiesOutside) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 2000; ++round) {
    const Box whole = AnyBox(random), hole = AnyBox(random);
    const std::vector<Box> pieces = Difference(whole, hole);
    EXPECT_LE(pieces.size(), 6U);
    for (const Box& piece : pieces) EXPECT_FALSE(piece.empty());
    ForEachVoxel([&](const Index3& v) {
      int pieces_there = 0;
      for (const Box& piece : pieces) pieces_there += piece.Contains(v) ? 1 : 0;
      ASSERT_EQ(pieces_there, whole.Contains(v) && !hole.Contains(v) ? 1 : 0) << "round " << round;
    });
  }
}

TEST(Assemble, TakesEachVoxelOnceAndMissesNoneThatIsAtHand) {
  Random random(52);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 1000; ++round) {
    const Box wanted = AnyBox(random);
    std::vector<Box> at_hand(std::size_t(random.Integer(0, 6)));
    for (Box& box : at_hand) box = AnyBox(random);
    const BoxAssembly assembly = Assemble(wanted, at_hand);
    std::int64_t missing_voxels = 0;
    ForEachVoxel([&](const Index3& v) {
      int copied = 0, missing = 0;
      for (const BoxAssembly::Part& part : assembly.copied) {
        if (!part.box.Contains(v)) continue;
        ++copied;
        ASSERT_TRUE(at_hand.at(part.source).Contains(v)) << "round " << round;
      }
      for (const Box& box : assembly.missing) missing += box.Contains(v) ? 1 : 0;
      bool held = false;
      for (const Box& box : at_hand) held = held || box.Contains(v);
      ASSERT_EQ(copied, wanted.Contains(v) && held ? 1 : 0) << "round " << round;
      ASSERT_EQ(missing, wanted.Contains(v) && !held ? 1 : 0) << "round " << round;
      missing_voxels += missing;
    });
    EXPECT_EQ(assembly.missing_voxels(), missing_voxels);
  }
}

TEST(Assemble, LeavesNoMoreBoxesMissingThanItMay) {
  Random random(53);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 1000; ++round) {
    const Box wanted = AnyBox(random);
    std::vector<Box> at_hand(std::size_t(random.Integer(0, 6)));
    for (Box& box : at_hand) box = AnyBox(random);
    const auto most = random.Integer<std::size_t>(1, 5);
    const BoxAssembly assembly = Assemble(wanted, at_hand, most);
    EXPECT_LE(assembly.missing.size(), most) << "round " << round;
    ForEachVoxel([&](const Index3& v) {
      int places = 0;
      for (const BoxAssembly::Part& part : assembly.copied) places += part.box.Contains(v) ? 1 : 0;
      for (const Box& box : assembly.missing) places += box.Contains(v) ? 1 : 0;
      ASSERT_EQ(places, wanted.Contains(v) ? 1 : 0) << "round " << round;
    });
  }
}

TEST(Assemble, TakesItAllFromWhoHasItAll) {
  const Box wanted{{2, 2, 2}, {6, 6, 6}};
  const std::vector<Box> at_hand = {{{0, 0, 0}, {4, 9, 9}}, {{1, 1, 1}, {8, 8, 8}}, {{4, 0, 0}, {9, 9, 9}}};
  EXPECT_EQ(Assemble(wanted, at_hand), (BoxAssembly{{{1, wanted}}, {}}));
}

TEST(CutAtBlocksTest, PiecesTileTheBoxAndEndAtBlocks) {
  Random random(53);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 2000; ++round) {
    const Box box = AnyBox(random);
    const Index3 block = {random.Integer(1, 12), random.Integer(1, 12), random.Integer(1, 12)};
    const std::vector<Box> pieces = CutAtBlocks(box, block);
    std::int64_t voxels = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const Box& piece = pieces[i];
      ASSERT_FALSE(piece.empty());
      ASSERT_TRUE(box.Contains(piece));
      voxels += piece.voxel_count();
      for (const Axis axis : kAxes) {
        ASSERT_EQ(piece.begin[axis] / block[axis], (piece.end[axis] - 1) / block[axis]) << "in one block";
        ASSERT_TRUE(piece.begin[axis] == box.begin[axis] || piece.begin[axis] % block[axis] == 0);
        ASSERT_TRUE(piece.end[axis] == box.end[axis] || piece.end[axis] % block[axis] == 0);
      }
      if (i == 0) continue;
      const auto order = [](const Box& b) { return std::tuple(b.begin.z, b.begin.y, b.begin.x); };
      ASSERT_LT(order(pieces[i - 1]), order(piece)) << "x fastest, and none twice";
    }
    ASSERT_EQ(voxels, box.empty() ? 0 : box.voxel_count());
  }
}

}  // namespace
}  // namespace slabstream
