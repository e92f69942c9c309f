// Grids in pieces: lists of files, ghost cells, and curvilinear grids beside the same cells as unstructured ones.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "common/mesh/lattice.h"
#include "data/open/read_volume.h"
#include "data/volume_io/mesh_reader.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr Index3 kBoxCells = {6, 4, 2};  // cells of the whole grid

// A box of 6 x 4 x 2.
Vec3 Straight(const Vec3& number) { return number; }
// A shear and a turn with the volume of that box, whose faces are flat, and values that are linear in the places.
Vec3 Sheared(const Vec3& number) { return {number.x + 0.5 * number.y, number.y - 0.25 * number.z, number.z}; }

// Cells and points of `spec` have these arrays of whole numbers.
VtuSpec With(VtuSpec spec, const std::string& section, const std::string& name, const std::vector<double>& numbers) {
  spec.arrays.insert(spec.arrays.begin(), {section, name, SampleType::kUint8, 1, numbers});
  return spec;
}

// The cells [begin, end) with a layer of ghost cells around them, which the array marks with `mark`; "": without ghosts.
VtuSpec PieceOfBox(const Index3& begin, const Index3& end, const std::string& array = "", int mark = 0) {
  if (array.empty()) return BoxOfHexahedra(begin, end, Sheared);
  Index3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::max(begin[axis] - 1, 0);
    high[axis] = std::min(end[axis] + 1, kBoxCells[axis]);
  }
  std::vector<double> marks;
  for (int z = low.z; z < high.z; ++z) {
    for (int y = low.y; y < high.y; ++y) {
      for (int x = low.x; x < high.x; ++x) marks.push_back(Box{begin, end}.Contains(Index3{x, y, z}) ? 0 : mark);
    }
  }
  return With(BoxOfHexahedra(low, high, Sheared), "CellData", array, marks);
}

// The area of faces that one tetrahedron alone has. No face has more than two.
double OuterArea(const Mesh& mesh) {
  std::map<std::array<PointNumber, 3>, int> faces;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      std::array<PointNumber, 3> face = {t[left_out == 0 ? 1 : 0], t[left_out <= 1 ? 2 : 1], t[left_out <= 2 ? 3 : 2]};
      std::ranges::sort(face);
      ++faces[face];
    }
  }
  double area = 0;
  for (const auto& [face, count] : faces) {
    EXPECT_LE(count, 2);
    const auto place = [&](std::size_t i) { return Vec3{mesh.points[face[i]].x, mesh.points[face[i]].y, mesh.points[face[i]].z}; };
    if (count == 1) area += Length(Cross(place(1) - place(0), place(2) - place(0))) / 2;
  }
  return area;
}

class GridPieces : public testing::Test {
 protected:
  std::string Write(const std::string& name, const FileBytes& bytes) const {
    WriteFile(directory_ / name, bytes);
    return directory_ / name;
  }
  // Four pieces of the box, 2 x 2 x 1, and their list.
  std::string WritePieces(const std::string& array = "", int mark = 0, const std::string& list = "box.pvtu") const {
    std::vector<std::string> names;
    for (const int x : {0, 4}) {
      for (const int y : {0, 1}) {
        names.push_back(fmt::format("piece{}.vtu", names.size()));
        Write(names.back(), VtuFile(PieceOfBox({x, y, 0}, {x == 0 ? 4 : 6, y == 0 ? 1 : 4, 2}, array, mark)));
      }
    }
    return Write(list, VtkListFile("PUnstructuredGrid", names));
  }
  static LoadedMesh Read(const std::string& path, const std::string& array = "") {
    Result<LoadedMesh> loaded = ReadMesh(path, {.array = array});
    EXPECT_TRUE(loaded.ok()) << loaded.status().message();
    return loaded.ok() ? *std::move(loaded) : LoadedMesh{};
  }
  static std::string Refusal(const std::string& path) {
    const Result<LoadedMesh> loaded = ReadMesh(path);
    EXPECT_FALSE(loaded.ok());
    if (loaded.ok()) return "";
    EXPECT_THAT(loaded.status().message(), testing::AllOf(testing::StartsWith(path + ": "), testing::Not(HasSubstr("\n"))));
    return loaded.status().message();
  }
  static void ExpectSame(const LoadedMesh& a, const LoadedMesh& b) {
    EXPECT_EQ(a.mesh.points, b.mesh.points);
    EXPECT_EQ(a.mesh.tetrahedra, b.mesh.tetrahedra);
    EXPECT_EQ(a.mesh.values, b.mesh.values);
    EXPECT_EQ(a.bounds.low, b.bounds.low);
    EXPECT_EQ(a.info.cells, b.info.cells);
  }

