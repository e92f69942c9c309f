// Cells that are sorted on disk: the same parts, lattice and ranges as of the same grid in memory, bit for bit; and damage is noticed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <utility>

#include "common/mesh/lattice.h"
#include "common/mesh/mesh_part.h"
#include "data/cell_store/store_cells.h"
#include "data/cell_store/stored_cells.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A grid as readers find it: places in the world, cells in any order, points of no cell.
struct Grid {
  std::vector<MeshPoint> points;
  std::vector<Tetrahedron> cells;
  std::vector<float> values;  // of the cells; empty: points have them
  Bounds3 bounds;
  VolumeGeometry lattice;

  ValuesAt at() const { return values.empty() ? ValuesAt::kPoints : ValuesAt::kCells; }
};

Grid SomeGrid(Random& random, bool of_cells) {
  const Index3 size = {random.Integer(3, 40), random.Integer(3, 40), random.Integer(3, 40)};
  const Mesh mesh = MakeTetrahedralCube(size, random.Integer(2, 11), random, 0.2, [&](const Vec3&) { return random.Real(-1, 1); });
  Grid grid;
  const Vec3 low = {random.Real(-1e3, 1e3), random.Real(-1, 1), 0}, scale = {random.Real(0.1, 9), 1, random.Real(0.1, 2)};
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Vector3<float>& p = mesh.points[i];
    const double value = of_cells ? 0 : random.Chance(0.01) ? std::numeric_limits<double>::quiet_NaN() : double(mesh.values[i]);
    grid.points.push_back({low.x + scale.x * double(p.x), low.y + scale.y * double(p.y), low.z + scale.z * double(p.z), value});
  }
  grid.points.push_back(grid.points.front());  // of no cell
  grid.cells = mesh.tetrahedra;
  for (std::size_t i = grid.cells.size(); i > 1; --i) std::swap(grid.cells[i - 1], grid.cells[random.Integer<std::size_t>(0, i - 1)]);
  if (of_cells) {
    for (std::size_t i = 0; i < grid.cells.size(); ++i) {
      grid.values.push_back(random.Chance(0.01) ? std::numeric_limits<float>::infinity() : float(random.Real(-1, 1)));
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = [&](const MeshPoint& point) { return point[std::size_t(axis)]; };
    grid.bounds.low[axis] = along(*std::ranges::min_element(grid.points, {}, along));
    grid.bounds.high[axis] = along(*std::ranges::max_element(grid.points, {}, along));
  }
  grid.lattice = LatticeOf(grid.bounds, std::int64_t(grid.cells.size()), random.Integer(5, 50));
  return grid;
}

Mesh InMemory(const Grid& grid) {
  Mesh mesh;
  mesh.at = grid.at();
  for (const auto& [x, y, z, value] : grid.points) {
    mesh.points.push_back({float(x - grid.bounds.low.x), float(y - grid.bounds.low.y), float(z - grid.bounds.low.z)});
    if (mesh.at == ValuesAt::kPoints) mesh.values.push_back(float(value));
  }
  mesh.tetrahedra = grid.cells;
  mesh.values.insert(mesh.values.end(), grid.values.begin(), grid.values.end());
  MoveToLattice(grid.lattice, mesh);
  SortByPlace(grid.lattice, mesh);
  return mesh;
}

CellStoring StoringOf(const Grid& grid, std::uint64_t memory) {
  return {.at = grid.at(),
          .bounds = grid.bounds,
          .lattice = grid.lattice,
          .kinds = {0, 7, 5},
          .notes = {"a note", "another one"},
          .memory = memory};
}

Status Store(const Grid& grid, const std::string& folder, const CellStoring& storing) {
  fs::create_directories(folder);
  CellSpool spool = CellSpool::Create(folder).value();
  for (const Status& status :
       {spool.points.Append(std::span<const MeshPoint>(grid.points)), spool.cells.Append(std::span<const Tetrahedron>(grid.cells)),
        spool.values.Append(std::span<const float>(grid.values)), spool.points.Flush(), spool.cells.Flush(), spool.values.Flush()}) {
    if (!status.ok()) return status;
  }
  return StoreCells(std::move(spool), storing);
}

// Bit for bit, since a value may be NaN.
bool Same(std::span<const float> a, std::span<const float> b) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  return std::ranges::equal(a, b, {}, bits, bits);
}
bool Same(const Mesh& a, const Mesh& b) {
  return a.points == b.points && a.tetrahedra == b.tetrahedra && a.at == b.at && Same(a.values, b.values) && a.gradients == b.gradients;
}

Box SomeBox(Random& random, const Index3& size) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.begin[axis] = random.Integer(0, size[axis] - 1);
    box.end[axis] = random.Integer(box.begin[axis] + 1, size[axis]);
  }
  return box;
}

