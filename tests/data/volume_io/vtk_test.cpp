// What programs write into files of VTK, and which array, piece and time of it is read.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/open/read_volume.h"
#include "data/volume_io/grid_arrays.h"
#include "data/volume_io/mesh_reader.h"
#include "data/volume_io/structured_grid.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
using Values = std::vector<double>;

Values Counted(std::size_t count, double first = 0) {
  Values values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(first + double(i));
  return values;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
  return text;
}

// An array in ASCII.
std::string Array(const std::string& name, const Values& values, int components = 1, const std::string& more = "") {
  return fmt::format("<DataArray type=\"Float64\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\"{}>\n{}</DataArray>\n", name,
                     components, more, AsText(values));
}
std::string Points(const std::string& arrays) { return "<PointData>\n" + arrays + "</PointData>\n"; }
std::string Cells(const std::string& arrays) { return "<CellData>\n" + arrays + "</CellData>\n"; }
std::string Piece(const std::string& extent, const std::string& inside) {
  return "<Piece Extent=\"" + extent + "\">\n" + inside + "</Piece>\n";
}
std::string XmlFile(const std::string& type, const std::string& attributes, const std::string& pieces) {
  return fmt::format(
      "<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"LittleEndian\">\n<{0} "
      "{1}>\n<FieldData>\n{2}</FieldData>\n{3}</{0}>\n</VTKFile>\n",
      type, attributes, Array("TimeValue", {2.5}), pieces);
}
std::string Image(const std::string& extent, const std::string& pieces) {
  return XmlFile("ImageData", "WholeExtent=\"" + extent + "\" Origin=\"100 200 300\" Spacing=\"2 3 4\"", pieces);
}

class VtkTest : public testing::Test {
 protected:
  Result<LoadedVolume> Read(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    WriteFile(directory_ / name, bytes);
    return ReadVolume(directory_ / name, options);
  }
  Values ValuesOf(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    const Result<LoadedVolume> loaded = Read(name, bytes, options);
    EXPECT_TRUE(loaded.ok()) << loaded.status().message();
    if (!loaded.ok()) return {};
    const Volume& volume = *loaded->volume;
    Values values;
    VisitScalarType(volume.description.type, [&]<class T>(const T*) {
      for (std::size_t i = 0; i < CountIn(volume.description.geometry.size); ++i) {
        values.push_back(volume.description.mapping.FromStored(double(volume.block.samples<T>()[i])));
      }
    });
    return values;
  }
  VolumeGeometry GeometryOf(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    const Result<LoadedVolume> loaded = Read(name, bytes, options);
    EXPECT_TRUE(loaded.ok()) << loaded.status().message();
    return loaded.ok() ? loaded->info.finest().geometry : VolumeGeometry{};
  }
  std::string WhyNot(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    const Result<LoadedVolume> loaded = Read(name, bytes, options);
    EXPECT_FALSE(loaded.ok());
    EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(directory_ / name), testing::Not(HasSubstr("\n"))));
    return loaded.status().message();
  }

  TemporaryDirectory directory_;
};

TEST_F(VtkTest, BlanksInAttributesDoNotCount) {
  const auto padded = [](const FileBytes& file) {
    FileBytes out = file;
    for (const char* const key : {"type", "Name", "NumberOfComponents", "format", "NumberOfPoints", "NumberOfCells", "header_type",
                                  "byte_order", "compressor", "Extent", "Scalars"}) {
      out = Replaced(out, std::string(" ") + key + "=\"", std::string(" ") + key + "=\"  ");
    }
    return Replaced(Replaced(out, "\" format", " \" format"), "\" version", " \" version");
  };
  const FileSpec spec{.type = SampleType::kInt16, .big_endian = true};
  const FileBytes image =
      VtiFile(spec, EncodeSamples(spec.type, Counted(24), true), {.format = "binary", .wide_header = true, .block = 16});
  EXPECT_EQ(ValuesOf("v.vti", padded(image)), Counted(24));
  WriteFile(directory_ / "g.vtu", padded(VtuFile(SmallGrid(), {.format = "ascii"})));
  const Result<LoadedMesh> mesh = ReadMesh(directory_ / "g.vtu");
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_EQ(mesh->info.cells, 4);
  // Numbers may stand in any lines.
  const std::string spread =
      Replaced(Image("0 1 0 0 0 1", Piece("  0  1\n0 0   0 1 ", Points(Array("a", {1, 2, 3, 4})))), "\n2\n", "  2\t\n\n");
  EXPECT_EQ(ValuesOf("v.vti", spread), (Values{1, 2, 3, 4}));
}

