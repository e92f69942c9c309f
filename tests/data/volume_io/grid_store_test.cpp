// Grids whose cells are kept on disk: the same voxels and cells as in memory, whatever their pieces; made anew where files change.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/mesh/mesh_part.h"
#include "data/open/read_volume.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/support/full_disk.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class GridStoreTest : public testing::Test {
 protected:
  GridStoreTest() { ::setenv("XDG_CACHE_HOME", (directory_ / "cache").c_str(), 1); }
  ~GridStoreTest() override { ::unsetenv("XDG_CACHE_HOME"); }

  std::string Write(const std::string& name, const FileBytes& bytes) const {
    WriteFile(directory_ / name, bytes);
    return directory_ / name;
  }
  std::vector<fs::path> Stores() const {
    std::vector<fs::path> stores;
    std::error_code error;
    for (const auto& each : fs::directory_iterator(directory_ / "cache/slabstream/streams", error)) {
      if (each.is_directory()) stores.push_back(each.path());
    }
    return stores;
  }
  static Result<LoadedVolume> Read(const std::string& path, const std::string& array, bool keep_cells) {
    return ReadVolume(path, {.array = array, .keep_cells = keep_cells});
  }
  // The volume of the store, if it is that of memory.
  static void ExpectSame(const std::string& path, const std::string& array, Random& random) {
    // In memory first: a store that is there is used.
    const Result<LoadedVolume> held = Read(path, array, false), kept = Read(path, array, true), found = Read(path, array, false);
    ASSERT_TRUE(held.ok()) << held.status().message();
    ASSERT_TRUE(kept.ok()) << kept.status().message();
    ASSERT_TRUE(found.ok()) << found.status().message();
    ASSERT_TRUE(held->volume->cells != nullptr && held->cells == nullptr);
    ASSERT_TRUE(kept->volume->cells == nullptr && kept->cells != nullptr);
    ASSERT_TRUE(found->cells != nullptr);
    EXPECT_EQ(found->cells->Digest(), kept->cells->Digest());
    EXPECT_EQ(held->info.notes, kept->info.notes);
    EXPECT_EQ(held->info.files, kept->info.files);
    EXPECT_EQ(held->volume->description, kept->volume->description);
    EXPECT_EQ(held->volume->block.bytes, kept->volume->block.bytes);
    const MeshCutter cutter(held->volume->cells);
    const Index3& size = held->volume->description.geometry.size;
    for (int i = 0; i < 8; ++i) {
      Box box = {{0, 0, 0}, size};
      for (int axis = 0; i > 0 && axis < 3; ++axis) {
        box.begin[axis] = random.Integer(0, size[axis] - 1);
        box.end[axis] = random.Integer(box.begin[axis] + 1, size[axis]);
      }
      const Mesh expected = cutter.Cut(box);
      const Result<Mesh> part = kept->cells->CellsIn(box);
      ASSERT_TRUE(part.ok()) << part.status().message();
      EXPECT_EQ(EncodeMesh(*part), EncodeMesh(expected));  // bytes, since a value may be NaN
    }
  }

  const TemporaryDirectory directory_;
};

// Hexahedra, voxels and pairs of wedges between moved points, in pieces along x that have ghost cells around them or not.
struct SomeGrid {
  Index3 cells;
  std::uint64_t seed = 0;

