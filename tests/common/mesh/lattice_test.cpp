#include "common/mesh/lattice.h"
#include "common/mesh/summarize_cells.h"
#include "common/parallel/task_arena.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "common/mesh/mesh_cell.h"
#include "tests/common/mesh/mesh_samples.h"

namespace slabstream {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

VolumeGeometry LatticeOfSize(const Index3& size) {
  VolumeGeometry lattice;
  lattice.size = size;
  return lattice;
}

double Linear(const Vec3& p) { return 3 + 2 * p.x - p.y + 0.5 * p.z; }
double NoField(const Vec3&) { return 0; }

TEST(Lattice, FillsTheBoundsWithVoxelsThatAreNearlyCubes) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 500; ++i) {
    Bounds3 bounds;
    const double scale = std::pow(10, random.Real(-29, 28));
    for (int axis = 0; axis < 3; ++axis) {
      bounds.low[axis] = scale * random.Real(-100, 100);
      bounds.high[axis] = bounds.low[axis] + scale * random.Real(0.1, 10);
    }
    const Vec3 extent = bounds.high - bounds.low;
    const double longest = std::max({extent.x, extent.y, extent.z});
    const std::int32_t side = random.Integer(1, kMaxLatticeSide);
    const VolumeGeometry lattice = LatticeOf(bounds, 1, side);
    EXPECT_EQ(std::max({lattice.size.x, lattice.size.y, lattice.size.z}), side);
    EXPECT_EQ(lattice.orientation.world, World::kScene);
    for (int axis = 0; axis < 3; ++axis) {
      const double tolerance = 1e-12 * (std::abs(bounds.low[axis]) + longest);
      EXPECT_NEAR(lattice.ToWorld({-0.5, -0.5, -0.5})[axis], bounds.low[axis], tolerance);
      EXPECT_NEAR(lattice.ToWorld(ToVec3(lattice.size) - Vec3{0.5, 0.5, 0.5})[axis], bounds.high[axis], tolerance);
      if (lattice.size[axis] > 1) {
        EXPECT_GE(lattice.spacing[axis], longest / side / 1.5);
        EXPECT_LE(lattice.spacing[axis], longest / side * 1.5);
      }
    }
  }
}

TEST(Lattice, HasTwoVoxelsForEachCellWithinLimits) {
  const Bounds3 bounds = {{0, 0, 0}, {4, 2, 1}};
  for (const std::int64_t cells : {20'000, 100'000, 500'000}) {
    const auto voxels = double(LatticeOf(bounds, cells, {}).bounds().voxel_count());
    EXPECT_NEAR(voxels / double(2 * cells), 1, 0.1);
  }
  EXPECT_EQ(LatticeOf(bounds, 1, {}).size, (Index3{32, 16, 8}));
  EXPECT_EQ(LatticeOf(bounds, 1'000'000'000, {}).size, (Index3{256, 128, 64}));
}

TEST(Lattice, PointsMoveToTheirPlaceInDataSpace) {
  Random random(82);
  SCOPED_TRACE(random.trace());
  const Bounds3 bounds = {{1e6, -7, 0.001}, {1e6 + 3, -2, 0.004}};
  const VolumeGeometry lattice = LatticeOf(bounds, 1000, {});
  Mesh mesh;
  std::vector<Vec3> world;
  for (int i = 0; i < 1000; ++i) {
    const auto along = [&] { return random.Chance(0.1) ? 0.0 : random.Chance(0.1) ? 1.0 : random.Real(0, 1); };
    const Vec3 inside = (bounds.high - bounds.low) * Vec3{along(), along(), along()};
    mesh.points.push_back({float(inside.x), float(inside.y), float(inside.z)});
    world.push_back(bounds.low + inside);
  }
  MoveToLattice(lattice, mesh);
  for (std::size_t i = 0; i < world.size(); ++i) {
    const Vec3 place = PlaceOfPoint(mesh, PointNumber(i)), back = lattice.ToWorld(place);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(place[axis], -0.5);
      EXPECT_LE(place[axis], lattice.size[axis] - 0.5);
      EXPECT_NEAR(back[axis], world[i][axis], 1e-6 * (bounds.high[axis] - bounds.low[axis]));
    }
  }
}

// A tetrahedron's places and values, whatever its points are numbered.
using CellContent = std::vector<std::array<float, 4>>;
CellContent ContentOf(const Mesh& mesh, std::size_t cell) {
  CellContent content;
  for (const PointNumber point : mesh.tetrahedra[cell]) {
    const auto& [x, y, z] = mesh.points[point];
    content.push_back({x, y, z, mesh.values[mesh.at == ValuesAt::kCells ? cell : point]});
  }
  return content;
}

TEST(SortByPlace, KeepsEveryCellAndBringsNeighboursTogether) {
  Random random(83);
  SCOPED_TRACE(random.trace());
  const Index3 size = {40, 30, 20};
  const Mesh cube = MakeTetrahedralCube(size, 8, random, 0.2, Linear);
  for (Mesh mesh : {cube, WithCellValues(cube, [](std::size_t cell) { return double(cell); })}) {
    std::map<CellContent, int> before;
    for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) ++before[ContentOf(mesh, cell)];
    // One point more than tetrahedra use.
    mesh.points.insert(mesh.points.begin(), {1, 2, 3});
    if (mesh.at == ValuesAt::kPoints) mesh.values.insert(mesh.values.begin(), 9);
    for (Tetrahedron& t : mesh.tetrahedra) {
      for (PointNumber& point : t) ++point;
    }
    const std::size_t points = mesh.points.size();
    SortByPlace(LatticeOfSize(size), mesh);
    EXPECT_EQ(mesh.points.size(), points - 1);
    EXPECT_EQ(mesh.values.size(), mesh.at == ValuesAt::kPoints ? points - 1 : mesh.tetrahedra.size());
    PointNumber next = 0;
    double steps = 0;
    for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
      const auto found = before.find(ContentOf(mesh, cell));
      ASSERT_NE(found, before.end());
      if (--found->second == 0) before.erase(found);
      for (const PointNumber point : mesh.tetrahedra[cell]) {
        ASSERT_LE(point, next);  // numbered by first use
        next = std::max(next, point + 1);
      }
      if (cell > 0) steps += Length(PlaceOfPoint(mesh, mesh.tetrahedra[cell][0]) - PlaceOfPoint(mesh, mesh.tetrahedra[cell - 1][0]));
    }
    EXPECT_TRUE(before.empty());
    EXPECT_LT(steps / double(mesh.tetrahedra.size()), 8);  // voxels; a row of eight hexahedra is 40 long
  }
}