TEST_F(VtkTest, ValuesOfCellsLieBetweenThePoints) {
  // 4 x 3 x 2 points from 10, -20, 0 on, so 3 x 2 x 1 cells.
  const std::string file =
      Image("10 13 -20 -18 0 1", Piece("10 13 -20 -18 0 1", Points(Array("p", Counted(24))) + Cells(Array("c", Counted(6, 50)))));
  EXPECT_EQ(ValuesOf("v.vti", file), Counted(24));
  const ReadOptions of_cells{.array = "c"};
  EXPECT_EQ(ValuesOf("v.vti", file, of_cells), Counted(6, 50));
  const auto [size, spacing, orientation, stretch] = GeometryOf("v.vti", file, of_cells);
  EXPECT_EQ(size, (Index3{3, 2, 1}));
  EXPECT_EQ(spacing, (Vec3{2, 3, 4}));
  ExpectNear(orientation.origin, {100 + 20 + 1, 200 - 60 + 1.5, 300 + 2}, 1e-12);
  EXPECT_THAT(Read("v.vti", file, of_cells)->info.notes,
              testing::ElementsAre("array c of cells is shown, of p, c", "voxels are the cells of the grid, not its points"));
  // A flat grid has one layer of cells, in the plane of its points.
  const std::string flat = Image("0 2 0 1 7 7", Piece("0 2 0 1 7 7", Cells(Array("c", {1, 2}))));
  EXPECT_EQ(ValuesOf("v.vti", flat), (Values{1, 2}));
  ExpectNear(GeometryOf("v.vti", flat).orientation.origin, {101, 201.5, 328}, 1e-12);

  const std::string legacy =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 3 2\nORIGIN 1 2 3\nSPACING 2 2 2\n"
      "CELL_DATA 6\nSCALARS c float 1\nLOOKUP_TABLE default\n0 1 2 3 4 5\n";
  EXPECT_EQ(ValuesOf("v.vtk", legacy), Counted(6));
  ExpectNear(GeometryOf("v.vtk", legacy).orientation.origin, {2, 3, 4}, 1e-12);
}

TEST_F(VtkTest, PiecesArePutTogether) {
  const auto pieces = [](const std::string& second, double first_value) {
    return Image("0 4 0 1 0 0", Piece("0 2 0 1 0 0", Points(Array("p", {0, 1, 2, 5, 6, 7})) + Cells(Array("c", {0, 1}))) +
                                    Piece(second, Points(Array("p", {2, 3, 4, 7, 8, 9})) + Cells(Array("c", {first_value, 3}))) +
                                    Piece("0 -1 0 1 0 0", Points("") + Cells("")));
  };
  EXPECT_EQ(ValuesOf("v.vti", pieces("2 4 0 1 0 0", 2)), Counted(10));
  EXPECT_EQ(ValuesOf("v.vti", pieces("2 4 0 1 0 0", 2), {.array = "c"}), Counted(4));
  EXPECT_THAT(WhyNot("v.vti", pieces("4 6 0 1 0 0", 2)), HasSubstr("its pieces hold 12 of the 14 voxels between them"));
  EXPECT_THAT(WhyNot("v.vti", Replaced(pieces("2 4 0 1 0 0", 2), "\"p\"", "\"q\""), {.array = "p"}), HasSubstr("it has q, c"));
  EXPECT_THAT(WhyNot("v.vti", Image("0 2 0 0 0 0", Piece("0 1 0 0 0 0", Points(Array("p", {1, 2}))) +
                                                       Piece("1 2 0 0 0 0", Points(Array("p", {1, 2}, 2))))),
              HasSubstr("array p has 2 components of Float64 in piece 1, must have 1 of Float64"));
  // A piece without room for a cell has none, also at the end of the others.
  const std::string thin =
      Image("0 2 0 1 0 0", Piece("0 2 0 1 0 0", Cells(Array("c", {5, 6}))) + Piece("2 2 0 1 0 0", Cells(Array("c", {}))));
  EXPECT_EQ(ValuesOf("v.vti", thin), (Values{5, 6}));
  // What lies beyond the pieces is not there: a file of a parallel program.
  EXPECT_EQ(GeometryOf("v.vti", Image("0 99 0 1 0 0", Piece("1 3 0 1 0 0", Points(Array("p", Counted(6)))))).orientation.origin,
            (Vec3{102, 200, 300}));
}