  const TemporaryDirectory directory_;
};

TEST_F(GridPieces, WithGhostCellsAreTheWholeGrid) {
  const LoadedMesh whole = Read(Write("whole.vtu", VtuFile(BoxOfHexahedra({}, kBoxCells, Sheared))));
  struct Ghosts {
    std::string array;
    int mark = 0;
    std::size_t notes = 0;
  };
  for (const auto& [array, mark, notes] : {Ghosts{}, Ghosts{"vtkGhostType", 1, 1}, Ghosts{"vtkGhostType", 32 + 2, 1},
                                           Ghosts{"vtkGhostType", 8, 1}, Ghosts{"vtkGhostLevels", 2, 1}}) {
    SCOPED_TRACE(fmt::format("{} {}", array, mark));
    const LoadedMesh pieces = Read(WritePieces(array, mark));
    EXPECT_EQ(pieces.info.cells, 6 * 4 * 2);
    EXPECT_EQ(pieces.info.points, whole.info.points);
    EXPECT_EQ(pieces.info.points, 7 * 5 * 3);
    EXPECT_EQ(pieces.info.notes.size(), notes);
    EXPECT_EQ(pieces.bounds.low, whole.bounds.low);
    EXPECT_EQ(pieces.bounds.high, whole.bounds.high);
    EXPECT_EQ(pieces.info.other_files.size(), 4U);
    EXPECT_EQ(pieces.mesh.tetrahedra.size(), whole.mesh.tetrahedra.size());
    EXPECT_NEAR(VolumeOf(pieces.mesh), 48, 1e-4);
    EXPECT_NEAR(OuterArea(pieces.mesh), OuterArea(whole.mesh), 1e-4) << "pieces split their common faces alike";
    // The values are linear: any lattice has them exactly.
    LoadedMesh moved = pieces;
    const VolumeGeometry lattice = LatticeOf(moved.bounds, 48, 24);
    MoveToLattice(lattice, moved.mesh);
    const Volume values = Resample(moved.mesh, lattice);
    std::size_t inside = 0;
    for (std::size_t i = 0; i < CountIn(lattice.size); ++i) {
      const float value = values.block.samples<float>()[i];
      if (std::isnan(value)) continue;
      const auto n = std::int32_t(i);
      const Vec3 voxel = {double(n % lattice.size.x), double(n / lattice.size.x % lattice.size.y),
                          double(n / lattice.size.x / lattice.size.y)};
      const Vec3 place =
          lattice.orientation.origin + Vec3{voxel.x * lattice.spacing.x, voxel.y * lattice.spacing.y, voxel.z * lattice.spacing.z};
      EXPECT_NEAR(value, place.x + 10 * place.y + 100 * place.z, 1e-3);
      ++inside;
    }
    EXPECT_GT(inside, CountIn(lattice.size) / 2);
  }
  // Marks that say something else of a cell.
  EXPECT_EQ(Read(Write("kept.vtu", VtuFile(PieceOfBox({2, 1, 0}, {4, 3, 2}, "vtkGhostType", 2 + 4 + 16)))).info.cells, 4 * 4 * 2);
  EXPECT_THAT(Refusal(Write("none.vtu", VtuFile(PieceOfBox({0, 0, 0}, {0, 0, 0}, "vtkGhostType", 1)))),
              HasSubstr("has no cells with a volume; 1 cells are left out, which the file calls ghosts"));
}

TEST_F(GridPieces, OfCellValuesKeepThem) {
  for (const char* array : {"", "vtkGhostType"}) {
    const LoadedMesh pieces = Read(WritePieces(array, 1), "number");
    ASSERT_EQ(pieces.mesh.values.size(), pieces.mesh.tetrahedra.size());
    // The number of a cell in its piece.
    const VtuSpec first = PieceOfBox({0, 0, 0}, {4, 1, 2}, array, 1);
    std::vector<double> kept;
    for (int cell = 0; cell < first.cells; ++cell) {
      if (*array == 0 || first.arrays[0].values[std::size_t(cell)] == 0) kept.push_back(cell);
    }
    ASSERT_EQ(kept.size(), 8U);
    for (std::size_t t = 0; t < 8 * 6; ++t) EXPECT_EQ(pieces.mesh.values[t], float(kept[t / 6]));
  }
}

