// .pvti and .pvtr, whose pieces lie in files of their own, and .vtm and its like of images.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <random>
#include <string>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/volume_io/mesh_reader.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::ContainsRegex;

constexpr Index3 kPoints = {14, 9, 11};
constexpr Index3 kFirst = {-3, 2, 100};  // the extent of which begins there

std::string ExtentOf(const Box& points) {
  const Index3 low = points.begin + kFirst, high = points.end + kFirst - Uniform(1);
  return fmt::format("{} {} {} {} {} {}", low.x, high.x, low.y, high.y, low.z, high.z);
}

// Numbers along x, then y, then z.
template <class F>
std::string Numbers(const Box& box, F value) {
  std::string text;
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
      for (std::int32_t x = box.begin.x; x < box.end.x; ++x) text += fmt::format("{} ", value(x, y, z));
    }
  }
  return text;
}

int PointValue(int x, int y, int z) { return x + 20 * y + 400 * z; }
int CellValue(int x, int y, int z) { return 7 * x + 3 * y + z; }

class ParallelImage : public testing::Test {
 protected:
  // Writes the pieces, whose points are those of `boxes`, and the file that names them.
  std::string Write(const std::string& kind, const std::vector<Box>& boxes, const std::string& attributes = "") const {
    const std::string letters = kind == "ImageData" ? "vti" : "vtr";
    std::string pieces;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const std::string name = fmt::format("parts/piece {}.{}", i, letters), extent = ExtentOf(boxes[i]);
      const Box cells = {boxes[i].begin, boxes[i].end - Uniform(1)};
      std::string coordinates;
      for (int axis = 0; axis < 3 && letters == "vtr"; ++axis) {
        coordinates += "<DataArray type=\"Float64\" format=\"ascii\">";
        for (std::int32_t at = boxes[i].begin[axis]; at < boxes[i].end[axis]; ++at) coordinates += fmt::format("{} ", CoordinateOf(at));
        coordinates += "</DataArray>";
      }
      const auto array = [](const std::string& array_name, const std::string& text) {
        return fmt::format("<DataArray type=\"Int16\" Name=\"{}\" format=\"ascii\">{}</DataArray>", array_name, text);
      };
      WriteFile(directory_ / name,
                fmt::format("<VTKFile type=\"{0}\" byte_order=\"LittleEndian\"><{0} WholeExtent=\"{1}\" {2}><Piece Extent=\"{1}\">"
                            "<PointData>{3}</PointData><CellData>{4}</CellData><Coordinates>{5}</Coordinates></Piece></{0}></VTKFile>",
                            kind, extent, attributes, array("p", Numbers(boxes[i], PointValue)), array("c", Numbers(cells, CellValue)),
                            coordinates));
      pieces += fmt::format("<Piece Extent=\"{}\" Source=\"{}\"/>", extent, name);
    }
    std::string path = directory_ / ("whole.p" + letters);
    WriteFile(path, fmt::format("<VTKFile type=\"P{0}\" byte_order=\"LittleEndian\"><P{0} WholeExtent=\"{1}\" GhostLevel=\"0\" {2}>"
                                "<PPointData><PDataArray type=\"Int16\" Name=\"p\"/></PPointData>"
                                "<PCellData><PDataArray type=\"Int16\" Name=\"c\"/></PCellData>{3}</P{0}></VTKFile>",
                                kind, ExtentOf({{0, 0, 0}, kPoints}), attributes, pieces));
    return path;
  }
  // Writes the same pieces as blocks that do not know of each other: each begins at 0.
  std::string WriteBlocks(const std::string& kind, const std::vector<Box>& boxes, const std::string& type = "vtkMultiBlockDataSet") const {
    const std::string ending = kind == "ImageData" ? "vti" : "vtr";
    Write(kind, boxes);
    std::vector<std::string> files;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      files.push_back(fmt::format("parts/piece {}.{}", i, ending));
      FileBytes text = ReadFile(directory_ / files.back());
      const std::string extent = ExtentOf(boxes[i]), own = ExtentOf({-kFirst, boxes[i].size() - kFirst});
      for (std::size_t at = text.find(extent); at != FileBytes::npos; at = text.find(extent, at + 1)) text.replace(at, extent.size(), own);
      const std::size_t at = text.find("WholeExtent");
      const Vec3 origin = ToVec3(kFirst) + 0.5 * ToVec3(boxes[i].begin);
      if (ending == "vti") text.insert(at, fmt::format(R"(Origin="{} {} {}" Spacing="0.5 0.5 0.5" )", origin.x, origin.y, origin.z));
      WriteFile(directory_ / files.back(), text);
    }
    std::string path = directory_ / "whole.vtm";
    WriteFile(path, VtkListFile(type, files));
    return path;
  }
  static std::string WhyNot(const std::string& path, const ReadOptions& options = {.array = "p"}) {
    return ReadVolume(path, options).status().message();
  }

  // Blocks that meet at their points, as VTK's writers make them.
  static std::vector<Box> Blocks() {
    std::vector<Box> blocks;
    for (const auto& [z_begin, z_end] : {std::pair(0, 5), std::pair(4, 11)}) {
      for (const auto& [x_begin, x_end] : {std::pair(0, 4), std::pair(3, 10), std::pair(9, 14)}) {
        blocks.push_back({{x_begin, 0, z_begin}, {x_end, kPoints.y, z_end}});
      }
    }
    return blocks;
  }
  static double ValueAt(const LoadedVolume& read, const Index3& v) {
    return read.volume->description.mapping.FromStored(double(read.volume->block.samples<std::uint16_t>()[read.volume->block.Offset(v)]));
  }

  double CoordinateOf(int point) const { return 5 + 0.5 * point + bend_ * point * point; }

  double bend_ = 0;
  const TemporaryDirectory directory_;
};

