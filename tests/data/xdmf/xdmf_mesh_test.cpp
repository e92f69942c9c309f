// XDMF grids of cells, held against the same grids in files of VTK.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "data/open/open_source.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/kept_cells.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/data/xdmf/xdmf_elements.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

Vec3 Sheared(const Vec3& number) { return {number.x + 0.5 * number.y, number.y - 0.25 * number.z, number.z}; }

const std::string kOfPoints = "Center=\"Node\"", kOfCells = "Center=\"Cell\"";

std::string Numbers(const std::string& dimensions, const std::vector<double>& numbers) {
  return Item(dimensions, fmt::format("{}", fmt::join(numbers, " ")));
}
std::string Numbers(const std::vector<double>& numbers) { return Numbers(std::to_string(numbers.size()), numbers); }
std::string Named(const std::string& name) { return fmt::format("Name=\"{}\" GridType=\"Uniform\"", name); }

const std::vector<double>& ArrayOf(const VtuSpec& spec, const std::string& section, const std::string& name) {
  for (const VtuArray& array : spec.arrays) {
    if (array.section == section && array.name == name) return array.values;
  }
  static const std::vector<double> kNone;
  return kNone;
}

std::string Topology(const std::string& type, std::size_t cells, const std::string& item) {
  return fmt::format("<Topology TopologyType=\"{}\" NumberOfElements=\"{}\">{}</Topology>\n", type, cells, item);
}
std::string Geometry(const VtuSpec& spec) {
  return "<Geometry GeometryType=\"XYZ\">" + Numbers(fmt::format("{} 3", spec.points), ArrayOf(spec, "Points", "Points")) + "</Geometry>\n";
}
// Its cells, and behind each `flat`: a cell without a volume.
std::string Mixed(const VtuSpec& spec, const std::vector<double>& flat = {}) {
  const std::map<double, double> numbers = {{10, 6}, {14, 7}, {13, 8}, {12, 9}};  // XDMF's of VTK's
  const std::vector<double>&kinds = ArrayOf(spec, "Cells", "types"), &ends = ArrayOf(spec, "Cells", "offsets");
  std::vector<double> mixed;
  std::size_t corner = 0;
  for (std::size_t cell = 0; cell < kinds.size(); ++cell) {
    mixed.push_back(numbers.at(kinds[cell]));
    while (double(corner) < ends[cell]) mixed.push_back(ArrayOf(spec, "Cells", "connectivity")[corner++]);
    mixed.insert(mixed.end(), flat.begin(), flat.end());
  }
  return Topology("Mixed", kinds.size() * (flat.empty() ? 1 : 2), Numbers(mixed));
}
std::string Values(const VtuSpec& spec, int copies = 1) {
  std::vector<double> numbers;
  for (const double number : ArrayOf(spec, "CellData", "number")) numbers.insert(numbers.end(), std::size_t(copies), number);
  return Attribute("height", Numbers(ArrayOf(spec, "PointData", "height")), kOfPoints) + Attribute("number", Numbers(numbers), kOfCells);
}

class XdmfMeshTest : public testing::Test {
 protected:
  std::string Write(const std::string& inside) {
    WriteFile(directory_ / "a.xmf",
              "<Xdmf Version=\"3.0\" xmlns:xi=\"http://www.w3.org/2001/XInclude\"><Domain>\n" + inside + "</Domain></Xdmf>\n");
    return directory_ / "a.xmf";
  }
  std::string WriteVtu(const std::string& name, const VtuSpec& spec) {
    WriteFile(directory_ / name, VtuFile(spec));
    return directory_ / name;
  }
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options) {
    return OpenSource(path, options, context_);
  }
  std::shared_ptr<const Volume> Read(const std::string& path, const ReadOptions& options) {
    const Result<LevelInMemory> level = Opened(Open(path, options))->ReadLevel(0);
    EXPECT_TRUE(level.ok()) << level.status().message();
    return level.ok() ? level->volume : std::make_shared<const Volume>();
  }
  void ExpectSame(const std::string& path, const std::string& other, ReadOptions options = {}) {
    for (const char* const array : {"height", "number"}) {
      SCOPED_TRACE(array);
      options.array = array;
      const auto a = Read(path, options), b = Read(other, {.array = array});
      EXPECT_EQ(a->description, b->description);
      EXPECT_EQ(a->block.bytes, b->block.bytes);
      ASSERT_NE(a->cells, nullptr);
      ASSERT_NE(b->cells, nullptr);
      EXPECT_EQ(a->cells->points, b->cells->points);
      EXPECT_EQ(a->cells->tetrahedra, b->cells->tetrahedra);
      EXPECT_EQ(a->cells->values, b->cells->values);
    }
  }

  TemporaryDirectory directory_;
  SourceContext context_ = TestReadContext();
};

