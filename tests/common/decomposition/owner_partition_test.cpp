// Partitions of volumes whose voxels have owners, and which boxes lie in front of which.
#include "common/decomposition/owner_partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "common/volume/indices.h"
#include "tests/common/decomposition/random_partition.h"
#include "tests/common/view/view_limits.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

bool AnyFits(const Box&) { return true; }

std::uint32_t OwnerAt(std::span<const OwnedBox> owned, const Index3& voxel) {
  return std::ranges::find_if(owned, [&](const OwnedBox& each) { return each.box.Contains(voxel); })->owner;
}

void ExpectOwnersStay(const OwnerPartition& made, std::span<const OwnedBox> owned, const Box& bounds) {
  ASSERT_EQ(made.partition.bounds(), bounds);
  ASSERT_EQ(made.owners.size(), made.partition.boxes().size());
  std::int64_t voxels = 0;
  for (BoxId id = 0; id < made.owners.size(); ++id) {
    for (const Index3& voxel : IndicesIn(made.partition.boxes()[id])) ASSERT_EQ(OwnerAt(owned, voxel), made.owners[id]);
    voxels += made.partition.boxes()[id].voxel_count();
  }
  EXPECT_EQ(voxels, bounds.voxel_count());
}

OwnedBoxes RandomOwned(Random& random, const Box& bounds, int boxes, std::uint32_t owners) {
  OwnedBoxes owned;
  const Partition partition = RandomPartition(random, bounds, boxes);
  for (const Box& box : partition.boxes()) owned.push_back({box, random.Integer(0U, owners - 1)});
  return owned;
}

// Three beams round a corner, each in front of the next one seen along the diagonal, and what is left of the cube. No plane passes between
// the beams.
OwnedBoxes Pinwheel() {
  return {{{{0, 0, 0}, {2, 1, 1}}, 0}, {{{2, 0, 0}, {3, 2, 1}}, 1}, {{{0, 0, 1}, {1, 2, 3}}, 2}, {{{1, 0, 1}, {3, 1, 3}}, 3},
          {{{0, 1, 0}, {1, 3, 1}}, 4}, {{{1, 1, 0}, {2, 2, 1}}, 5}, {{{1, 2, 0}, {3, 3, 2}}, 6}, {{{0, 2, 1}, {1, 3, 3}}, 7},
          {{{1, 1, 1}, {3, 2, 3}}, 8}, {{{1, 2, 2}, {3, 3, 3}}, 9}};
}

TEST(OwnerPartition, GivesEachBoxOneOwnerAndCutsNoneInVain) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const Box bounds = {{0, 0, 0}, {random.Integer(1, 20), random.Integer(1, 20), random.Integer(1, 20)}};
    const OwnedBoxes owned = RandomOwned(random, bounds, random.Integer(1, 40), random.Integer(1U, 6U));
    const OwnerPartition made = DivideByOwners(bounds, owned, AnyFits);
    ExpectOwnersStay(made, owned, bounds);
    // Planes pass between the boxes of a kd-tree.
    EXPECT_LE(made.owners.size(), owned.size());
  }
}

TEST(OwnerPartition, CutsWhatHasNoOrder) {
  const Box bounds = {{0, 0, 0}, {3, 3, 3}};
  const OwnedBoxes owned = Pinwheel();
  const OwnerPartition made = DivideByOwners(bounds, owned, AnyFits);
  ExpectOwnersStay(made, owned, bounds);
  EXPECT_GT(made.owners.size(), owned.size());
}

TEST(OwnerPartition, JoinsNeighboursOfOneOwnerAndHalvesWhatDoesNotFit) {
  const Box bounds = {{0, 0, 0}, {4, 4, 4}};
  const OwnedBoxes owned = {{{{0, 0, 0}, {2, 4, 4}}, 7}, {{{2, 0, 0}, {4, 4, 4}}, 7}};
  const OwnerPartition joined = DivideByOwners(bounds, OwnedBoxes(owned.begin(), owned.begin() + 2), AnyFits);
  EXPECT_EQ(joined.owners, (std::vector<std::uint32_t>{7}));
  const OwnerPartition halved = DivideByOwners(bounds, owned, [](const Box& box) { return box.voxel_count() <= 16; });
  EXPECT_EQ(halved.owners, (std::vector<std::uint32_t>{7, 7, 7, 7}));
  ExpectOwnersStay(halved, owned, bounds);
}