TEST(Resample, GivesALinearFieldEverywhereInACubeOfAnyCells) {
  Random random(84);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 12; ++round) {
    const Index3 size = {random.Integer(1, 40), random.Integer(1, 40), random.Integer(1, 40)};
    const double jitter = random.Chance(0.3) ? 0 : 0.2;
    Mesh mesh = MakeTetrahedralCube(size, random.Integer(1, 9), random, jitter, Linear);
    if (random.Chance(0.5)) SortByPlace(LatticeOfSize(size), mesh);
    const Volume volume = Resample(mesh, LatticeOfSize(size));
    EXPECT_EQ(volume.description.type, ScalarType::kFloat32);
    const float* sample = volume.block.samples<float>();
    for (Index3 v; v.z < size.z; ++v.z) {
      for (v.y = 0; v.y < size.y; ++v.y) {
        for (v.x = 0; v.x < size.x; ++v.x) {
          EXPECT_NEAR(double(*sample++), Linear(ToVec3(v)), 2e-5) << v.x << " " << v.y << " " << v.z;
        }
      }
    }
  }
}

// The weights of a cell's points at a place, by Cramer's rule.
std::array<double, 4> WeightsAt(const Mesh& mesh, std::size_t cell, const Vec3& p) {
  const auto six_volumes = [](const std::array<Vec3, 4>& q) { return Dot(q[1] - q[0], Cross(q[2] - q[0], q[3] - q[0])); };
  std::array<Vec3, 4> places;
  for (std::size_t i = 0; i < 4; ++i) places[i] = PlaceOfPoint(mesh, mesh.tetrahedra[cell][i]);
  std::array<double, 4> weights;
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<Vec3, 4> with = places;
    with[i] = p;
    weights[i] = six_volumes(with) / six_volumes(places);
  }
  return weights;
}

// Tetrahedra anywhere, also beyond the lattice, of which some lie in others.
Mesh RandomTetrahedra(Random& random, const Index3& size, int count) {
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3 centre = {random.Real(0, size.x), random.Real(0, size.y), random.Real(0, size.z)};
    const double reach = random.Chance(0.2) ? 30 : 5;
    for (int corner = 0; corner < 4; ++corner) {
      const auto along = [&](double c) { return float(c + random.Real(-reach, reach)); };
      mesh.points.push_back({along(centre.x), along(centre.y), along(centre.z)});
      mesh.values.push_back(float(random.Real(0, 100)));
    }
    const auto first = PointNumber(4 * i);
    mesh.tetrahedra.push_back({first, first + 1, first + 2, first + 3});
  }
  return mesh;
}