class CellStoreTest : public testing::Test {
 protected:
  const TemporaryDirectory directory_;
  const std::string folder_ = directory_ / "store";
};

TEST_F(CellStoreTest, HasThePartsOfTheGridInMemoryWhateverTheMemory) {
  Random random(301);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 24; ++round) {
    const Grid grid = SomeGrid(random, round % 2 == 1);
    const auto mesh = std::make_shared<const Mesh>(InMemory(grid));
    const MeshCutter cutter(mesh);
    for (const std::uint64_t memory : {std::uint64_t{0}, std::uint64_t{100'000}, std::uint64_t{1} << 30}) {
      SCOPED_TRACE(fmt::format("round {} memory {} cells {}", round, memory, grid.cells.size()));
      double told = -1;
      CellStoring storing = StoringOf(grid, memory);
      storing.progress = [&](double done) {
        EXPECT_GE(done, told);
        EXPECT_LE(done, 1);
        told = done;
        return Status::Ok();
      };
      const Status status = Store(grid, folder_, storing);
      ASSERT_TRUE(status.ok()) << status.message();
      const auto stored = StoredCells::Open(folder_);
      ASSERT_TRUE(stored.ok()) << stored.status().message();
      EXPECT_EQ((*stored)->facts().points, mesh->points.size());
      EXPECT_EQ((*stored)->facts().cells, mesh->tetrahedra.size());
      EXPECT_EQ((*stored)->facts().lattice, grid.lattice);
      EXPECT_EQ((*stored)->facts().notes, storing.notes);
      EXPECT_EQ((*stored)->facts().points_read, grid.points.size());
      EXPECT_EQ((*stored)->facts().kinds, storing.kinds);
      EXPECT_EQ((*stored)->facts().bounds.low, grid.bounds.low);
      EXPECT_EQ((*stored)->facts().bounds.high, grid.bounds.high);
      EXPECT_LT((*stored)->bytes(), mesh->bytes());
      for (int boxes = 0; boxes < 10; ++boxes) {
        const Box box = boxes == 0 ? grid.lattice.bounds() : SomeBox(random, grid.lattice.size);
        const Result<Mesh> part = (*stored)->CellsIn(box);
        ASSERT_TRUE(part.ok()) << part.status().message();
        EXPECT_TRUE(Same(*part, cutter.Cut(box)));
      }
      EXPECT_TRUE((*stored)->CellsIn({{1, 1, 1}, {1, 2, 2}})->tetrahedra.empty());

      const Volume expected = Resample(*mesh, grid.lattice), lattice = (*stored)->ReadLattice().value();
      const auto count = std::size_t(grid.lattice.bounds().voxel_count());
      EXPECT_EQ(lattice.description, expected.description);
      EXPECT_TRUE(Same(std::span(lattice.block.samples<float>(), count), std::span(expected.block.samples<float>(), count)));
      const CellRanges ranges = (*stored)->Ranges(grid.lattice.size), of_mesh = cutter.Ranges(grid.lattice.size);
      EXPECT_EQ(ranges.whole, of_mesh.whole);
      EXPECT_EQ(ranges.bricks, of_mesh.bricks);
      EXPECT_EQ(ranges.counts, of_mesh.counts);
      std::size_t visited = 0;
      EXPECT_TRUE((*stored)->Visit([&](const Mesh& part) { visited += part.tetrahedra.size(); }).ok());
      EXPECT_EQ(visited, mesh->tetrahedra.size());
    }
    std::set<std::string> files;
    for (const auto& each : fs::directory_iterator(folder_)) files.insert(each.path().filename().string());
    EXPECT_EQ(files, std::set<std::string>({"bricks", "cells", "gradients", "header", "order", "points", "runs", "values", "voxels"}));
    fs::remove_all(folder_);
  }
}

TEST_F(CellStoreTest, NoticesEveryByteThatIsNotWhatWasWritten) {
  Random random(302);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const Grid grid = SomeGrid(random, round % 2 == 1);
    ASSERT_TRUE(Store(grid, folder_, StoringOf(grid, 1 << 20)).ok());
    std::vector<fs::path> files;
    for (const auto& each : fs::directory_iterator(folder_)) {
      if (each.path().filename() != "order") files.push_back(each.path());  // which other stores read
    }
    std::ranges::sort(files);
    const fs::path file = files[random.Integer<std::size_t>(0, files.size() - 1)];
    SCOPED_TRACE(file.string());
    const auto size = std::size_t(fs::file_size(file));
    if (random.Chance(0.5)) {
      fs::resize_file(file, random.Integer<std::size_t>(0, size - 1));
    } else {
      std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
      const auto at = std::streamoff(random.Integer<std::size_t>(0, size - 1));
      bytes.seekg(at);
      const char was = char(bytes.get());
      bytes.seekp(at);
      bytes.put(char(was ^ (1 << random.Integer(0, 7))));
    }
    const auto stored = StoredCells::Open(folder_);
    Status status = stored.status();
    if (status.ok()) status = (*stored)->CellsIn(grid.lattice.bounds()).status();
    if (status.ok()) status = (*stored)->ReadLattice().status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << "nothing was noticed";
    EXPECT_THAT(status.message(), testing::AllOf(HasSubstr(folder_), testing::Not(HasSubstr("\n"))));
    fs::remove_all(folder_);
  }
}