TEST_F(ParallelImage, PiecesAreOneVolumeOfPointsOrCells) {
  for (const std::string kind : {"ImageData", "RectilinearGrid"}) {
    SCOPED_TRACE(kind);
    const std::string path = Write(kind, Blocks(), kind == "ImageData" ? R"(Origin="5 6 7" Spacing="0.5 0.5 0.5")" : "");
    const Result<LoadedVolume> points = ReadVolume(path, {.array = "p"}), cells = ReadVolume(path, {.array = "c"});
    ASSERT_TRUE(points.ok() && cells.ok()) << points.status().message() << cells.status().message();
    EXPECT_EQ(points->info.finest().geometry.size, kPoints);
    EXPECT_EQ(cells->info.finest().geometry.size, kPoints - Uniform(1));
    EXPECT_EQ(points->info.files.size(), 7U);
    const Vec3 first = kind == "ImageData" ? Vec3{5, 6, 7} + 0.5 * ToVec3(kFirst) : Vec3{5, 5, 5};
    EXPECT_EQ(points->info.finest().geometry.ToWorld({}), first);
    EXPECT_EQ(cells->info.finest().geometry.ToWorld({}), (first + Vec3{0.25, 0.25, 0.25}));
    for (std::int32_t z = 0; z < kPoints.z - 1; ++z) {
      for (std::int32_t y = 0; y < kPoints.y - 1; ++y) {
        for (std::int32_t x = 0; x < kPoints.x - 1; ++x) {
          ASSERT_EQ(ValueAt(*points, {x, y, z}), PointValue(x, y, z));
          ASSERT_EQ(ValueAt(*cells, {x, y, z}), CellValue(x, y, z));
        }
      }
    }
  }
}