TEST_F(XdmfMeshTest, CellsOfAnyKindAreThoseOfAVtuFile) {
  const VtuSpec spec = SmallGrid();
  const std::string vtu = WriteVtu("a.vtu", spec);
  ExpectSame(Write(Grid(Mixed(spec) + Geometry(spec) + Values(spec))), vtu);
  // Triangles, lines and points have no volume: their values are left out, too.
  for (const std::vector<double>& flat :
       {std::vector<double>{4, 0, 1, 2}, {5, 0, 1, 2, 3}, {2, 2, 0, 1}, {1, 1, 3}, {3, 5, 0, 1, 2, 3, 4}}) {
    ExpectSame(Write(Grid(Mixed(spec, flat) + Geometry(spec) + Values(spec, 2))), vtu);
  }
  const VtuSpec cubes = BoxOfHexahedra({0, 0, 0}, {3, 2, 2}, Sheared);
  const std::vector<double>& corners = ArrayOf(cubes, "Cells", "connectivity");
  const std::string topology = Topology("Hexahedron", std::size_t(cubes.cells), Numbers(fmt::format("{} 8", cubes.cells), corners));
  ExpectSame(Write(Grid(topology + Geometry(cubes) + Values(cubes))), WriteVtu("cubes.vtu", cubes));
}

TEST_F(XdmfMeshTest, ArraysMayLieInHdf5AndBinaryFiles) {
  const VtuSpec cubes = BoxOfHexahedra({0, 0, 0}, {3, 2, 2}, Sheared);
  const auto points = hsize_t(cubes.points), cells = hsize_t(cubes.cells);
  {
    Hdf5Writer file(directory_ / "a.h5");
    file.Doubles("/mesh/points", {points, 3}, ArrayOf(cubes, "Points", "Points"));
    const std::vector<double>& corners = ArrayOf(cubes, "Cells", "connectivity");
    const std::vector<std::int32_t> whole(corners.begin(), corners.end());
    file.Write("/mesh/cells", {.size = {cells, 8}, .chunk = {5, 3}, .type = SampleType::kInt32}, whole.data());
    // The heights are one of two columns.
    std::vector<double> heights;
    for (const double height : ArrayOf(cubes, "PointData", "height")) heights.insert(heights.end(), {-1, height});
    file.Doubles("/heights", {points, 2}, heights);
  }
  WriteFile(directory_ / "numbers.bin", "ab" + EncodeSamples(SampleType::kFloat64, ArrayOf(cubes, "CellData", "number"), true));
  const auto hdf = [](const std::string& size, const std::string& place) {
    return fmt::format("<DataItem Dimensions=\"{}\" Format=\"HDF\">{}</DataItem>", size, place);
  };
  const std::string column = fmt::format("<DataItem ItemType=\"HyperSlab\"><DataItem>0 1 1 1 {} 1</DataItem>{}</DataItem>", points,
                                         hdf(fmt::format("{} 2", points), "a.h5:/heights"));
  const std::string numbers = fmt::format(
      "<DataItem Dimensions=\"{}\" Format=\"Binary\" NumberType=\"Float\" Precision=\"8\" Endian=\"Big\" Seek=\"2\">numbers.bin</DataItem>",
      cells);
  const std::string grid = Grid(Topology("Hexahedron", cells, hdf(fmt::format("{} 8", cells), "a.h5:/mesh/cells")) + "<Geometry>" +
                                hdf(fmt::format("{} 3", points), "a.h5:/mesh/points") + "</Geometry>" +
                                Attribute("height", column, kOfPoints) + Attribute("number", numbers, kOfCells));
  ExpectSame(Write(grid), WriteVtu("a.vtu", cubes));
}

TEST_F(XdmfMeshTest, CurvilinearGridsBecomeHexahedra) {
  const VtuSpec cubes = BoxOfHexahedra({0, 0, 0}, {3, 2, 4}, Sheared);
  std::array<std::vector<double>, 3> xyz;
  const std::vector<double>& places = ArrayOf(cubes, "Points", "Points");
  for (std::size_t i = 0; i < places.size(); ++i) xyz[i % 3].push_back(places[i]);
  std::string apart;
  for (const std::vector<double>& axis : xyz) apart += Numbers(axis);
  for (const std::string& geometry : {Geometry(cubes), "<Geometry GeometryType=\"X_Y_Z\">" + apart + "</Geometry>"}) {
    ExpectSame(Write(Grid("<Topology TopologyType=\"3DSMesh\" Dimensions=\"5 3 4\"/>" + geometry + Values(cubes))),
               WriteVtu("a.vtu", cubes));
  }
}

TEST_F(XdmfMeshTest, PiecesInSpaceBecomeOneGrid) {
  const VtuSpec a = BoxOfHexahedra({0, 0, 0}, {3, 2, 2}, Sheared), b = BoxOfHexahedra({3, 0, 0}, {5, 2, 2}, Sheared);
  WriteVtu("0.vtu", a);
  WriteVtu("1.vtu", b);
  WriteFile(directory_ / "all.pvtu", VtkListFile("PUnstructuredGrid", {"0.vtu", "1.vtu"}));
  ExpectSame(Write(Collection("Spatial", Grid(Mixed(a) + Geometry(a) + Values(a)) + Grid(Mixed(b) + Geometry(b) + Values(b)))),
             directory_ / "all.pvtu");
  ExpectKeptCellsAreTheSame(directory_ / "a.xmf", {.array = "height"}, context_, directory_ / "cache");
}

