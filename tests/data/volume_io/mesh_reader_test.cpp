#include "data/volume_io/mesh_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/data/volume_io/vtu_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class MeshReader : public testing::Test {
 protected:
  Result<LoadedMesh> Read(const FileBytes& bytes, const std::string& array = "") {
    WriteFile(path_, bytes);
    return ReadMesh(path_, {.array = array});
  }
  // The message with which the file is refused.
  std::string Refusal(const VtuSpec& spec, const std::string& array = "") {
    const Result<LoadedMesh> loaded = Read(VtuFile(spec), array);
    EXPECT_FALSE(loaded.ok());
    return loaded.ok() ? "" : loaded.status().message();
  }

  const TemporaryDirectory directory_;
  const std::string path_ = directory_ / "grid.vtu";
};

TEST_F(MeshReader, ReadsEveryEncoding) {
  const std::vector<VtiOptions> encodings = {{},
                                             {.wide_header = true},
                                             {.block = 40},
                                             {.encoding = "base64"},
                                             {.encoding = "base64", .wide_header = true, .block = 24},
                                             {.format = "binary"},
                                             {.format = "binary", .block = 100},
                                             {.format = "ascii"}};
  for (const bool big_endian : {false, true}) {
    for (const VtiOptions& encoding : encodings) {
      SCOPED_TRACE(encoding.format + " " + encoding.encoding + " " + std::to_string(encoding.block) + (big_endian ? " big" : ""));
      VtuSpec spec = SmallGrid();
      spec.big_endian = big_endian;
      const Result<LoadedMesh> loaded = Read(VtuFile(spec, encoding));
      ASSERT_TRUE(loaded.ok()) << loaded.status().message();
      const Mesh& mesh = loaded->mesh;
      EXPECT_EQ(loaded->info.points, 10);
      EXPECT_EQ(loaded->info.cells, 4);
      ASSERT_EQ(loaded->info.kinds.size(), 3U);
      EXPECT_EQ(loaded->info.kinds[1].kind->name, "wedge");
      EXPECT_EQ(loaded->info.kinds[1].count, 2);
      EXPECT_EQ(mesh.tetrahedra.size(), 1U + 2 * 3 + 2);
      EXPECT_EQ(loaded->bounds.high, (Vec3{2, 1, 2}));
      EXPECT_NEAR(VolumeOf(mesh), 1 + 1.0 / 3 + 1.0 / 6, 1e-6);
      for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        EXPECT_EQ(mesh.values[i], mesh.points[i].x + 10 * mesh.points[i].y + 100 * mesh.points[i].z);
      }
    }
  }
}

TEST_F(MeshReader, ReadsLegacyFilesOfBothVersions) {
  for (const bool binary : {false, true}) {
    for (const bool offsets : {false, true}) {
      for (const bool metadata : {false, true}) {
        SCOPED_TRACE(std::string(binary ? "binary" : "text") + (offsets ? " offsets" : "") + (metadata ? " metadata" : ""));
        VtuSpec spec = SmallGrid();
        spec.arrays.insert(spec.arrays.begin(), {"PointData", "wind", SampleType::kFloat64, 3, std::vector<double>(30, 7)});
        spec.arrays.insert(spec.arrays.begin(), {"PointData", "a%20b", SampleType::kInt64, 1, std::vector<double>(10, 5)});
        const FileBytes legacy = LegacyGridFile(spec, {binary, offsets, metadata});
        const Result<LoadedMesh> loaded = Read(legacy), xml = Read(VtuFile(spec));
        ASSERT_TRUE(loaded.ok()) << loaded.status().message();
        EXPECT_EQ(loaded->info.format, "VTK UNSTRUCTURED_GRID, legacy");
        EXPECT_EQ(loaded->bounds.high, (Vec3{2, 1, 2}));
        EXPECT_EQ(loaded->info.points, xml->info.points);
        EXPECT_EQ(loaded->info.cells, xml->info.cells);
        EXPECT_EQ(loaded->mesh.points, xml->mesh.points);
        EXPECT_EQ(loaded->mesh.tetrahedra, xml->mesh.tetrahedra);
        EXPECT_EQ(loaded->mesh.values, xml->mesh.values);
        ASSERT_EQ(loaded->info.arrays.size(), 4U);
        EXPECT_EQ(loaded->info.arrays[loaded->info.array].name, "height");
        EXPECT_EQ(Read(legacy, "number")->mesh.values, Read(VtuFile(spec), "number")->mesh.values);
        EXPECT_EQ(Read(legacy, "a b")->mesh.values, AlignedVector<float>(10, 5));
        EXPECT_THAT(Read(legacy, "wind").status().message(), HasSubstr("has 3 components a voxel, of which --channel takes one"));
        EXPECT_EQ(ReadMesh(path_, {.array = "wind", .channel = 2})->mesh.values, AlignedVector<float>(10, 7));
        EXPECT_THAT(Read(legacy, "heat").status().message(), HasSubstr("has no array 'heat'; it has number, wind, height, a b"));
      }
    }
  }
}