TEST_F(ParallelImage, UnevenCoordinatesOfPiecesPlaceVoxelsOrAreResampled) {
  bend_ = 0.02;
  const std::string path = Write("RectilinearGrid", Blocks());
  const Result<LoadedVolume> own = ReadVolume(path, {.array = "p"});
  ASSERT_TRUE(own.ok()) << own.status().message();
  const VolumeGeometry& grid = own->info.finest().geometry;
  EXPECT_EQ(grid.size, kPoints);
  for (std::int32_t i = 0; i < kPoints.x; ++i) {
    EXPECT_NEAR(grid.ToWorld(grid.stretch.ToData(ToVec3({i, 0, 0}))).x, CoordinateOf(i), 1e-6);
    EXPECT_EQ(ValueAt(*own, {i, 2, 1}), PointValue(i, 2, 1));
  }
  const auto place = [&](double coordinate) {
    int point = 0;
    while (CoordinateOf(point + 1) < coordinate) ++point;
    return point + (coordinate - CoordinateOf(point)) / (CoordinateOf(point + 1) - CoordinateOf(point));
  };
  const auto source = Opened(OpenSource(path, {.array = "p", .resample = 0}, TestReadContext()));
  ExpectValuesOfPlaces(*source, {5, 5, 5}, {CoordinateOf(kPoints.x - 1), CoordinateOf(kPoints.y - 1), CoordinateOf(kPoints.z - 1)},
                       [&](const Vec3& at) { return place(at.x) + 20 * place(at.y) + 400 * place(at.z); });
}

// x of the file runs along -y of the world, and y along x.
TEST_F(ParallelImage, PiecesAreTurnedAsTheWholeIs) {
  const Result<LoadedVolume> read = ReadVolume(Write("ImageData", Blocks(), R"(Direction="0 1 0 -1 0 0 0 0 1")"), {.array = "p"});
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->info.finest().geometry.size, (Index3{kPoints.y, kPoints.x, kPoints.z}));
  for (std::int32_t x = 0; x < kPoints.x; ++x) {
    for (std::int32_t y = 0; y < kPoints.y; ++y) ASSERT_EQ(ValueAt(*read, {y, kPoints.x - 1 - x, 5}), PointValue(x, y, 5));
  }
}

// Their order does not matter: where the first block lies is one of many places.
TEST_F(ParallelImage, BlocksAreOneVolumeOfPointsOrCells) {
  for (const std::string kind : {"ImageData", "RectilinearGrid"}) {
    for (const char* const type : {"vtkMultiBlockDataSet", "vtkPartitionedDataSet", "vtkPartitionedDataSetCollection"}) {
      SCOPED_TRACE(kind + " in " + type);
      std::vector<Box> boxes = Blocks();
      std::ranges::rotate(boxes, boxes.begin() + 4);
      const std::string path = WriteBlocks(kind, boxes, type);
      EXPECT_FALSE(LooksLikeMesh(path));
      const Vec3 first = kind == "ImageData" ? ToVec3(kFirst) : Vec3{5, 5, 5};
      for (const bool cells : {false, true}) {
        const Result<LoadedVolume> read = ReadVolume(path, {.array = cells ? "c" : "p"});
        ASSERT_TRUE(read.ok()) << read.status().message();
        const auto& [size, spacing, orientation, stretch] = read->info.finest().geometry;
        ASSERT_EQ(size, cells ? kPoints - Uniform(1) : kPoints);
        EXPECT_EQ(spacing, (Vec3{0.5, 0.5, 0.5}));
        EXPECT_EQ(orientation.origin, (first + (cells ? 0.25 : 0) * Vec3{1, 1, 1}));
        EXPECT_EQ(read->info.files.size(), 7U);
        for (std::int32_t z = 0; z < size.z; ++z) {
          for (std::int32_t y = 0; y < size.y; ++y) {
            for (std::int32_t x = 0; x < size.x; ++x) ASSERT_EQ(ValueAt(*read, {x, y, z}), (cells ? CellValue : PointValue)(x, y, z));
          }
        }
      }
    }
  }
}