// As DOLFIN, DOLFINx and meshio write them: a grid without values, and times that include its cells and points.
TEST_F(XdmfMeshTest, TimesShareTheCellsOfOneGrid) {
  const VtuSpec spec = SmallGrid();
  VtuSpec later = spec;
  for (VtuArray& array : later.arrays) {
    if (array.section == "PointData" || array.section == "CellData") {
      for (double& value : array.values) value = 3 * value + 1;
    }
  }
  const std::string vtu[] = {WriteVtu("0.vtu", spec), WriteVtu("1.vtu", later)};
  const std::string mesh = Mixed(spec) + Geometry(spec);
  for (const std::string path :
       {"/Xdmf/Domain/Grid[@Name='mesh']", "//Grid[@Name=&quot;mesh&quot;]", "/Xdmf/Domain/Grid[@GridType='Uniform'][1]"}) {
    SCOPED_TRACE(path);
    const std::string include = "<xi:include xpointer=\"xpointer(" + path + "/*[self::Topology or self::Geometry])\"/>";
    const std::string file =
        Write(Grid(mesh, Named("mesh")) + Collection("Temporal", Grid(include + "<Time Value=\"0.5\"/>" + Values(spec)) +
                                                                     Grid(include + "<Time Value=\"0.75\"/>" + Values(later))));
    for (const int time : {0, 1}) ExpectSame(file, vtu[time], {.time = TimeRange{time, time}});
    EXPECT_EQ(Opened(Open(file, {.time = TimeRange{1, 1}, .array = "height"}))->info().times.count, 2);
  }
  // The first time may hold the mesh.
  const std::string first = "<xi:include xpointer=\"xpointer(/Xdmf/Domain/Grid/Grid[1]/*[self::Topology or self::Geometry])\"/>";
  ExpectSame(Write(Collection("Temporal", Grid(mesh + Values(spec)) + Grid(first + Values(later)))), vtu[1], {.time = TimeRange{1, 1}});
}

TEST_F(XdmfMeshTest, WhatIsWrongIsSaidInOneLine) {
  const VtuSpec spec = SmallGrid();
  const std::string good = Grid(Mixed(spec) + Geometry(spec) + Values(spec));
  ASSERT_TRUE(Open(Write(good), {.array = "height"}).ok());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = good;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return changed.replace(at, from.size(), to);
  };
  const std::string include = "<xi:include xpointer=\"xpointer(/Xdmf/Domain/Grid/*[self::Topology])\"/>";
  const std::pair<std::string, const char*> cases[] = {
      {with("Center=\"Node\"", "Center=\"Node\" ItemType=\"FiniteElementFunction\""), "ItemType 'finiteelementfunction' is not supported"},
      {with("\"XYZ\"", "\"XY\""), "GeometryType 'xy' is not supported for cells; supported: XYZ and X_Y_Z"},
      {with("\"Mixed\"", "\"Polyhedron\""), "TopologyType 'polyhedron' is not supported; supported: 3DCoRectMesh"},
      {with("\"Mixed\"", "\"Tetrahedron\""), "Topology: has 25 numbers, must have 4 a cell"},
      {with("NumberOfElements=\"4\"", "NumberOfElements=\"5\""), "has 4 cells, but Dimensions says 5"},
      {with("NumberOfElements=\"4\"", "NumberOfElements=\"4\" BaseOffset=\"1\""), "has an Order or a BaseOffset, which is not supported"},
      {with(">8 0 1 3", ">48 0 1 3"), "cell 0 is of kind 48, which is not supported"},
      {with(">8 0 1 3", ">8 0 1 99"), "cell 0 has point 99, must be in [0, 10)"},
      {with(" 6 1 9 2 5<", " 3 9 1 2 5<"), "cell 3 has more points than the item has numbers"},
      {with("Dimensions=\"10\"", "Dimensions=\"5 2 1\""), ""},
      {with("Dimensions=\"10 3\"", "Dimensions=\"10 2\""), "has 20 numbers, must have 3 a point"},
      {with("Center=\"Node\"", "Center=\"Cell\""), "has 10 numbers, must have 1 for each of 4 cells"},
      {Grid(include + Geometry(spec) + Values(spec)), "includes '"},
      {Collection("Spatial", good + Grid("<Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"2 2 2\"/>")), "pieces must be of one kind"},
      {Collection("Spatial", good + Grid(Mixed(spec) + Geometry(spec))), "has no attribute 'height' of points, which"},
  };
  for (const auto& [inside, why] : cases) {
    const Result<std::shared_ptr<VolumeSource>> source = Open(Write(inside), {.array = "height"});
    if (*why == '\0') {
      EXPECT_TRUE(source.ok()) << source.status().message();
    } else {
      ExpectRefusal(source, why);
    }
  }
  ExpectRefusal(Open(Write(good), {.array = "none"}), "has no array 'none'; it has height, number");
}

}  // namespace
}  // namespace slabstream