// What programs write beside the grid itself.
TEST_F(MeshReader, LegacyFilesMayHoldMoreThanIsRead) {
  const std::string grid =
      "# vtk DataFile Version 2.0  \r\nby hand\r\nASCII\r\nDATASET UNSTRUCTURED_GRID\r\nFIELD FieldData 2\r\nTIME 1 1 double\r\n2.5\r\n"
      "CYCLE 1 1 int 8\r\n\r\nPOINTS 4 FLOAT\r\n0 0 0  1 0 0\r\n0 1e-70 1e0 0 1 1\r\nCELLS 1 5\r\n4 0 1 2 3\r\nCELL_TYPES 1\r\n10\r\n";
  const std::string data =
      "CELL_DATA 1\nGLOBAL_IDS ids vtkIdType\n0\nPOINT_DATA 4\nCOLOR_SCALARS rgb 3\n0 0 0 1 1 1 0 0 0 1 1 1\nSCALARS t double\n"
      "LOOKUP_TABLE warm\n1 2 3 4\nLOOKUP_TABLE warm 2\n0 0 0 1 1 1 1 1\nTENSORS s float\n" +
      AsText(std::vector<double>(36)) + "TEXTURE_COORDINATES uv 2 float\n0 0 0 0 0 0 0 0\nSCALARS u int 1\nLOOKUP_TABLE default\n4 3 2 1\n";
  const Result<LoadedMesh> loaded = Read(grid + data);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->mesh.values, (AlignedVector<float>{1, 2, 3, 4}));  // the first scalars
  EXPECT_EQ(loaded->info.arrays.size(), 6U);
  EXPECT_EQ(Read(grid + data, "u")->mesh.values, (AlignedVector<float>{4, 3, 2, 1}));
  EXPECT_EQ(Read(grid + data, "ids")->mesh.at, ValuesAt::kCells);
  // Scalars of points come first, wherever they stand.
  const std::string of_cells = "CELL_DATA 1\nSCALARS c float\nLOOKUP_TABLE default\n9\n";
  EXPECT_EQ(Read(grid + of_cells)->mesh.values, AlignedVector<float>{9});
  EXPECT_EQ(Read(grid + of_cells + data)->mesh.values, (AlignedVector<float>{1, 2, 3, 4}));
}

TEST_F(MeshReader, SaysWhatIsWrongWithALegacyFile) {
  const auto with = [&](const std::string& from, const std::string& to, bool offsets = true) {
    FileBytes bytes = LegacyGridFile(SmallGrid(), {.binary = false, .offsets = offsets, .metadata = false});
    const std::size_t at = bytes.find(from);
    EXPECT_NE(at, FileBytes::npos) << from;
    bytes.replace(at, from.size(), to);
    const Result<LoadedMesh> loaded = Read(bytes);
    EXPECT_FALSE(loaded.ok());
    return loaded.ok() ? "" : loaded.status().message();
  };
  EXPECT_THAT(
      with("UNSTRUCTURED_GRID", "POLYDATA"),
      HasSubstr("a VTK dataset of type POLYDATA, must be STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID or UNSTRUCTURED_GRID"));
  EXPECT_THAT(with("POINTS 10", "POINTS -1"), HasSubstr("POINTS has '-1', must be a whole number in [0,"));
  EXPECT_THAT(with("POINTS 10", "POINTS 281474976710656"), HasSubstr("truncated: has "));
  EXPECT_THAT(with("POINTS 10 double", "POINTS 10 bit"), HasSubstr("POINTS: type 'bit' is not supported"));
  EXPECT_THAT(with("OFFSETS vtktypeint64\n0", "OFFSETS vtktypeint64\n1"), HasSubstr("OFFSETS begin with 1, must begin with 0"));
  EXPECT_THAT(with("OFFSETS", "OFFSET"), HasSubstr("CELLS: has 'OFFSET', must have OFFSETS"));
  EXPECT_THAT(with("CONNECTIVITY vtktypeint64", "CONNECTIVITY float"), HasSubstr("CONNECTIVITY has no whole numbers"));
  EXPECT_THAT(with("CELL_TYPES 4\n13", "CELL_TYPES 4\n12"), HasSubstr("the points of cell 0, a hexahedron, end at 6, must end at 8"));
  EXPECT_THAT(with("CELL_TYPES 4\n13", "CELL_TYPES 4\n42"), HasSubstr("cell 0 has VTK's type 42; supported: tetrahedra (10)"));
  EXPECT_THAT(with("CELLS 4 25\n6", "CELLS 4 25\n99", false), HasSubstr("cell 0 has 99 points, CELLS holds 24 more"));
  EXPECT_THAT(with("CELLS 4", "CELLS 5", false), HasSubstr("CELLS states 5 cells and has 4, CELL_TYPES has 4, must be one number"));
  EXPECT_THAT(with("POINT_DATA 10", "POINT_DATA 9"), HasSubstr("has '2' behind height, must have a VTK keyword"));  // the tenth value
  EXPECT_THAT(with("SCALARS height", "MATRICES height"),
              HasSubstr("has 'MATRICES' behind number, must have a VTK keyword that is supported"));
  EXPECT_THAT(with("CELL_TYPES 4\n13\n13\n14\n10\n", ""), HasSubstr("has no CELL_TYPES"));
}