TEST_F(GridPieces, PointsWithTwoValuesStayTwo) {
  VtuSpec left = BoxOfHexahedra({}, {1, 1, 1}, Straight), right = BoxOfHexahedra({1, 0, 0}, {2, 1, 1}, Straight);
  const std::string list = Write("two.pvtu", VtkListFile("PUnstructuredGrid", {"a.vtu", "b.vtu"}));
  Write("a.vtu", VtuFile(left));
  Write("b.vtu", VtuFile(right));
  EXPECT_EQ(Read(list).info.points, 12);
  EXPECT_EQ(Read(list, "number").info.points, 12);
  right.arrays[0].values[0] += 1;  // at (1, 0, 0)
  Write("b.vtu", VtuFile(right));
  EXPECT_EQ(Read(list).info.points, 13);
  EXPECT_EQ(Read(list, "number").info.points, 12);
  // NaN is the same as NaN, -0 as 0.
  for (VtuSpec* const spec : {&left, &right}) std::ranges::fill(spec->arrays[0].values, std::nan(""));
  right.arrays[2].values[1] = -0.0;
  Write("a.vtu", VtuFile(left));
  Write("b.vtu", VtuFile(right));
  EXPECT_EQ(Read(list).info.points, 12);
}

TEST_F(GridPieces, AHiddenPointHidesItsCells) {
  const VtuSpec box = BoxOfHexahedra({}, {3, 3, 3}, Straight);
  std::vector<double> hidden(64);
  hidden[1 + 4 * 1 + 16 * 1] = 2;  // which eight cells have
  hidden[0] = 1;                   // a copy of another piece's
  const VtuSpec spec = With(box, "PointData", "vtkGhostType", hidden);
  EXPECT_EQ(Read(Write("g.vtu", VtuFile(spec))).info.cells, 27 - 8);
  FileBytes fewer = LegacyGridFile(With(box, "CellData", "vtkGhostType", std::vector<double>(26)), {.binary = false, .metadata = false});
  fewer.replace(fewer.find("CELL_DATA 27"), 12, "CELL_DATA 26");
  fewer.replace(fewer.find("vtkGhostType 1 27"), 17, "vtkGhostType 1 26");
  fewer.erase(fewer.find("number 1 27"), fewer.find("POINT_DATA") - fewer.find("number 1 27"));
  fewer.replace(fewer.find("FieldData 2"), 11, "FieldData 1");
  EXPECT_THAT(Refusal(Write("f.vtk", fewer)), HasSubstr("CELL_DATA has 26 elements, the grid has 27"));
  EXPECT_EQ(Read(Write("g.vtk", LegacyGridFile(spec))).info.cells, 27 - 8);
  EXPECT_EQ(Read(Write("s.vtk", LegacyGridFile(spec, {.dimensions = "4 4 4"}))).info.cells, 27 - 8);
  VtuSpec curvilinear = spec;
  curvilinear.extent = "0 3 0 3 0 3";
  EXPECT_EQ(Read(Write("g.vts", VtuFile(curvilinear))).info.cells, 27 - 8);
}

TEST_F(GridPieces, CurvilinearGridsAreHexahedra) {
  VtuSpec box = BoxOfHexahedra({}, kBoxCells, Sheared);
  const std::string unstructured = Write("g.vtu", VtuFile(box));
  box.extent = "-3 3 10 14 0 2";
  for (const char* array : {"height", "number"}) {
    for (const VtiOptions& encoding : {VtiOptions{}, VtiOptions{.format = "ascii"}, VtiOptions{.encoding = "base64", .block = 40}}) {
      ExpectSame(Read(Write("g.vts", VtuFile(box, encoding)), array), Read(unstructured, array));
    }
    for (const bool binary : {false, true}) {
      ExpectSame(Read(Write("s.vtk", LegacyGridFile(box, {.binary = binary, .dimensions = "7 5 3"})), array), Read(unstructured, array));
    }
  }
  EXPECT_TRUE(LooksLikeMesh(directory_ / "s.vtk"));
  EXPECT_EQ(Read(directory_ / "g.vts").info.format, "VTK StructuredGrid");
  // A layer of cells has a volume.
  VtuSpec layer = BoxOfHexahedra({}, {3, 2, 1}, Straight);
  layer.extent = "0 3 0 2 0 1";
  EXPECT_NEAR(VolumeOf(Read(Write("l.vts", VtuFile(layer))).mesh), 6, 1e-5);
}