TEST(Resample, GivesEachVoxelToTheLastCellThatContainsIt) {
  Random random(85);
  SCOPED_TRACE(random.trace());
  const Index3 size = {37, 29, 33};
  const Mesh of_points = RandomTetrahedra(random, size, 60);
  for (const Mesh& mesh : {of_points, WithCellValues(of_points, [](std::size_t cell) { return double(cell); })}) {
    const Volume volume = Resample(mesh, LatticeOfSize(size));
    std::int64_t filled = 0;
    for (std::size_t i = 0; i < CountIn(size); ++i) {
      const float sample = volume.block.samples<float>()[i];
      filled += std::isfinite(sample) ? 1 : 0;
      double expected = double{kNan};
      bool unclear = false;  // too near to a face to be sure
      for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
        const std::array<double, 4> w = WeightsAt(mesh, cell, ToVec3(PlaceIn(size, i)));
        const double least = *std::ranges::min_element(w);
        unclear |= std::abs(least) < 1e-7;
        if (least < 0) continue;
        expected = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          expected += w[k] * double(mesh.values[mesh.at == ValuesAt::kCells ? cell : mesh.tetrahedra[cell][k]]);
        }
      }
      if (unclear) continue;
      ASSERT_EQ(std::isfinite(sample), std::isfinite(expected));
      if (std::isfinite(expected)) {
        ASSERT_NEAR(double(sample), expected, 1e-4);
      }
    }
    EXPECT_GT(filled, 1000);
    EXPECT_LT(filled, std::int64_t(CountIn(size)));
  }
}