TEST_F(MeshReader, KnowsAGridByItsNameOrBySayingSo) {
  const std::string legacy = directory_ / "g.vtk";
  WriteFile(legacy, LegacyGridFile(SmallGrid()));
  EXPECT_TRUE(LooksLikeMesh(legacy));
  WriteFile(legacy, VtkFile({}, FileBytes(24, '0'), true));
  EXPECT_FALSE(LooksLikeMesh(legacy));
  EXPECT_TRUE(LooksLikeMesh("NONE.VTU"));
  EXPECT_FALSE(LooksLikeMesh(directory_ / "none.vtk"));
  EXPECT_FALSE(LooksLikeMesh("none.vti"));
}

TEST_F(MeshReader, TakesTheArrayThatIsNamedElseTheActiveOneElseTheOnlyOne) {
  VtuSpec spec = SmallGrid();
  const Result<LoadedMesh> of_cells = Read(VtuFile(spec), "number");
  ASSERT_TRUE(of_cells.ok()) << of_cells.status().message();
  EXPECT_EQ(of_cells->mesh.at, ValuesAt::kCells);
  ASSERT_EQ(of_cells->mesh.values.size(), of_cells->mesh.tetrahedra.size());
  EXPECT_EQ(std::ranges::count(of_cells->mesh.values, 0.0F), 3);  // of the first wedge
  EXPECT_EQ(std::ranges::count(of_cells->mesh.values, 3.0F), 1);
  EXPECT_THAT(Refusal(spec, "heat"), HasSubstr("has no array 'heat'; it has height, number"));
  spec.point_scalars = "";
  EXPECT_EQ(Read(VtuFile(spec))->mesh.at, ValuesAt::kPoints);  // the only one of points
  spec.cell_scalars = "number";
  ASSERT_TRUE(Read(VtuFile(spec)).ok());
  EXPECT_EQ(Read(VtuFile(spec))->mesh.at, ValuesAt::kCells);
  spec.arrays[0].components = 2;
  spec.arrays[0].values.resize(20);
  EXPECT_THAT(Refusal(spec, "height"), HasSubstr("has 2 components a voxel, of which --channel takes one: 0 to 1"));
}

TEST_F(MeshReader, KeepsThePrecisionOfPointsFarFromTheOrigin) {
  VtuSpec spec = SmallGrid();
  for (double& place : spec.arrays[2].values) place = 4e6 + place / 1024;
  const Result<LoadedMesh> loaded = Read(VtuFile(spec));
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->bounds.low, (Vec3{4e6, 4e6, 4e6}));
  EXPECT_EQ(loaded->mesh.points[6].z, 1.0F / 1024);
}