TEST_F(GridPieces, CurvilinearPiecesAreTheWholeGrid) {
  std::vector<std::string> names;
  for (const int x : {0, 2}) {
    VtuSpec piece = BoxOfHexahedra({x, 0, 0}, {x == 0 ? 2 : 6, 4, 2}, Sheared);
    piece.extent = fmt::format("{} {} 0 4 0 2", x, x == 0 ? 2 : 6);
    names.push_back(fmt::format("{}.vts", x));
    Write(names.back(), VtuFile(piece));
  }
  const LoadedMesh pieces = Read(Write("g.pvts", VtkListFile("PStructuredGrid", names)));
  EXPECT_EQ(pieces.info.cells, 48);
  EXPECT_EQ(pieces.info.points, 7 * 5 * 3);
  EXPECT_EQ(pieces.info.format, "VTK PStructuredGrid, 3 files");
  const LoadedMesh whole = Read(Write("whole.vtu", VtuFile(BoxOfHexahedra({}, kBoxCells, Sheared))));
  EXPECT_NEAR(OuterArea(pieces.mesh), OuterArea(whole.mesh), 1e-4);
}

TEST_F(GridPieces, SaysWhatIsWrongWithACurvilinearGrid) {
  const VtuSpec box = BoxOfHexahedra({}, {3, 2, 1}, Straight);
  const auto with = [&](const std::string& extent) {
    VtuSpec spec = box;
    spec.extent = extent;
    return Refusal(Write("g.vts", VtuFile(spec)));
  };
  EXPECT_THAT(with("0 3 0 7 0 0"), HasSubstr("g.vts: is flat, 4 x 8 x 1 points, and so has no volume"));
  EXPECT_THAT(with("0 3 0 -1 0 0"), HasSubstr("has no piece with points and cells in it"));
  EXPECT_THAT(with("0 3 0 2 0"), HasSubstr("Extent of Piece is '0 3 0 2 0', must be 6 numbers"));
  EXPECT_THAT(with("0 3 0 2 0 2"), HasSubstr("array Points has 608 bytes, its 108 samples need at least 864"));
  EXPECT_THAT(with("0 1000000000 0 1000000000 0 1000000000"),
              HasSubstr("has 1000000001 x 1000000001 x 1000000001 points, must have at most 2147483648 in all"));
  const auto legacy = [&](const std::string& dimensions) {
    return Refusal(Write("g.vtk", LegacyGridFile(box, {.dimensions = dimensions})));
  };
  EXPECT_THAT(legacy("24 1 1"), HasSubstr("is flat, 24 x 1 x 1 points, and so has no volume"));
  EXPECT_THAT(legacy("4 3 3"), HasSubstr("has 24 POINTS, its DIMENSIONS state 4 x 3 x 3 points"));
  EXPECT_THAT(legacy("4 3 0"), HasSubstr("DIMENSIONS has 0 along z, must be a whole number in [1, 2147483648]"));
  EXPECT_THAT(legacy("4 3 2.5"), HasSubstr("DIMENSIONS has 2.5 along z"));
  EXPECT_THAT(legacy("2e9 2e9 2e9"), HasSubstr("has 2000000000 x 2000000000 x 2000000000 points, must have at most"));
}