TEST(OwnerPartitionDeathTest, RefusesGapsAndOverlaps) {
  const Box bounds = {{0, 0, 0}, {4, 4, 4}};
  EXPECT_DEATH(DivideByOwners(bounds, OwnedBoxes{{{{0, 0, 0}, {4, 4, 3}}, 0}}, AnyFits), "leave a gap");
  EXPECT_DEATH(DivideByOwners(bounds, OwnedBoxes{{{{0, 0, 0}, {4, 4, 3}}, 0}, {{{0, 0, 0}, {4, 4, 1}}, 1}}, AnyFits), "overlap");
  EXPECT_DEATH(DivideByOwners(bounds, OwnedBoxes{{{{0, 0, 0}, {4, 4, 5}}, 0}}, AnyFits), "reaches outside");
}

TEST(TouchingBoxes, AreAllThatHaveAPointInCommon) {
  Random random(63);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    const Partition partition = RandomPartition(random, {{0, 0, 0}, {12, 9, 7}}, random.Integer(1, 60));
    std::vector<TouchingBoxes> expected;
    for (BoxId first = 0; first < partition.boxes().size(); ++first) {
      for (BoxId second = first + 1; second < partition.boxes().size(); ++second) {
        const Box common = Intersection(partition.boxes()[first], partition.boxes()[second]);
        if (common.begin.x <= common.end.x && common.begin.y <= common.end.y && common.begin.z <= common.end.z) {
          expected.push_back({first, second});
        }
      }
    }
    EXPECT_EQ(FindTouching(partition), expected);
  }
}

// Boxes that are ordered by what touches alone: a ray passes them in that order.
TEST(TouchingBoxes, TellTheOrderOfAll) {
  Random random(64);
  SCOPED_TRACE(random.trace());
  const VolumeGeometry geometry = {{24, 17, 31}, {1, 2, 0.5}};
  for (int i = 0; i < 300; ++i) {
    const Partition partition = RandomPartition(random, geometry.bounds(), 40);
    ViewParameters view;
    view.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
    view.azimuth_degrees = i % 3 == 0 ? 45 * random.Integer(0, 7) : random.Real(0, 360);
    view.elevation_degrees = i % 3 == 0 ? 45 * random.Integer(-2, 2) : random.Real(-90, 90);
    view.fov_degrees = kMaxFovDegrees;
    Camera camera = MakeCamera(view, {64, 64}, geometry);
    if (i % 5 == 0) camera.eye = {random.Real(0, 24), random.Real(0, 17), random.Integer(0, 31) - 0.5};  // inside, and on a plane
    const std::vector<BoxId> order = VisibilityOrder(partition, camera);
    std::vector<std::size_t> place(order.size());
    for (std::size_t at = 0; at < order.size(); ++at) place[order[at]] = at;
    std::size_t passages = 0;
    for (const auto& [first, second] : FindTouching(partition)) {
      const Box &a = partition.boxes()[first], &b = partition.boxes()[second];
      const Passage passage = PassageBetween(a, b, camera);
      // The tree's order heeds each passage, so that these have no cycle.
      if (passage == Passage::kFromFirst) {
        EXPECT_LT(place[first], place[second]);
      }
      if (passage == Passage::kFromSecond) {
        EXPECT_GT(place[first], place[second]);
      }
      passages += passage != Passage::kNone ? 1U : 0U;
      EXPECT_EQ(PassageBetween(b, a, camera), passage == Passage::kNone        ? Passage::kNone
                                              : passage == Passage::kFromFirst ? Passage::kFromSecond
                                                                               : Passage::kFromFirst);
    }
    EXPECT_GT(passages, 0U);
    // Where a ray leaves one box and enters the next, there is a passage.
    for (int rays = 0; rays < 20; ++rays) {
      const Vec3 target = {random.Real(0, 23), random.Real(0, 16), random.Real(0, 30)};
      Camera::Ray ray = {camera.eye, target - camera.eye};
      if (camera.projection == Projection::kOrthographic) {
        const auto at = camera.Project(target);
        ray = camera.RayAt(at.x, at.y);
      }
      // Positions along the ray inside the volume, close to each other.
      const Box* last = nullptr;
      const double reach = 200 / Length(ray.direction);
      for (double t = reach / 8000; t < reach; t += reach / 8000) {
        const Vec3 p = ray.origin + t * ray.direction;
        const Index3 voxel = {int(std::floor(p.x + 0.5)), int(std::floor(p.y + 0.5)), int(std::floor(p.z + 0.5))};
        if (!geometry.bounds().Contains(voxel)) continue;
        const Box* box = &*std::ranges::find_if(partition.boxes(), [&](const Box& each) { return each.Contains(voxel); });
        if (last != nullptr && box != last) {
          EXPECT_EQ(PassageBetween(*last, *box, camera), Passage::kFromFirst);
        }
        last = box;
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