// Faces, edges and corners of these cells lie on the centres of voxels.
TEST(Resample, CentresOnOuterFacesAreInside) {
  Mesh mesh;
  const Index3 size = {12, 12, 12};
  mesh.points = {{1, 1, 1}, {9, 1, 1}, {1, 9, 1}, {1, 1, 9}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  for (PointNumber point = 0; point < 4; ++point) mesh.values.push_back(float(Linear(PlaceOfPoint(mesh, point))));
  const Volume volume = Resample(mesh, LatticeOfSize(size));
  for (std::size_t i = 0; i < CountIn(size); ++i) {
    const Index3 v = PlaceIn(size, i);
    const bool inside = v.x >= 1 && v.y >= 1 && v.z >= 1 && v.x + v.y + v.z <= 11;
    EXPECT_EQ(std::isfinite(volume.block.samples<float>()[i]), inside) << v.x << " " << v.y << " " << v.z;
    if (inside) {
      EXPECT_NEAR(double(volume.block.samples<float>()[i]), Linear(ToVec3(v)), 1e-5);
    }
  }
}

TEST(Resample, FlatCellsAndThoseWithAValueThatIsNotFiniteShowNothing) {
  Mesh mesh;
  const Index3 size = {12, 12, 12};
  mesh.points = {{1, 1, 1}, {9, 1, 1}, {1, 9, 1}, {9, 9, 1}, {5, 5, 9}};
  mesh.values = {1, 2, 3, 4, 5};
  const auto finite = [&] {
    const Volume volume = Resample(mesh, LatticeOfSize(size));
    return std::int64_t(std::count_if(volume.block.samples<float>(), volume.block.samples<float>() + CountIn(size),
                                      [](float sample) { return std::isfinite(sample); }));
  };
  mesh.tetrahedra = {{0, 1, 2, 3}};  // on the centres of a layer
  EXPECT_EQ(finite(), 0);
  mesh.tetrahedra = {{0, 1, 2, 4}};
  const std::int64_t of_one = finite();
  EXPECT_GT(of_one, 50);
  mesh.tetrahedra.push_back({0, 1, 2, 3});  // hides nothing of the first, of which it covers a face
  EXPECT_EQ(finite(), of_one);
  for (const float value : {kNan, kInfinity, -kInfinity}) {
    mesh.values[4] = value;
    EXPECT_EQ(finite(), 0);
  }
}

bool SameBytes(const VoxelBlock& a, const VoxelBlock& b) {
  return a.bytes.size() == b.bytes.size() && std::memcmp(a.bytes.data(), b.bytes.data(), a.bytes.size()) == 0;
}

TEST(Lattice, ResultsAreTheSameForAnyNumberOfThreads) {
  Random random(86);
  SCOPED_TRACE(random.trace());
  const Index3 size = {50, 60, 40};
  const Mesh cube = MakeTetrahedralCube(size, 10, random, 0.2, [&](const Vec3&) { return random.Real(0, 1); });
  const auto make = [&] {
    Mesh mesh = cube;
    SortByPlace(LatticeOfSize(size), mesh);
    Volume volume = Resample(mesh, LatticeOfSize(size));
    VolumeSummary summary = Summarize(volume);
    SummarizeCells(mesh, volume, summary);
    return std::tuple(std::move(mesh.tetrahedra), std::move(volume.block), std::move(summary));
  };
  const auto [tetrahedra, block, summary] = make();
  const ThreadLimit one_thread(1);
  const auto [tetrahedra_of_one, block_of_one, summary_of_one] = make();
  EXPECT_EQ(tetrahedra, tetrahedra_of_one);
  EXPECT_TRUE(SameBytes(block, block_of_one));
  EXPECT_EQ(summary, summary_of_one);
}

TEST(SummarizeCells, BricksKnowTheValuesOfAllCellsThatTouchThem) {
  Random random(87);
  SCOPED_TRACE(random.trace());
  const Index3 size = {50, 35, 40};
  Mesh of_points = MakeTetrahedralCube(size, 6, random, 0.2, [&](const Vec3&) { return random.Real(-5, 5); });
  of_points.values[20] = kNan;
  of_points.values[50] = kInfinity;
  Mesh of_cells = WithCellValues(of_points, [&](std::size_t) { return random.Real(-5, 5); });
  of_cells.values[20] = kNan;
  for (const Mesh& mesh : {of_points, of_cells}) {
    const Volume volume = Resample(mesh, LatticeOfSize(size));
    VolumeSummary summary = Summarize(volume);
    const std::int64_t non_finite = summary.non_finite;
    SummarizeCells(mesh, volume, summary);
    EXPECT_GT(non_finite, 0);
    EXPECT_EQ(summary.non_finite, non_finite);
    std::vector<ValueRange> bricks(summary.bricks.size(), kNoFiniteValue);
    std::vector<std::uint32_t> cells(bricks.size());
    ValueRange whole = kNoFiniteValue;
    const auto include = [](ValueRange& range, float value) {
      range = range.min > range.max ? ValueRange{value, value} : ValueRange{std::min(range.min, value), std::max(range.max, value)};
    };
    for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
      CellContent content = ContentOf(mesh, cell);
      if (std::ranges::any_of(content, [](const auto& corner) { return !std::isfinite(corner[3]); })) continue;
      for (std::size_t brick = 0; brick < bricks.size(); ++brick) {
        const Index3 begin = kBrick * PlaceIn(summary.brick_counts, brick), end = Min(begin + Uniform(kBrick), size);
        bool touches = true;
        for (int axis = 0; axis < 3; ++axis) {
          const auto [low, high] = std::ranges::minmax(content, {}, [&](const auto& corner) { return corner[std::size_t(axis)]; });
          touches = touches && low[std::size_t(axis)] <= float(end[axis]) - 0.5F && high[std::size_t(axis)] >= float(begin[axis]) - 0.5F;
        }
        for (const auto& corner : content) {
          if (touches) include(bricks[brick], corner[3]);
        }
        const auto centre_within = [&](int axis) {
          const auto [low, high] = std::ranges::minmax(content, {}, [&](const auto& corner) { return corner[std::size_t(axis)]; });
          const double centre = (double(low[std::size_t(axis)]) + double(high[std::size_t(axis)])) / 2;
          return centre >= begin[axis] - 0.5 && centre < end[axis] - 0.5;
        };
        if (centre_within(0) && centre_within(1) && centre_within(2)) ++cells[brick];
      }
      for (const auto& corner : content) include(whole, corner[3]);
    }
    EXPECT_EQ(summary.bricks, bricks);
    EXPECT_EQ(summary.range, whole);
    EXPECT_EQ(summary.cells, cells);
    std::array<std::uint64_t, kHistogramBins> histogram{};
    for (std::size_t i = 0; i < CountIn(size); ++i) {
      const float sample = volume.block.samples<float>()[i];
      if (std::isfinite(sample)) ++histogram[std::size_t(HistogramBin(whole, double(sample)))];
    }
    EXPECT_EQ(summary.histogram, histogram);
  }
}

TEST(SummarizeCells, WithoutAnyFiniteValueHasNoRange) {
  Random random(88);
  const Index3 size = {20, 20, 20};
  const Mesh mesh = WithCellValues(MakeTetrahedralCube(size, 2, random, 0, NoField), [](std::size_t) { return double{kNan}; });
  const Volume volume = Resample(mesh, LatticeOfSize(size));
  VolumeSummary summary = Summarize(volume);
  SummarizeCells(mesh, volume, summary);
  EXPECT_EQ(summary.range, (ValueRange{0, 0}));
  EXPECT_EQ(summary.non_finite, std::int64_t(CountIn(size)));
  EXPECT_TRUE(std::ranges::all_of(summary.bricks, [](const ValueRange& brick) { return brick == kNoFiniteValue; }));
}

}  // namespace
}  // namespace slabstream