TEST_F(GridPieces, BlocksAreOneGridWithoutSurfaces) {
  WritePieces("", 0, "nested.pvtu");
  VtuSpec beside = BoxOfHexahedra({6, 0, 0}, {7, 4, 2}, Sheared);
  beside.extent = "6 7 0 4 0 2";
  Write("beside.vts", VtuFile(beside));
  const FileBytes surface = "<VTKFile type=\"PolyData\"><PolyData/></VTKFile>";
  Write("wall.vtp", surface);
  const FileBytes blocks =
      "<VTKFile type=\"vtkMultiBlockDataSet\"><vtkMultiBlockDataSet><Block index=\"0\" name=\"fluid\">"
      "<DataSet index=\"0\" file=\"nested.pvtu\"/><DataSet index=\"1\"/><Piece index=\"2\"><DataSet file=\"beside.vts\"/></Piece></Block>"
      "<DataSet index=\"1\" name=\"wall\" file=\"wall.vtp\"/></vtkMultiBlockDataSet></VTKFile>";
  const LoadedMesh loaded = Read(Write("all.vtm", blocks));
  EXPECT_EQ(loaded.info.cells, 7 * 4 * 2);
  EXPECT_NEAR(VolumeOf(loaded.mesh), 56, 1e-4);
  EXPECT_EQ(loaded.info.points, 8 * 5 * 3);
  EXPECT_THAT(loaded.info.notes, ElementsAre("surfaces are left out: wall"));
  EXPECT_EQ(loaded.info.other_files.size(), 7U);
  const Result<LoadedVolume> volume = ReadVolume(directory_ / "all.vtm");
  ASSERT_TRUE(volume.ok()) << volume.status().message();
  EXPECT_EQ(volume->info.notes, loaded.info.notes);
  EXPECT_EQ(volume->info.files.size(), 8U);

  for (const char* type : {"vtkMultiBlockDataSet", "vtkPartitionedDataSet", "vtkPartitionedDataSetCollection"}) {
    EXPECT_EQ(Read(Write("part.vtpd", VtkListFile(type, {"beside.vts"}))).info.cells, 8);
    EXPECT_THAT(Refusal(Write("part.vtpd", VtkListFile(type, {"wall.vtp"}))), HasSubstr("surfaces are left out: wall.vtp"));
  }
  Write("image.vti", VtiFile({}, FileBytes(24, '\0')));
  EXPECT_THAT(Refusal(Write("mixed.vtm", VtkListFile("vtkMultiBlockDataSet", {"beside.vts", "image.vti"}))),
              HasSubstr("image.vti: a VTK file of type 'ImageData', must be UnstructuredGrid or StructuredGrid or PUnstructuredGrid or"));
  EXPECT_THAT(Refusal(Write("empty.vtm", "<VTKFile type=\"vtkMultiBlockDataSet\"><vtkMultiBlockDataSet/></VTKFile>")),
              HasSubstr("names 0 files, must name 1 to 4096"));
}

TEST_F(GridPieces, WhatAListNamesMustBeThere) {
  const FileBytes grid = VtuFile(SmallGrid());
  const std::string file = Write("g.vtu", grid);
  const auto list = [&](const std::vector<std::string>& files) { return Write("l.pvtu", VtkListFile("PUnstructuredGrid", files)); };
  std::filesystem::create_directories(directory_ / "in/deep");
  Write("in/deep/g.vtu", grid);
  // Where a list lies decides where its files do.
  EXPECT_EQ(Read(Write("in/l.pvtu", VtkListFile("PUnstructuredGrid", {"../g.vtu"}))).info.cells, 4);
  EXPECT_EQ(Read(list({"in/deep/g.vtu"})).info.cells, 4);
  EXPECT_EQ(Read(list({file})).info.cells, 4) << "an absolute path";
  EXPECT_EQ(Read(list({" g.vtu "})).info.cells, 4);

  EXPECT_THAT(Refusal(list({"g.vtu", "gone.vtu"})), HasSubstr("gone.vtu: cannot be opened for reading"));
  EXPECT_EQ(ReadMesh(directory_ / "l.pvtu").status().code(), StatusCode::kNotFound);
  EXPECT_THAT(Refusal(list({"l.pvtu"})), HasSubstr("is named twice"));
  Write("other.pvtu", VtkListFile("PUnstructuredGrid", {"g.vtu"}));
  EXPECT_THAT(Refusal(list({"other.pvtu"})), HasSubstr("other.pvtu: a VTK file of type 'PUnstructuredGrid', must be UnstructuredGrid"));
  EXPECT_THAT(Refusal(list({"g.vtu", "in/../g.vtu"})), HasSubstr("g.vtu: is named twice"));
  EXPECT_THAT(Refusal(list({"in"})), HasSubstr("in: not a file that can be read"));
  ASSERT_EQ(::mkfifo((directory_ / "pipe.vtu").c_str(), 0600), 0);
  EXPECT_THAT(Refusal(list({"pipe.vtu"})), HasSubstr("pipe.vtu: not a file that can be read"));
  EXPECT_THAT(Refusal(list({"g.vtu", ""})), HasSubstr("a Piece of it has no Source"));
  EXPECT_THAT(Refusal(list(std::vector<std::string>(100000, "g.vtu"))), HasSubstr("names 100000 files, must name 1 to 4096"));
  EXPECT_THAT(Refusal(list({})), HasSubstr("names 0 files"));
  VtuSpec other = SmallGrid();
  other.arrays[0].type = SampleType::kInt16;
  Write("other.vtu", VtuFile(other));
  EXPECT_THAT(Refusal(list({"g.vtu", "other.vtu"})), HasSubstr("other.vtu: array height has 1 components of Int16"));
  other.arrays[0].name = "warmth";
  Write("other.vtu", VtuFile(other));
  EXPECT_THAT(Refusal(list({"g.vtu", "other.vtu"})), HasSubstr("other.vtu: has no array height in PointData"));
  Write("other.vtu", grid.substr(0, grid.size() / 2));
  EXPECT_THAT(Refusal(list({"g.vtu", "other.vtu"})), HasSubstr("l.pvtu: " + (directory_ / "other.vtu") + ": "));
}