TEST_F(VtkTest, PiecesOfUnstructuredGridsFollowEachOther) {
  const auto piece = [](double x, double value) {
    return fmt::format("<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n{}<Points>\n{}</Points>\n<Cells>\n{}{}{}</Cells>\n</Piece>\n",
                       Points(Array("p", {value, value, value, value})), Array("Points", {x, 0, 0, x + 1, 0, 0, x, 1, 0, x, 0, 1}, 3),
                       Replaced(Array("connectivity", {0, 1, 2, 3}), "Float64", "Int64"),
                       Replaced(Array("offsets", {4}), "Float64", "Int64"), Replaced(Array("types", {10}), "Float64", "UInt8"));
  };
  const std::string empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><PointData/><Points/><Cells/></Piece>\n";
  WriteFile(directory_ / "g.vtu", XmlFile("UnstructuredGrid", "", piece(0, 1) + empty + piece(5, 2)));
  const Result<LoadedMesh> loaded = ReadMesh(directory_ / "g.vtu");
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->info.points, 8);
  EXPECT_EQ(loaded->info.cells, 2);
  EXPECT_EQ(loaded->mesh.values, (AlignedVector<float>{1, 1, 1, 1, 2, 2, 2, 2}));
  EXPECT_EQ(loaded->mesh.points[5].x, 6);
  ASSERT_EQ(loaded->mesh.tetrahedra.size(), 2U);
  for (const PointNumber point : loaded->mesh.tetrahedra[1]) EXPECT_GE(point, 4U);
  // Points of another piece are none of its own.
  WriteFile(directory_ / "g.vtu", XmlFile("UnstructuredGrid", "", piece(0, 1) + Replaced(piece(5, 2), "0\n1\n2\n3\n", "0\n1\n2\n4\n")));
  EXPECT_THAT(ReadMesh(directory_ / "g.vtu").status().message(), HasSubstr("g.vtu: piece 1: cell 0 has point 4, must be in [0, 4)"));
}

TEST_F(VtkTest, ATimeIsTakenWithItsArrays) {
  const auto array = [](double first, const std::string& step) { return Array("p", Counted(2, first), 1, " TimeStep=\"" + step + "\""); };
  const std::string file = XmlFile("ImageData", "WholeExtent=\"0 1 0 0 0 0\" TimeValues=\"0 0.5 1\"",
                                   Piece("0 1 0 0 0 0", Points(array(0, "0") + array(10, "1 2") + Array("always", {7, 8}))));
  EXPECT_THAT(WhyNot("v.vti", file), HasSubstr("holds 3 volumes, of which --time takes one: 0 to 2"));
  for (const int time : {0, 1, 2}) {
    EXPECT_EQ(ValuesOf("v.vti", file, {.time = TimeRange{time, time}, .array = "p"}), Counted(2, time == 0 ? 0 : 10));
  }
  EXPECT_EQ(ValuesOf("v.vti", file, {.time = TimeRange{1, 1}, .array = "always"}), (Values{7, 8}));
  EXPECT_EQ(Read("v.vti", file, {.time = TimeRange{1, 1}, .array = "p"})->info.times, (TimeAxis{3, 0.5, ""}));
  EXPECT_EQ(Read("v.vti", Replaced(file, "0 0.5 1", "0 0.5 7"), {.time = TimeRange{}, .array = "p"})->info.times, (TimeAxis{3}));
  EXPECT_EQ(Read("v.vti", Replaced(file, "0 0.5 1", "0 or 1"), {.time = TimeRange{}, .array = "p"})->info.times, (TimeAxis{3}));
  EXPECT_EQ(Read("v.vti", file, {.time = TimeRange{1, 1}, .array = "p"})->info.time, 1);
}