TEST_F(ParallelImage, BlocksMayBePiecesAndHaveSurfacesBeside) {
  Write("ImageData", Blocks());
  WriteFile(directory_ / "wall.vtp", "<VTKFile type=\"PolyData\"><PolyData/></VTKFile>");
  WriteFile(directory_ / "all.vtm",
            "<VTKFile type=\"vtkMultiBlockDataSet\"><vtkMultiBlockDataSet><DataSet name=\"wall\" file=\"wall.vtp\"/>"
            "<Block><DataSet/><DataSet file=\"whole.pvti\"/></Block></vtkMultiBlockDataSet></VTKFile>");
  const Result<LoadedVolume> read = ReadVolume(directory_ / "all.vtm", {.array = "p"}),
                             pieces = ReadVolume(directory_ / "whole.pvti", {.array = "p"});
  ASSERT_TRUE(read.ok() && pieces.ok()) << read.status().message();
  EXPECT_EQ(read->info.files.size(), 8U);
  EXPECT_THAT(read->info.notes, testing::Contains("surfaces are left out: wall"));
  EXPECT_EQ(read->info.finest().geometry, pieces->info.finest().geometry);
  EXPECT_TRUE(std::ranges::equal(read->volume->block.bytes, pieces->volume->block.bytes));
}

TEST_F(ParallelImage, BlocksThatAreApartAlongEvenAxesShareTheUnevenOnes) {
  bend_ = 0.02;
  const std::vector<Box> boxes = {{{0, 0, 0}, kPoints}, {{0, 0, 0}, {14, 9, 4}}};
  EXPECT_EQ(Opened(OpenSource(WriteBlocks("RectilinearGrid", {boxes[0], boxes[0]}), {.array = "p"}, TestReadContext()))
                ->info()
                .finest()
                .geometry.size,
            kPoints);
  EXPECT_THAT(WhyNot(WriteBlocks("RectilinearGrid", boxes)),
              HasSubstr("piece 1.vtr: along z its coordinates must be even, or the same, as those of the first block"));
}

TEST_F(ParallelImage, WhatIsWrongWithBlocksIsSaidInOneLine) {
  const auto with = [&](int block, const std::string& from, const std::string& to) {
    const std::string path = WriteBlocks("ImageData", Blocks()), file = directory_ / fmt::format("parts/piece {}.vti", block);
    FileBytes text = ReadFile(file);
    WriteFile(file, text.replace(text.find(from), from.size(), to));
    return WhyNot(path);
  };
  const std::string path = WriteBlocks("ImageData", Blocks());
  EXPECT_THAT(WhyNot(path, {.array = "q"}), AllOf(HasSubstr("whole.vtm: "), HasSubstr("piece 0.vti: has no array 'q'; it has p, c")));
  std::vector<Box> boxes = Blocks();
  boxes.pop_back();
  EXPECT_THAT(WhyNot(WriteBlocks("ImageData", boxes)), HasSubstr("whole.vtm: its parts hold"));
  EXPECT_THAT(
      with(4, "Spacing=\"0.5", "Spacing=\"0.51"),
      ContainsRegex("whole.vtm: .*piece 4.vti: along x its voxels are 0.51 0 0 apart, must be 0.5 0 0, as those of the first block"));
  EXPECT_THAT(with(1, "Origin=\"-1.5", "Origin=\"-1.375"),
              HasSubstr("piece 1.vti: along x its voxels begin at 3.25, must begin at a whole number"));
  EXPECT_THAT(with(1, "Origin=\"-1.5", "Origin=\"1e300"), HasSubstr("piece 1.vti: along x its voxels begin at"));
  EXPECT_THAT(with(0, "Spacing=\"0.5", "Spacing=\"nan"), HasSubstr("piece 1.vti: along x its voxels are"));
  EXPECT_THAT(with(0, "Spacing=\"0.5", "Spacing=\"0"), HasSubstr("piece 1.vti: along x its voxels are"));
  EXPECT_THAT(with(2, "Name=\"p\"", "Name=\"r\""), HasSubstr("piece 2.vti: has no array 'p'; it has r, c"));
  EXPECT_THAT(with(2, "Int16\" Name=\"p\"", "Int16\" Name=\"p\" NumberOfComponents=\"3\""),
              HasSubstr("piece 2.vti: a VTK image with 3 components, must be a VTK image with 1, as the first block"));
  EXPECT_THAT(with(3, "Int16", "Int32"), HasSubstr("piece 3.vti has samples of int32 from 0 and scale 1, must have int16"));
  const auto list = [&](const std::vector<std::string>& files) {
    WriteFile(path, VtkListFile("vtkMultiBlockDataSet", files));
    return WhyNot(path);
  };
  WriteFile(directory_ / "g.vtu", VtuFile(SmallGrid()));
  EXPECT_THAT(list({"parts/piece 0.vti", "g.vtu"}),
              HasSubstr("g.vtu: a VTK file of type 'UnstructuredGrid', must be ImageData or PImageData or"));
  EXPECT_THAT(list({"parts/piece 0.vti", "gone.vti"}), HasSubstr("gone.vti: cannot be opened for reading"));
  EXPECT_THAT(list({"parts/piece 0.vti", "whole.vtm"}),
              HasSubstr("whole.vtm: a VTK file of type 'vtkMultiBlockDataSet', must be ImageData"));
  WriteBlocks("RectilinearGrid", Blocks());
  EXPECT_THAT(list({"parts/piece 0.vti", "parts/piece 0.vtr"}),
              HasSubstr("piece 0.vtr: a VTK rectilinear grid with 1 components, must be a VTK image"));
}