// Programs that run in parallel write pieces without cells.
TEST_F(GridPieces, EmptyPiecesAddNothing) {
  WritePieces();
  Write("empty.vtu", VtuFile({.arrays = {}}));
  const std::string list = Write("l.pvtu", VtkListFile("PUnstructuredGrid", {"empty.vtu", "piece0.vtu", "piece2.vtu"}));
  EXPECT_EQ(Read(list).info.cells, (4 + 2) * 2);
}

TEST_F(GridPieces, FilesThatAreCutOffOrAlteredDoNoHarm) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  WritePieces("vtkGhostType", 1);
  VtuSpec curvilinear = BoxOfHexahedra({}, {2, 2, 2}, Sheared);
  curvilinear.extent = "0 2 0 2 0 2";
  Write("g.vts", VtuFile(curvilinear));
  const std::vector<std::pair<std::string, FileBytes>> files = {
      {"l.pvtu", VtkListFile("PUnstructuredGrid", {"piece0.vtu", "piece1.vtu"})},
      {"l.pvts", VtkListFile("PStructuredGrid", {"g.vts"})},
      {"l.vtm", VtkListFile("vtkMultiBlockDataSet", {"box.pvtu", "g.vts"})},
      {"a.vts", VtuFile(curvilinear)},
      {"b.vts", VtuFile(curvilinear, {.format = "ascii"})},
      {"g.vtu", VtuFile(PieceOfBox({2, 1, 0}, {4, 3, 2}, "vtkGhostType", 1), {.encoding = "base64", .block = 40})},
      {"a.vtk", LegacyGridFile(curvilinear, {.dimensions = "3 3 3"})},
      {"b.vtk", LegacyGridFile(curvilinear, {.binary = false, .dimensions = "3 3 3"})}};
  for (const auto& [name, good] : files) {
    SCOPED_TRACE(name);
    const std::string path = directory_ / name;
    const auto refused_or_sound = [&](const FileBytes& bytes) {
      WriteFile(path, bytes);
      const Result<LoadedMesh> loaded = ReadMesh(path);
      if (!loaded.ok()) {
        EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(path), testing::Not(HasSubstr("\n"))));
        return;
      }
      const Mesh& mesh = loaded->mesh;
      for (const Tetrahedron& t : mesh.tetrahedra) {
        EXPECT_TRUE(std::ranges::all_of(t, [&](PointNumber n) { return n < mesh.points.size(); }));
      }
      EXPECT_EQ(mesh.values.size(), mesh.at == ValuesAt::kPoints ? mesh.points.size() : mesh.tetrahedra.size());
    };
    ASSERT_TRUE(ReadMesh(Write(name, good)).ok());
    for (std::size_t length = 0; length < good.size(); length += 1 + length / 100) refused_or_sound(good.substr(0, length));
    for (int i = 0; i < 300; ++i) {
      FileBytes bytes = good;
      for (int flips = random.Integer(1, 3); flips > 0; --flips) Damage(bytes[random.Integer<std::size_t>(0, bytes.size() - 1)], random);
      refused_or_sound(bytes);
    }
  }
}

}  // namespace
}  // namespace slabstream