TEST_F(VtkTest, EvenRectilinearGridsAreVolumes) {
  const auto file = [](const Values& x, const Values& y, const Values& z) {
    const std::string extent = fmt::format("0 {} 3 {} 0 {}", x.size() - 1, y.size() + 2, z.size() - 1);
    return XmlFile("RectilinearGrid", "WholeExtent=\"" + extent + "\"",
                   Piece(extent, Points(Array("p", Counted(x.size() * y.size() * z.size()))) + "<Coordinates>\n" + Array("", x) +
                                     Array("", y) + Array("", z) + "</Coordinates>\n"));
  };
  const std::string even = file({1, 1.5, 2, 2.5}, {-3, 0, 3}, {8, 9});
  EXPECT_EQ(ValuesOf("v.vtr", even), Counted(24));
  const auto [size, spacing, orientation, stretch] = GeometryOf("v.vtr", even);
  EXPECT_EQ(size, (Index3{4, 3, 2}));
  EXPECT_EQ(spacing, (Vec3{0.5, 3, 1}));
  EXPECT_EQ(orientation.origin, (Vec3{1, -3, 8}));
  // Uneven ones stay where they are, also those that run down.
  for (const Values& x : {Values{1, 2, 4}, Values{4, 2, 1}}) {
    const VolumeGeometry uneven = GeometryOf("v.vtr", file(x, {0, 1}, {0, 1}));
    EXPECT_EQ(uneven.size, (Index3{3, 2, 2}));
    for (const double at : {1, 2, 4}) {
      const double voxel = at == 4 ? 2 : at - 1;
      EXPECT_DOUBLE_EQ(uneven.ToWorld(uneven.stretch.ToData(Vec3{voxel, 1, 0})).x, at);
    }
    EXPECT_EQ(ValuesOf("v.vtr", file(x, {0}, {0})), (x[0] == 1 ? Values{0, 1, 2} : Values{2, 1, 0}));
  }
  EXPECT_THAT(Read("v.vtr", file({1, 2, 4}, {0, 1}, {0, 1}))->info.notes,
              testing::Contains("the 3 voxels along x, 1 to 2 apart, lie at their own places; the spacing is their mean distance"));
  EXPECT_THAT(WhyNot("v.vtr", file({0, 1e-9, 4}, {0, 1}, {0, 1})), HasSubstr("along x, place 0 is "));
  // From 0.5 to 5, or, run backwards, from -5 to -0.5; the points of cells: from 1 to 4.
  const ReadOptions resampled = {.resample = 9};
  const Values line = {0, 0.25, 0.75, 1.125, 1.375, 1.625, 1.875, 2, 2};
  EXPECT_EQ(ValuesOf("v.vtr", file({1, 2, 4}, {0}, {0}), resampled), line);
  EXPECT_EQ(ValuesOf("v.vtr", file({-1, -2, -4}, {0}, {0}), resampled), Values(line.rbegin(), line.rend()));
  EXPECT_EQ(GeometryOf("v.vtr", file({-1, -2, -4}, {0}, {0}), resampled).orientation.origin.x, -4.75);
  const auto of_cells = [](const Values& x) {
    const std::string coordinates = "<Coordinates>\n" + Array("", x) + Array("", {0}) + Array("", {0}) + "</Coordinates>\n";
    return XmlFile("RectilinearGrid", "WholeExtent=\"0 3 0 0 0 0\"", Piece("0 3 0 0 0 0", Cells(Array("c", {0, 1, 2})) + coordinates));
  };
  for (const Values& x : {Values{1, 2, 4, 10}, Values{10, 4, 2, 1}}) {
    const VolumeGeometry geometry = GeometryOf("v.vtr", of_cells(x), {.resample = 6});
    EXPECT_DOUBLE_EQ(geometry.ToWorld({-0.5, 0, 0}).x, 1);
    EXPECT_DOUBLE_EQ(geometry.ToWorld({5.5, 0, 0}).x, 10);
  }
  EXPECT_THAT(WhyNot("v.vtr", file({0, 1, 1}, {0, 1}, {0, 1}), resampled), HasSubstr("along x: number 2 is 1, must be finite and above"));
  EXPECT_THAT(WhyNot("v.vtr", file({0, 1}, {0, 0}, {0, 1})), HasSubstr("coordinates along y: number 1 is 0, must be finite and above"));
  EXPECT_THAT(WhyNot("v.vtr", file({0, 1}, {0, NAN}, {0, 1})), HasSubstr("coordinates along y: number 1 is nan"));
  EXPECT_THAT(WhyNot("v.vtr", Replaced(even, "<Coordinates>", "<Places>").replace(even.find("</Coordinates>") - 5, 14, "</Places>")),
              HasSubstr("has coordinates along 0 axes, must have 3"));
  // One layer; coordinates that run down.
  EXPECT_EQ(GeometryOf("v.vtr", file({0, 2, 4}, {1}, {6, 3, 0})).spacing, (Vec3{2, 2, 3}));
  EXPECT_EQ(ValuesOf("v.vtr", file({4, 2}, {0, 1}, {5})), (Values{1, 0, 3, 2}));

  const std::string legacy =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 4 3 2\nX_COORDINATES 4 float\n0 1 2 3\n"
      "Y_COORDINATES 3 double\n0 2 4\nZ_COORDINATES 2 int\n5 8\nPOINT_DATA 24\nSCALARS p float\nLOOKUP_TABLE default\n" +
      AsText(Counted(24));
  EXPECT_EQ(ValuesOf("v.vtk", legacy), Counted(24));
  EXPECT_EQ(GeometryOf("v.vtk", legacy).spacing, (Vec3{1, 2, 3}));
  const std::string uneven = Replaced(legacy, "0 2 4", "0 2 6");
  EXPECT_TRUE(GeometryOf("v.vtk", uneven).rectilinear());
  EXPECT_EQ(GeometryOf("v.vtk", uneven, {.resample = 0}).size, (Index3{4, 5, 2}));
  EXPECT_THAT(WhyNot("v.vtk", uneven, {.resample = 0, .labels = true}), HasSubstr("labels, which are not resampled"));
  EXPECT_THAT(WhyNot("v.vtk", Replaced(legacy, "Z_COORDINATES 2 int\n5 8", "Z_COORDINATES 3 int\n5 8 11")),
              HasSubstr("Z_COORDINATES has 3 coordinates, DIMENSIONS 2"));
  EXPECT_THAT(WhyNot("v.vtk", Replaced(legacy, "Z_COORDINATES 2 int\n5 8", "")), HasSubstr("has no Z_COORDINATES"));
}

