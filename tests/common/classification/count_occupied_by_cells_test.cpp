#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/classification/count_occupied.h"
#include "common/mesh/lattice.h"
#include "tests/common/classification/occupied_grid.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/random.h"
#include "tests/support/random_transfer.h"

namespace slabstream {
namespace {

struct Subject {
  Mesh mesh;
  Volume resampled;
  ClassificationTable table;

  bool Visible(float value) const { return std::isfinite(value) && table.opacity[std::size_t(table.BinOf(double(value)))] > 0; }
};

// A cube with holes, values in [0, 100] and a few that are not finite.
Subject MakeSubject(Random& random) {
  Subject subject;
  const Index3 size = {random.Integer(1, 26), random.Integer(1, 26), random.Integer(1, 26)};
  const double slope = random.Real(0, 4);
  Mesh& mesh = subject.mesh;
  mesh = MakeTetrahedralCube(size, random.Integer(1, 5), random, 0.2,
                             [&](const Vec3& p) { return std::clamp(50 + slope * (p.x - p.y + p.z) + random.Real(-5, 5), 0.0, 100.0); });
  std::erase_if(mesh.tetrahedra, [&](const Tetrahedron&) { return random.Chance(0.1); });
  if (random.Chance(0.5)) mesh = WithCellValues(mesh, [&](std::size_t) { return random.Real(0, 100); });
  for (float& value : mesh.values) {
    if (random.Chance(0.02)) value = std::numeric_limits<float>::quiet_NaN();
  }
  VolumeGeometry lattice;
  lattice.size = size;
  subject.resampled = Resample(mesh, lattice);
  subject.table = Classify(RandomTransfer(random), subject.resampled.description, {0, 100});
  return subject;
}

TEST(CountOccupiedByCells, TakesTheVoxelsThatCellsOfVisibleValuesTouch) {
  Random random(95);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 40; ++round) {
    const Subject subject = MakeSubject(random);
    const Mesh& mesh = subject.mesh;
    const Index3 size = subject.resampled.block.box.end;
    std::vector<bool> occupied(CountIn(size));
    for (std::size_t number = 0; number < mesh.tetrahedra.size(); ++number) {
      const Tetrahedron& t = mesh.tetrahedra[number];
      std::vector<float> values;
      for (const PointNumber point : t) values.push_back(mesh.values[mesh.at == ValuesAt::kCells ? number : point]);
      if (std::ranges::any_of(values, [](float value) { return !std::isfinite(value); })) continue;
      const auto [least, greatest] = std::ranges::minmax(values);
      bool visible = false;
      for (int bin = subject.table.BinOf(double(least)); bin <= subject.table.BinOf(double(greatest)); ++bin) {
        visible = visible || subject.table.opacity[std::size_t(bin)] > 0;
      }
      if (!visible) continue;
      for (std::size_t i = 0; i < occupied.size(); ++i) {
        const Index3 v = PlaceIn(size, i);
        bool touches = true;
        for (int axis = 0; axis < 3; ++axis) {
          touches = touches && std::ranges::any_of(t, [&](PointNumber p) { return double(mesh.points[p][axis]) >= v[axis] - 0.5; }) &&
                    std::ranges::any_of(t, [&](PointNumber p) { return double(mesh.points[p][axis]) <= v[axis] + 0.5; });
        }
        if (touches) occupied[i] = true;
      }
    }
    EXPECT_EQ(CountOccupiedByCells(mesh, subject.resampled.description, subject.table), GridOf(size, occupied));
  }
}

TEST(CountOccupiedByCells, HoldsWhateverIsSeenOfTheGridAndOfItsVolume) {
  Random random(96);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 40; ++round) {
    const Subject subject = MakeSubject(random);
    const Mesh& mesh = subject.mesh;
    const Index3 size = subject.resampled.block.box.end;
    const OccupancyGrid grid = CountOccupiedByCells(mesh, subject.resampled.description, subject.table);
    const auto line_is_occupied = [&](const Index3& v) {
      const CellOccupancy& cell = grid.cells[NumberIn(OccupancyCells(size), v / kOccupancyCell)];
      return (cell.lines_x >> (8 * (v.z % 8) + v.y % 8) & 1) != 0 && (cell.lines_y >> (8 * (v.z % 8) + v.x % 8) & 1) != 0;
    };
    // Voxels of the resampled volume, which is drawn under the same occupancy.
    for (std::size_t i = 0; i < CountIn(size); ++i) {
      if (subject.Visible(subject.resampled.block.samples<float>()[i])) {
        EXPECT_TRUE(line_is_occupied(PlaceIn(size, i)));
      }
    }
    // Places in cells.
    for (std::size_t number = 0; number < mesh.tetrahedra.size(); ++number) {
      const Tetrahedron& t = mesh.tetrahedra[number];
      std::array<double, 4> weights;
      double sum = 0;
      for (double& weight : weights) sum += weight = random.Real(0, 1);
      Vec3 place;
      double value = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        place = place + weights[i] / sum * PlaceOfPoint(mesh, t[i]);
        value += weights[i] / sum * double(mesh.values[mesh.at == ValuesAt::kCells ? number : t[i]]);
      }
      if (!subject.Visible(float(value))) continue;
      Index3 voxel;
      for (int axis = 0; axis < 3; ++axis) voxel[axis] = std::clamp(std::int32_t(std::lround(place[axis])), 0, size[axis] - 1);
      EXPECT_TRUE(line_is_occupied(voxel));
    }
  }
}

}  // namespace
}  // namespace slabstream