TEST_F(MeshReader, SaysWhatIsWrong) {
  const VtuSpec good = SmallGrid();
  enum { kHeight, kNumber, kPoints, kCorners, kEnds, kKinds };
  const auto with = [&](auto change) {
    VtuSpec spec = good;
    change(spec);
    return Refusal(spec);
  };
  EXPECT_THAT(with([](VtuSpec& s) { s.points = 0; }), HasSubstr("has no piece with points and cells in it"));
  EXPECT_THAT(with([](VtuSpec& s) { s.points = -1; }), HasSubstr("NumberOfPoints is '-1', must be a whole number in [0, 2147483648]"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kKinds].values[2] = 42; }), HasSubstr("cell 2 has VTK's type 42; supported: tetrahedra (10)"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kKinds].values[0] = 12; }),
              HasSubstr("the points of cell 0, a hexahedron, end at 6, must end at 8"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kEnds].values[1] = 1e15; }),
              HasSubstr("the points of cell 1, a wedge, end at 1000000000000000"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kCorners].values[7] = 10; }), HasSubstr("cell 1 has point 10, must be in [0, 10)"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kCorners].values[7] = -1; }), HasSubstr("cell 1 has point -1, must be in [0, 10)"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kPoints].values[5] = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("point 1 is not finite"));
  EXPECT_THAT(with([](VtuSpec& s) {
                for (std::size_t i = 2; i < 30; i += 3) s.arrays[kPoints].values[i] = 7;
              }),
              HasSubstr("its points reach over 0 along z, must be in [1e-30, 1e+30]"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays[kCorners].type = SampleType::kFloat64; }),
              HasSubstr("array connectivity of Cells has no whole numbers"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays.erase(s.arrays.begin() + kEnds); }), HasSubstr("has no array offsets in Cells"));
  EXPECT_THAT(with([](VtuSpec& s) { s.arrays.erase(s.arrays.begin(), s.arrays.begin() + 2); }),
              HasSubstr("has no array of points or cells"));
  EXPECT_THAT(Refusal(GridSpec({{0, 0, 0}, {1, 0, 0}, {0, 1, 1}}, {5}, {{0, 1, 2}})), HasSubstr("has no cells with a volume"));
  const FileSpec image;
  EXPECT_THAT(Read(VtiFile(image, FileBytes(24, '\0'))).status().message(),
              HasSubstr("a VTK file of type 'ImageData', must be UnstructuredGrid"));
  EXPECT_EQ(ReadMesh(directory_ / "none.vtu").status().code(), StatusCode::kNotFound);
}

TEST_F(MeshReader, CellsWithoutAVolumeAreCountedAndLeftOut) {
  VtuSpec spec = GridSpec({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {5, 10, 1, 10}, {{0, 1, 2}, {0, 1, 2, 3}, {3}, {0, 1, 1, 3}});
  const Result<LoadedMesh> loaded = Read(VtuFile(spec), "number");
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->info.kinds.size(), 3U);
  ASSERT_EQ(loaded->mesh.tetrahedra.size(), 1U);  // the last cell has a point twice
  EXPECT_EQ(loaded->mesh.values.front(), 1.0F);
}

TEST_F(MeshReader, FilesThatAreCutOffOrAlteredDoNoHarm) {
  Random random(73);
  SCOPED_TRACE(random.trace());
  std::vector<FileBytes> files;
  for (const VtiOptions& encoding : {VtiOptions{}, VtiOptions{.encoding = "base64", .block = 40}, VtiOptions{.format = "ascii"}}) {
    files.push_back(VtuFile(SmallGrid(), encoding));
  }
  for (const LegacyOptions& options : {LegacyOptions{}, LegacyOptions{.offsets = false}, LegacyOptions{.binary = false}}) {
    files.push_back(LegacyGridFile(SmallGrid(), options));
  }
  for (const FileBytes& good : files) {
    const auto refused_or_sound = [&](const FileBytes& bytes) {
      const Result<LoadedMesh> loaded = Read(bytes);
      if (!loaded.ok()) {
        EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(path_), testing::Not(HasSubstr("\n"))));
        return;
      }
      for (const Tetrahedron& t : loaded->mesh.tetrahedra) {
        EXPECT_TRUE(std::ranges::all_of(t, [&](PointNumber n) { return n < loaded->mesh.points.size(); }));
      }
      EXPECT_EQ(loaded->mesh.values.size(),
                loaded->mesh.at == ValuesAt::kPoints ? loaded->mesh.points.size() : loaded->mesh.tetrahedra.size());
    };
    for (std::size_t length = 0; length < good.size(); length += 1 + length / 200) refused_or_sound(good.substr(0, length));
    for (int i = 0; i < 400; ++i) {
      FileBytes bytes = good;
      for (int flips = random.Integer(1, 3); flips > 0; --flips) Damage(bytes[random.Integer<std::size_t>(0, bytes.size() - 1)], random);
      refused_or_sound(bytes);
    }
  }
}

TEST(RealMeshes, BluntFinHasItsPointsAndCells) {
  const std::string folder = SharedVolumes();
  if (folder.empty()) GTEST_SKIP() << "set SLABSTREAM_SHARED_VOLUMES to a folder of volumes";
  const Result<LoadedMesh> loaded = ReadMesh(folder + "/ug_bluntfin.vtu");
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->info.points, 40960);
  EXPECT_EQ(loaded->mesh.tetrahedra.size(), 187395U);
  EXPECT_EQ(loaded->info.arrays[loaded->info.array].name, "density");
  const auto [low, high] = std::ranges::minmax(loaded->mesh.values);
  EXPECT_NEAR(low, 0.1926, 1e-4);
  EXPECT_NEAR(high, 4.977, 1e-3);
}

}  // namespace
}  // namespace slabstream