TEST(GridOfCoordinatesTest, AllowsForTheRoundingOfFloats) {
  Values floats;
  for (int i = 0; i < 100; ++i) floats.push_back(float(1000 + 0.001 * i));
  const PointGrid grid = GridOfCoordinates({floats, {0, 1}, {0, 1}});
  EXPECT_TRUE(grid.uneven[0].empty());
  EXPECT_NEAR(grid.steps[0].x, 0.001, 1e-6);
}

TEST_F(VtkTest, LegacyKeywordsMayBeSmallAndWhatIsNotReadIsPassedBy) {
  const std::string texts =
      std::string("notes 1 3 string\n") + char(0xc3) + "abc" + char(0xc0) + char(0x80) + char(70) + std::string(70, 'x');
  const std::string file =
      "# vtk DataFile Version 4.2\nt\nbinary\ndataset structured_points\ndimensions 4 3 2\norigin 0 0 0\nspacing 1 1 1\n"
      "field FieldData 1\n" +
      texts + "\npoint_data 24\nfield FieldData 2\nmask 1 24 bit\nabc\np 1 24 unsigned_char\n" +
      EncodeSamples(SampleType::kUint8, Counted(24)) + "\n";
  EXPECT_EQ(ValuesOf("v.vtk", file), Counted(24));
  EXPECT_THAT(WhyNot("v.vtk", file, {.array = "mask"}), HasSubstr("array mask: type 'bit' is not supported"));
  for (std::size_t length = 0; length < file.size() - 24; ++length) EXPECT_FALSE(Read("v.vtk", file.substr(0, length)).ok());
  const std::string text =
      Replaced(Replaced(file.substr(0, file.find("field")), "binary", "ascii"), "dimensions 4 3 2", "dimensions 2 1 1");
  EXPECT_EQ(ValuesOf("v.vtk", text + "FIELD FieldData 1\nnotes 1 2 string\na text with blanks\n%20\nPOINT_DATA 2\nSCALARS p int\n"
                                     "LOOKUP_TABLE default\n4 5\n"),
            (Values{4, 5}));
}