  Vec3 PlaceOf(const Index3& n) const {
    Random moved(seed + std::uint64_t(n.x + 100 * n.y + 10'000 * n.z));
    const auto at = [&](int i, int most) { return i + (i > 0 && i < most ? moved.Real(-0.2, 0.2) : 0); };
    return {at(n.x, cells.x), at(n.y, cells.y), at(n.z, cells.z)};
  }
  VtuSpec Piece(int begin, int end, bool ghosts) const {
    const int low = ghosts ? std::max(begin - 1, 0) : begin, high = ghosts ? std::min(end + 1, cells.x) : end;
    std::vector<Vec3> points;
    std::vector<int> kinds;
    std::vector<std::vector<int>> corners;
    VtuArray marks{"CellData", "vtkGhostType", SampleType::kUint8};
    const int row = high - low + 1, layer = row * (cells.y + 1);
    for (int z = 0; z <= cells.z; ++z) {
      for (int y = 0; y <= cells.y; ++y) {
        for (int x = low; x <= high; ++x) {
          const int n = int(points.size()), m = n + layer;
          points.push_back(PlaceOf({x, y, z}));
          if (x == high || y == cells.y || z == cells.z) continue;
          Random kind(seed + 7 + std::uint64_t(x + 100 * y + 10'000 * z));
          const auto add = [&](int vtk_type, const std::vector<int>& of_cell) {
            kinds.push_back(vtk_type);
            corners.push_back(of_cell);
            marks.values.push_back(x < begin || x >= end ? 1 : 0);
          };
          switch (kind.Integer(0, 2)) {
            case 0: add(12, {n, n + 1, n + row + 1, n + row, m, m + 1, m + row + 1, m + row}); break;
            case 1: add(11, {n, n + 1, n + row, n + row + 1, m, m + 1, m + row, m + row + 1}); break;
            default: add(13, {n, n + 1, n + row, m, m + 1, m + row}); add(13, {n + 1, n + row + 1, n + row, m + 1, m + row + 1, m + row});
          }
        }
      }
    }
    VtuSpec spec = GridSpec(points, kinds, corners);
    if (ghosts) spec.arrays.insert(spec.arrays.begin(), marks);
    return spec;
  }
};

TEST_F(GridStoreTest, GivesTheGridOfItsPiecesInMemory) {
  Random random(311);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 12; ++round) {
    const SomeGrid grid = {{random.Integer(3, 12), random.Integer(2, 9), random.Integer(2, 9)},
                           random.Integer<std::uint64_t>(0, 1'000'000)};
    const bool ghosts = random.Chance(0.5);
    std::vector<std::string> names;
    for (int begin = 0; begin < grid.cells.x;) {
      const int end = std::min(begin + random.Integer(1, 5), grid.cells.x);
      names.push_back(fmt::format("{}-{}.vtu", round, begin));
      Write(names.back(), VtuFile(grid.Piece(begin, end, ghosts)));
      begin = end;
    }
    const std::string path = Write(fmt::format("{}.pvtu", round), VtkListFile("PUnstructuredGrid", names));
    SCOPED_TRACE(fmt::format("round {}: {} pieces{}", round, names.size(), ghosts ? " with ghosts" : ""));
    ExpectSame(path, "height", random);
    ExpectSame(path, "number", random);
    EXPECT_EQ(Stores().size(), 2U * std::size_t(round + 1)) << "each array has its own";
  }
}

TEST_F(GridStoreTest, OfOtherFormatsAndOptionsGivesTheirGrids) {
  Random random(312);
  SCOPED_TRACE(random.trace());
  VtuSpec box = BoxOfHexahedra({}, {5, 4, 3}, [](const Vec3& n) { return n; });
  ExpectSame(Write("g.vtu", VtuFile(box)), "height", random);
  ExpectSame(Write("l.vtk", LegacyGridFile(box)), "number", random);
  box.extent = "0 5 0 4 0 3";
  ExpectSame(Write("g.vts", VtuFile(box)), "height", random);
  const std::size_t stores = Stores().size();
  const auto coarse = ReadVolume(directory_ / "g.vtu", {.lattice = 9, .keep_cells = true});
  ASSERT_TRUE(coarse.ok()) << coarse.status().message();
  EXPECT_EQ(coarse->volume->description.geometry.size.x, 9);
  EXPECT_EQ(Stores().size(), stores + 1);
  EXPECT_TRUE(Read(fs::relative(directory_ / "g.vtu").string(), "height", false)->cells != nullptr) << "from another folder";
  EXPECT_EQ(Stores().size(), stores + 1);
}

TEST_F(GridStoreTest, IsMadeAnewIfFilesChangeOrAPartIsMissing) {
  const auto grid = [&](double value) {
    VtuSpec box = BoxOfHexahedra({}, {3, 3, 3}, [](const Vec3& n) { return n; });
    box.arrays[0].values[5] = value;
    return Write("piece.vtu", VtuFile(box));
  };
  grid(1);
  const std::string path = Write("g.pvtu", VtkListFile("PUnstructuredGrid", {"piece.vtu"}));
  const auto voxels = [&] { return Read(path, "height", true).value().volume->block.bytes; };
  const auto before = voxels();
  grid(70);
  EXPECT_NE(voxels(), before) << "another piece";
  EXPECT_EQ(Stores().size(), 2U);
  grid(1);
  for (const fs::path& store : Stores()) fs::remove_all(store);
  EXPECT_EQ(voxels(), before);
  for (const char* file : {"cells", "header", "voxels"}) {
    fs::resize_file(Stores().at(0) / file, 10);
    EXPECT_EQ(voxels(), before) << file << " is cut off";
    fs::remove(Stores().at(0) / file);
    EXPECT_EQ(voxels(), before) << file << " is gone";
  }
  // Another version of the same size.
  std::fstream header(Stores().at(0) / "header", std::ios::in | std::ios::out | std::ios::binary);
  header.seekp(7);
  header.put('0');
  header.close();
  EXPECT_EQ(voxels(), before);
  // What a program that was stopped leaves has no seal.
  fs::remove(Stores().at(0) / ".slabstream-store");
  WriteFile((Stores().at(0) / "spool-cells").string(), "left");
  EXPECT_EQ(voxels(), before);
  EXPECT_FALSE(fs::exists(Stores().at(0) / "spool-cells"));
}

TEST_F(GridStoreTest, OfSeveralTimesHasTheMeshOnce) {
  Random random(313);
  SCOPED_TRACE(random.trace());
  std::string times;
  for (const int time : {0, 1, 2}) {
    std::vector<std::string> names;
    for (const int x : {0, 3}) {
      VtuSpec piece = BoxOfHexahedra({x, 0, 0}, {x + 3, 4, 2}, [](const Vec3& n) { return n; });
      for (double& value : piece.arrays[0].values) value *= time + 1;
      names.push_back(fmt::format("t{}-{}.vtu", time, x));
      Write(names.back(), VtuFile(piece));
    }
    Write(fmt::format("t{}.pvtu", time), VtkListFile("PUnstructuredGrid", names));
    times += fmt::format("<DataSet timestep=\"{0}\" file=\"t{0}.pvtu\"/>", time);
  }
  const std::string path = Write("run.pvd", "<VTKFile type=\"Collection\"><Collection>" + times + "</Collection></VTKFile>");
  for (const int time : {0, 1, 2}) {
    const ReadOptions options = {.time = TimeRange{time, time}, .array = "height"};
    ReadOptions keeping = options;
    keeping.keep_cells = true;
    const Result<LoadedVolume> held = ReadVolume(path, options), kept = ReadVolume(path, keeping);
    ASSERT_TRUE(held.ok() && kept.ok()) << held.status().message() << kept.status().message();
    EXPECT_EQ(held->volume->block.bytes, kept->volume->block.bytes);
    const Box box = held->volume->block.box;
    EXPECT_EQ(EncodeMesh(kept->cells->CellsIn(box).value()), EncodeMesh(MeshCutter(held->volume->cells).Cut(box)));
  }
  ASSERT_EQ(Stores().size(), 3U);
  for (const fs::path& store : Stores()) EXPECT_EQ(fs::hard_link_count(store / "cells"), 3U);
}

TEST_F(GridStoreTest, SaysThatItsCellsAreDamaged) {
  const std::string path = Write("g.vtu", VtuFile(BoxOfHexahedra({}, {3, 3, 3}, [](const Vec3& n) { return n; })));
  const LoadedVolume kept = Read(path, "height", true).value();
  const fs::path cells = Stores().at(0) / "cells";
  std::fstream bytes(cells, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(100);
  bytes.put('\x7f');
  bytes.close();
  const Status status = kept.cells->CellsIn(kept.volume->block.box).status();
  EXPECT_EQ(status.code(), StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), testing::AllOf(HasSubstr(cells.string()), HasSubstr("is damaged"), HasSubstr("remove the folder")));
}

TEST_F(GridStoreTest, LeavesNothingOnAFullDisk) {
  const std::string path = Write("g.vtu", VtuFile(BoxOfHexahedra({}, {9, 9, 9}, [](const Vec3& n) { return n; })));
  for (const rlim_t bytes : {0, 20'000, 60'000}) {
    const Status status = OnFullDisk(bytes, [&] { return Read(path, "height", true).status(); });
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << status.message();
    EXPECT_THAT(status.message(), testing::AllOf(HasSubstr("cannot write"), HasSubstr("streams"), testing::Not(HasSubstr("\n"))));
    EXPECT_TRUE(Stores().empty());
  }
  EXPECT_TRUE(Read(path, "height", true).ok());
}

TEST_F(GridStoreTest, OfSeveralReadersIsMadeOnce) {
  const std::string path = Write("g.vtu", VtuFile(BoxOfHexahedra({}, {9, 9, 9}, [](const Vec3& n) { return n; })));
  std::vector<std::jthread> threads;
  std::vector<std::string> digests(4);
  for (std::string& digest : digests) {
    threads.emplace_back([&] {
      const Result<LoadedVolume> read = Read(path, "height", true);
      digest = read.ok() ? read->cells->Digest() : read.status().message();
    });
  }
  threads.clear();
  for (const std::string& digest : digests) EXPECT_EQ(digest, digests.front());
  EXPECT_EQ(Stores().size(), 1U);
}

}  // namespace
}  // namespace slabstream
