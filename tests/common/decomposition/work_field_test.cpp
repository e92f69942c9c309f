#include "common/decomposition/work_field.h"

#include <gtest/gtest.h>

#include "tests/support/random_box.h"

namespace slabstream {
namespace {

TEST(WorkField, SumsAreThoseOfItsCellsInProportion) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    const Index3 size = {random.Integer(1, 40), random.Integer(1, 40), random.Integer(1, 40)};
    const Index3 cells = OccupancyCells(size);
    std::vector<double> work(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z));
    for (double& w : work) w = random.Chance(0.5) ? 0 : random.Real(0, 3);
    const WorkField field(size, work);
    for (int j = 0; j < 20; ++j) {
      const Box box = RandomBox(random, {{0, 0, 0}, size});
      double expected = 0;
      Box hull;
      for (std::size_t n = 0; n < work.size(); ++n) {
        const Index3 at = {std::int32_t(n) % cells.x, std::int32_t(n) / cells.x % cells.y, std::int32_t(n) / cells.x / cells.y};
        const Box cell = OccupancyCellBox(at, size), part = Intersection(cell, box);
        if (work[n] == 0 || part.empty()) continue;
        expected += work[n] * double(part.voxel_count()) / double(cell.voxel_count());
        if (hull.empty()) hull = part;
        for (const Axis axis : kAxes) {
          hull.begin[axis] = std::min(hull.begin[axis], part.begin[axis]);
          hull.end[axis] = std::max(hull.end[axis], part.end[axis]);
        }
      }
      EXPECT_NEAR(field.Sum(box), expected, 1e-8 * (1 + field.total()));
      EXPECT_EQ(field.Hull(box), hull);
    }
  }
}

TEST(WorkField, OfUniformWorkCountsVoxels) {
  Random random(82);
  SCOPED_TRACE(random.trace());
  const Index3 size = {70, 20, 33};
  const WorkField field = WorkField::Uniform(size);
  for (int i = 0; i < 20; ++i) {
    const Box box = RandomBox(random, {{0, 0, 0}, size});
    EXPECT_EQ(field.Sum(box), double(box.voxel_count()));
    EXPECT_EQ(field.Hull(box), box);
  }
  EXPECT_EQ(field.Sum({{-5, -5, -5}, {100, 100, 100}}), 70.0 * 20 * 33);
  EXPECT_EQ(field.Sum({{5, 5, 5}, {5, 9, 9}}), 0);
}

TEST(WorkField, LosesNoWorkHoweverLittle) {
  const Index3 size = {16, 8, 8};
  const WorkField field(size, std::vector{1e300, 1e-300});
  EXPECT_EQ(field.Hull({{8, 0, 0}, {16, 8, 8}}), (Box{{8, 0, 0}, {16, 8, 8}}));
}

}  // namespace
}  // namespace slabstream