// VTK writes scalars of bytes as colours.
TEST_F(VtkTest, ScalarsOfBytesMayBeColors) {
  const std::string start = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 1 1\nPOINT_DATA 4\n";
  const std::string field = "\nFIELD f 2\np 1 4 float\n9 9 9 9\nq 1 4 float\n9 9 9 9\n";
  EXPECT_EQ(ValuesOf("v.vtk", start + "COLOR_SCALARS a 1\n0 1 0.5019608 0.0039216" + field), (Values{0, 255, 128, 1}));
  EXPECT_EQ(ValuesOf("v.vtk", Replaced(start, "ASCII", "BINARY") + "COLOR_SCALARS a 1\nABCD\n"), (Values{65, 66, 67, 68}));
  EXPECT_THAT(WhyNot("v.vtk", start + "COLOR_SCALARS a 1\n0 1 nan 1e400\n"), HasSubstr("sample 3 is '1e400'"));
}

TEST_F(VtkTest, FilesOfVtkThatAreNotReadAreNamed) {
  EXPECT_THAT(WhyNot("v.pvtk", "<VTKFile/>"), HasSubstr("v.pvtk: a list of VTK files, which is not read; ParaView writes"));
  EXPECT_THAT(WhyNot("v.ex2", "exodus"), HasSubstr("v.ex2: an Exodus file, which is not read; ParaView's Save Data writes"));
  EXPECT_THAT(WhyNot("v.cgns", "ADF"), HasSubstr("v.cgns: a CGNS file, which is not read; ParaView"));
  EXPECT_THAT(WhyNot("v.case", "FORMAT"), HasSubstr("v.case: an EnSight file, which is not read; ParaView"));
  EXPECT_THAT(WhyNot("v.vdb", "vdb"), HasSubstr("v.vdb: an OpenVDB file, which is not read; pyopenvdb"));
  EXPECT_THAT(WhyNot("v.bp", "bp"), HasSubstr("v.bp: output of ADIOS2, which is not read; openpmd-pipe"));
  EXPECT_THAT(WhyNot("v.foam", ""), HasSubstr("v.foam: a case of OpenFOAM, which is not read; foamToVTK writes"));
  std::filesystem::create_directories(directory_ / "cavity/system");
  WriteFile(directory_ / "cavity/system/controlDict", "FoamFile {}");
  EXPECT_THAT(ReadVolume(directory_ / "cavity").status().message(), HasSubstr("cavity: a case of OpenFOAM, which is not read"));
  EXPECT_THAT(WhyNot("v.vtp", "<VTKFile/>"), HasSubstr("a surface of VTK (PolyData), which holds no volume"));
  EXPECT_THAT(WhyNot("v.vtx", "<VTKFile/>"), HasSubstr("not a volume, which must end in ."));
}