TEST_F(CellStoreTest, IsNoStoreBeforeItIsWhole) {
  Random random(303);
  SCOPED_TRACE(random.trace());
  const Grid grid = SomeGrid(random, false);
  int calls = 0, until = 0;
  CellStoring storing = StoringOf(grid, 0);
  storing.progress = [&](double) { return ++calls > until ? Status::Cancelled("stopped") : Status::Ok(); };
  bool done = false;
  for (; !done; until += 7, calls = 0) {
    const Status status = Store(grid, folder_, storing);
    done = status.ok();
    EXPECT_EQ(StoredCells::Open(folder_).ok(), done);
    EXPECT_EQ(status.code(), done ? StatusCode::kOk : StatusCode::kCancelled);
    fs::remove_all(folder_);
  }
  EXPECT_GT(until, 7);
}

TEST_F(CellStoreTest, SharesTheFilesOfAStoreOfTheSameMesh) {
  Random random(304);
  SCOPED_TRACE(random.trace());
  const std::string first = directory_ / "first", second = directory_ / "second";
  const auto links = [&](const char* file) { return fs::hard_link_count(fs::path(second) / file); };
  for (int round = 0; round < 20; ++round) {
    const bool of_cells = round % 2 == 1;
    SCOPED_TRACE(fmt::format("round {}", round));
    const Grid before = SomeGrid(random, of_cells);
    Grid now = before;
    for (float& value : now.values) value = float(random.Real(-5, 5));
    for (MeshPoint& point : now.points) point[3] = of_cells ? 0 : random.Real(-5, 5);
    const bool moves = round % 5 == 3, damaged = round % 5 == 4;
    if (moves) now.points[1][0] = 0.5 * (now.points[0][0] + now.points[1][0]);
    ASSERT_TRUE(Store(before, first, StoringOf(before, 0)).ok());
    if (damaged) {
      std::fstream bytes(fs::path(first) / (random.Chance(0.5) ? "cells" : "order"), std::ios::in | std::ios::out | std::ios::binary);
      bytes.seekp(7);
      bytes.put('\x55');
    }
    CellStoring storing = StoringOf(now, round % 3 == 0 ? 0 : 1 << 30);
    storing.others = {directory_ / "none", first};
    const Status status = Store(now, second, storing);
    ASSERT_TRUE(status.ok()) << status.message();
    for (const char* file : {"cells", "points", "order"}) EXPECT_EQ(links(file), moves || damaged ? 1U : 2U) << file;
    for (const char* file : {"values", "gradients", "voxels"}) EXPECT_EQ(links(file), 1U) << file;
    if (!damaged) {
      const MeshCutter of_before(std::make_shared<const Mesh>(InMemory(before)));
      EXPECT_TRUE(Same(StoredCells::Open(first).value()->CellsIn(before.lattice.bounds()).value(), of_before.Cut(before.lattice.bounds())));
    }
    fs::remove_all(first);
    const MeshCutter cutter(std::make_shared<const Mesh>(InMemory(now)));
    const auto stored = StoredCells::Open(second);
    ASSERT_TRUE(stored.ok()) << stored.status().message();
    for (int boxes = 0; boxes < 5; ++boxes) {
      const Box box = boxes == 0 ? now.lattice.bounds() : SomeBox(random, now.lattice.size);
      EXPECT_TRUE(Same((*stored)->CellsIn(box).value(), cutter.Cut(box)));
    }
    const Volume expected = Resample(InMemory(now), now.lattice), lattice = (*stored)->ReadLattice().value();
    const auto count = std::size_t(now.lattice.bounds().voxel_count());
    EXPECT_TRUE(Same(std::span(lattice.block.samples<float>(), count), std::span(expected.block.samples<float>(), count)));
    EXPECT_EQ((*stored)->Ranges(now.lattice.size).bricks, cutter.Ranges(now.lattice.size).bricks);
    fs::remove_all(second);
  }
}

}  // namespace
}  // namespace slabstream