TEST_F(ParallelImage, ListsOfBlocksThatAreCutOffOrAlteredDoNoHarm) {
  Random random(17);
  SCOPED_TRACE(random.trace());
  const std::string path = WriteBlocks("ImageData", {{{0, 0, 0}, {3, 3, 3}}, {{2, 0, 0}, {5, 3, 3}}});
  for (const std::string& file : {path, directory_ / "parts/piece 1.vti"}) {
    const FileBytes good = ReadFile(file);
    for (int i = 0; i < 400; ++i) {
      FileBytes bytes = good;
      if (random.Chance(0.1)) bytes.resize(random.Integer<std::size_t>(0, good.size()));
      for (int flips = random.Integer(1, 3); flips > 0 && !bytes.empty(); --flips) {
        Damage(bytes[random.Integer<std::size_t>(0, bytes.size() - 1)], random);
      }
      WriteFile(file, bytes);
      const Result<LoadedVolume> read = ReadVolume(path, {.array = "p"});
      EXPECT_THAT(read.status().message(), testing::AnyOf("", AllOf(HasSubstr(directory_ / ""), testing::Not(HasSubstr("\n")))));
    }
    WriteFile(file, good);
  }
}

TEST_F(ParallelImage, WhatIsWrongIsSaidInOneLine) {
  const std::string path = Write("ImageData", Blocks());
  EXPECT_THAT(WhyNot(path, {.array = "q"}), HasSubstr("p, c"));
  std::vector<Box> blocks = Blocks();
  blocks.pop_back();
  EXPECT_THAT(WhyNot(Write("ImageData", blocks)), HasSubstr("whole.pvti: its parts hold"));
  const auto with = [&](const std::string& from, const std::string& to) {
    FileBytes text = ReadFile(Write("ImageData", Blocks()));
    WriteFile(path, text.replace(text.find(from), from.size(), to));
    return WhyNot(path);
  };
  EXPECT_THAT(with("parts/piece 5.vti", "parts/piece 9.vti"), HasSubstr("piece 9.vti: No such file"));
  EXPECT_THAT(with("parts/piece 5.vti", "whole.pvti"), HasSubstr("whole.pvti: a VTK file of type 'PImageData', must be ImageData"));
  EXPECT_THAT(with("parts/piece 5.vti", "parts/piece 4.vti"),
              ContainsRegex("whole.pvti: .*/piece 4.vti has 7 x 9 x 7 voxels, must have 5 x 9 x 7"));
  ASSERT_EQ(::mkfifo((directory_ / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(with("parts/piece 5.vti", "pipe"), HasSubstr("piece 5 names pipe, which is not a file that can be read"));
  EXPECT_THAT(with("Source=\"parts/piece 0.vti\"", ""), HasSubstr("piece 0 names no file: Source is missing"));
  EXPECT_THAT(with("type=\"Int16\" Name=\"p\"", "type=\"Int32\" Name=\"p\""),
              HasSubstr("piece 0.vti has samples of int16 from 0 and scale 1, must have int32"));
  EXPECT_THAT(with("Name=\"p\"", "Name=\"r\""), HasSubstr("r, c"));
}

}  // namespace
}  // namespace slabstream