TEST_F(VtkTest, FilesThatAreCutOffOrAlteredDoNoHarm) {
  Random random(57);
  SCOPED_TRACE(random.trace());
  const std::string extent = "0 2 0 1 0 1";
  const std::string coordinates = "<Coordinates>\n" + Array("x", {0, 1, 2}) + Array("y", {0, 3}) + Array("z", {5, 6}) + "</Coordinates>\n";
  const FileSpec bytes{.type = SampleType::kUint8};
  const std::pair<const char*, std::string> files[] = {
      {"v.vti", Image("0 4 0 1 0 0", Piece("0 2 0 1 0 0", Points(Array("p", Counted(6))) + Cells(Array("c", Counted(2)))) +
                                         Piece("2 4 0 1 0 0", Points(Array("p", Counted(6))) + Cells(Array("c", Counted(2)))))},
      {"v.vtr", XmlFile("RectilinearGrid", "WholeExtent=\"" + extent + "\"", Piece(extent, Cells(Array("c", Counted(2))) + coordinates))},
      {"v.vti",
       VtiFile(bytes, EncodeSamples(SampleType::kUint8, Counted(24), false), {.format = "binary", .block = 9, .compressor = "LZ4"})},
      {"v.vti", VtiFile(bytes, EncodeSamples(SampleType::kUint8, Counted(24), false), {.block = 9, .compressor = "LZMA"})},
      {"v.vtk",
       "# vtk DataFile Version 3.0\nt\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 2 2 2\nX_COORDINATES 2 float\n0 1\nY_COORDINATES 2 int\n"
       "0 1\nZ_COORDINATES 2 int\n0 1\nFIELD f 1\nn 1 1 string\nabc\nCELL_DATA 1\nCOLOR_SCALARS c 1\n0.5\n"}};
  for (const auto& [name, good] : files) {
    ASSERT_TRUE(Read(name, good).ok()) << good;
    const auto check = [&](const std::string& file) {
      const Result<LoadedVolume> loaded = Read(name, file, {.array = random.Chance(0.5) ? "c" : ""});
      EXPECT_THAT(loaded.ok() ? "" : loaded.status().message(), testing::Not(HasSubstr("\n")));
    };
    for (std::size_t length = 0; length < good.size(); length += 7) check(good.substr(0, length));
    for (int i = 0; i < 300; ++i) {
      std::string file = good;
      for (int change = random.Integer(1, 3); change > 0; --change) {
        char& byte = file[random.Integer<std::size_t>(0, file.size() - 1)];
        byte = byte >= '0' && byte <= '9' ? char('0' + random.Integer(0, 9)) : char(random.Integer(0, 255));
      }
      check(file);
    }
  }
}

TEST(ChosenArray, IsTheNamedOneTheActiveOneOrTheOnlyOne) {
  const auto chosen = [](const std::vector<GridArray>& arrays, const std::string& wanted = "") -> std::string {
    const Result<std::size_t> number = ChooseArray("f", arrays, wanted);
    return number.ok() ? std::to_string(*number) : number.status().message();
  };
  const GridArray p{.name = "p"}, q{.name = "q"}, v{.name = "v", .components = 3}, own{.name = "vtkGhostType"};
  const GridArray c{.name = "c", .at = ValuesAt::kCells}, pc{.name = "p", .at = ValuesAt::kCells};
  const GridArray bits{.name = "b", .type = {}, .type_name = "Bit"};
  const auto active = [](GridArray array) {
    array.active = true;
    return array;
  };
  EXPECT_EQ(chosen({pc, p, q}, "p"), "1");  // of points before cells
  EXPECT_EQ(chosen({p, v}, "v"), "1");
  EXPECT_EQ(chosen({p, q, c}, "r"), "f: has no array 'r'; it has p, q, c");
  EXPECT_EQ(chosen({active(c), p, active(q)}), "2");
  EXPECT_EQ(chosen({active(c), p, q}), "0");
  EXPECT_EQ(chosen({c, p, v, own}), "1");  // the only scalars of points that are not VTK's own
  EXPECT_EQ(chosen({c, v, own}), "1");
  EXPECT_EQ(chosen({c, own}), "0");
  EXPECT_THAT(chosen({p, q, c}), HasSubstr("several arrays and none is the active scalars; choose one by its name (--array): p, q, c"));
  EXPECT_EQ(chosen({bits, p}), "1");
  EXPECT_EQ(chosen({bits, p}, "b"), "f: array b: type 'Bit' is not supported");
  EXPECT_EQ(chosen({bits}), "f: array b: type 'Bit' is not supported");
  EXPECT_EQ(chosen({own}), "0");
  EXPECT_EQ(chosen({own, bits}), "f: has no array that is read without its name (--array), only vtkGhostType, b");
  EXPECT_EQ(chosen({}), "f: has no array of points or cells");
}

}  // namespace
}  // namespace slabstream
