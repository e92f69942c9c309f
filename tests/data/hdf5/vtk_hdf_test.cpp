// VTKHDF files of grids: those with cells are held against the same grid in a .vtu file, adaptive meshes against a field of their places.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "data/open/open_source.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/kept_cells.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

const std::string kRoot = "/VTKHDF";

Vec3 Sheared(const Vec3& number) { return {number.x + 0.5 * number.y, number.y - 0.25 * number.z, number.z}; }

class VtkHdfTest : public testing::Test {
 protected:
  Result<std::shared_ptr<VolumeSource>> Open(const ReadOptions& options = {}) { return OpenSource(path_, options, context_); }
  std::shared_ptr<const Volume> Read(const std::string& path, const ReadOptions& options) {
    const Result<LevelInMemory> level = Opened(OpenSource(path, options, context_))->ReadLevel(0);
    EXPECT_TRUE(level.ok()) << level.status().message();
    return level.ok() ? level->volume : std::make_shared<const Volume>();
  }
  static const std::vector<double>& Array(const VtuSpec& spec, const std::string& section, const std::string& name) {
    for (const VtuArray& array : spec.arrays) {
      if (array.section == section && (array.name == name || section == "Points")) return array.values;
    }
    static const std::vector<double> kNone;
    return kNone;
  }
  static void WriteNumbers(Hdf5Writer& file, const std::string& path, const std::vector<double>& numbers, hsize_t columns = 1,
                           SampleType type = SampleType::kInt64, hsize_t chunk = 3) {
    const hsize_t rows = numbers.size() / columns;
    const std::vector<hsize_t> size = columns == 1 ? std::vector{rows} : std::vector{rows, columns};
    std::vector<hsize_t> chunks = {std::min(chunk, rows)};
    if (columns > 1) chunks.push_back(columns);
    if (chunk == 0) chunks.clear();
    if (type == SampleType::kInt64) {
      const std::vector<std::int64_t> whole(numbers.begin(), numbers.end());
      file.Write(path, {.size = size, .chunk = chunks, .type = type}, whole.data());
    } else {
      file.Write(path, {.size = size, .chunk = chunks, .type = type}, numbers.data());
    }
  }
  // The pieces, one behind the other, as a block at `group`.
  static void WriteBlock(Hdf5Writer& file, const std::string& group, const std::vector<VtuSpec>& pieces) {
    std::vector<double> points, cells, corners, places, kinds, offsets, connectivity, heights, numbers;
    const auto add = [](std::vector<double>& to, const std::vector<double>& more) { to.insert(to.end(), more.begin(), more.end()); };
    for (const VtuSpec& piece : pieces) {
      points.push_back(piece.points);
      cells.push_back(piece.cells);
      corners.push_back(double(Array(piece, "Cells", "connectivity").size()));
      offsets.push_back(0);
      add(places, Array(piece, "Points", ""));
      add(kinds, Array(piece, "Cells", "types"));
      add(offsets, Array(piece, "Cells", "offsets"));
      add(connectivity, Array(piece, "Cells", "connectivity"));
      add(heights, Array(piece, "PointData", "height"));
      add(numbers, Array(piece, "CellData", "number"));
    }
    file.Group(group);
    file.Text(group, "Type", "UnstructuredGrid");
    WriteNumbers(file, group + "/NumberOfPoints", points);
    WriteNumbers(file, group + "/NumberOfCells", cells);
    WriteNumbers(file, group + "/NumberOfConnectivityIds", corners);
    WriteNumbers(file, group + "/Points", places, 3, SampleType::kFloat64);
    WriteNumbers(file, group + "/Types", kinds);
    WriteNumbers(file, group + "/Offsets", offsets, 1, SampleType::kInt64, 0);
    WriteNumbers(file, group + "/Connectivity", connectivity);
    WriteNumbers(file, group + "/PointData/height", heights, 1, SampleType::kFloat64);
    WriteNumbers(file, group + "/CellData/number", numbers);
  }
  std::string WriteVtu(const std::string& name, const VtuSpec& spec) {
    WriteFile(directory_ / name, VtuFile(spec));
    return directory_ / name;
  }
  // Two pieces that meet, as a list of .vtu files and as specs.
  std::vector<VtuSpec> pieces_ = {BoxOfHexahedra({0, 0, 0}, {3, 2, 2}, Sheared), BoxOfHexahedra({3, 0, 0}, {5, 2, 2}, Sheared)};
  std::string WritePieces() {
    WriteVtu("0.vtu", pieces_[0]);
    WriteVtu("1.vtu", pieces_[1]);
    WriteFile(directory_ / "all.pvtu", VtkListFile("PUnstructuredGrid", {"0.vtu", "1.vtu"}));
    return directory_ / "all.pvtu";
  }
  void ExpectSame(const Volume& a, const Volume& b) {
    EXPECT_EQ(a.description, b.description);
    EXPECT_EQ(a.block.bytes, b.block.bytes);
    ASSERT_NE(a.cells, nullptr);
    ASSERT_NE(b.cells, nullptr);
    EXPECT_EQ(a.cells->points, b.cells->points);
    EXPECT_EQ(a.cells->tetrahedra, b.cells->tetrahedra);
    EXPECT_EQ(a.cells->values, b.cells->values);
  }

  TemporaryDirectory directory_;
  const std::string path_ = directory_ / "a.vtkhdf";
  SourceContext context_ = TestReadContext();
};

TEST_F(VtkHdfTest, AGridIsThatOfAVtuFile) {
  {
    Hdf5Writer file(path_);
    WriteBlock(file, kRoot, {SmallGrid()});
  }
  const std::string vtu = WriteVtu("a.vtu", SmallGrid());
  for (const std::string array : {"height", "number"}) {
    const std::string dataset = array == "height" ? "VTKHDF/PointData/height" : array;
    ExpectSame(*Read(path_, {.lattice = 24, .dataset = dataset}), *Read(vtu, {.array = array, .lattice = 24}));
  }
  EXPECT_EQ(Opened(Open({.dataset = "height"}))->info().format, "VTKHDF");
  EXPECT_THAT(Open({.dataset = "none"}).status().message(), HasSubstr("has no array 'none'; it has height, number"));
}

TEST_F(VtkHdfTest, PartsAndBlocksBecomeOneGrid) {
  const std::string list = WritePieces();
  {
    Hdf5Writer file(path_);
    WriteBlock(file, kRoot, pieces_);
  }
  ExpectSame(*Read(path_, {.dataset = "height"}), *Read(list, {.array = "height"}));
  for (const char* const array : {"height", "number"}) ExpectKeptCellsAreTheSame(path_, {.dataset = array}, context_, directory_ / "cache");
  {
    Hdf5Writer file(path_);
    file.Group(kRoot);
    file.Text(kRoot, "Type", "PartitionedDataSetCollection");
    file.Group(kRoot + "/Assembly");
    WriteBlock(file, kRoot + "/a", {pieces_[0]});
    file.Group(kRoot + "/b");
    file.Text(kRoot + "/b", "Type", "PolyData");
    WriteBlock(file, kRoot + "/c", {pieces_[1]});
  }
  ExpectSame(*Read(path_, {.dataset = "height"}), *Read(list, {.array = "height"}));
}

// The second time has points of its own and shares the cells of the first.
TEST_F(VtkHdfTest, TimesMayShareCells) {
  VtuSpec later = SmallGrid();
  std::vector<double> heights = Array(later, "PointData", "height");
  for (VtuArray& array : later.arrays) {
    for (double& value : array.values) {
      if (array.section == "Points" || array.name == "height") value = 2 * value + 1;
    }
  }
  const auto write = [&](const std::string& broken, double offset) {
    Hdf5Writer file(path_);
    const VtuSpec first = SmallGrid();
    const std::string steps = kRoot + "/Steps";
    WriteBlock(file, kRoot, {first});
    for (const char* const name : {"Points", "PointData/height"}) H5Ldelete(file.file(), (kRoot + "/" + name).c_str(), H5P_DEFAULT);
    std::vector<double> places = Array(first, "Points", ""), values = Array(first, "PointData", "height");
    for (const double place : Array(later, "Points", "")) places.push_back(place);
    for (const double value : Array(later, "PointData", "height")) values.push_back(value);
    WriteNumbers(file, kRoot + "/Points", places, 3, SampleType::kFloat64);
    WriteNumbers(file, kRoot + "/PointData/height", values, 1, SampleType::kFloat64);
    file.Doubles(steps + "/Values", {2}, {0.5, 0.75});
    const auto at_step = [&](const std::string& name, double number) {
      WriteNumbers(file, steps + "/" + name, {0, name == broken ? offset : number});
    };
    at_step("PartOffsets", 0);
    WriteNumbers(file, steps + "/NumberOfParts", {1, 1});
    at_step("PointOffsets", first.points);
    at_step("CellOffsets", 0);
    at_step("ConnectivityIdOffsets", 0);
    at_step("PointDataOffsets/height", first.points);
  };
  write("", 0);
  const std::string vtu[] = {WriteVtu("0.vtu", SmallGrid()), WriteVtu("1.vtu", later)};
  for (const int time : {0, 1}) {
    const ReadOptions options{.time = TimeRange{time, time}, .dataset = "height"};
    ExpectSame(*Read(path_, options), *Read(vtu[time], {.array = "height"}));
    EXPECT_EQ(Opened(Open(options))->info().times.count, 2);
  }
  const auto refusal = [&](const std::string& broken, double offset) {
    write(broken, offset);
    return Open({.time = TimeRange{1, 1}, .dataset = "height"}).status().message();
  };
  EXPECT_THAT(refusal("PartOffsets", 1), HasSubstr("time 1 has parts 1 to 2, must be in [0, 1]"));
  EXPECT_THAT(refusal("PartOffsets", -1), HasSubstr("/VTKHDF/Steps/PartOffsets' has -1"));
  EXPECT_THAT(refusal("PointOffsets", 1e15), HasSubstr("/VTKHDF/Steps/PointOffsets' has 1000000000000000"));
  EXPECT_THAT(refusal("PointOffsets", 1e6), HasSubstr("are needed"));
  EXPECT_THAT(refusal("CellOffsets", 2), HasSubstr("are needed"));
  EXPECT_THAT(refusal("PointDataOffsets/height", 99), HasSubstr("are needed"));
}

TEST_F(VtkHdfTest, WhatIsWrongWithAGridIsSaidInOneLine) {
  const auto with = [&](const std::string& name, const std::vector<double>& numbers) {
    {
      Hdf5Writer file(path_);
      WriteBlock(file, kRoot, {SmallGrid()});
      H5Ldelete(file.file(), (kRoot + "/" + name).c_str(), H5P_DEFAULT);
      if (!numbers.empty()) WriteNumbers(file, kRoot + "/" + name, numbers);
    }
    const std::string message = Open({.dataset = "height"}).status().message();
    EXPECT_EQ(message.find('\n'), std::string::npos);
    return message;
  };
  EXPECT_THAT(with("Offsets", {}), HasSubstr("/VTKHDF/Offsets"));
  EXPECT_THAT(with("Types", {}), HasSubstr("/VTKHDF/Types"));
  EXPECT_THAT(with("Offsets", {0, 6, 12, 17, 22}), HasSubstr("Offsets reach from 0 to 22, must reach from 0 to 21"));
  EXPECT_THAT(with("NumberOfCells", {-1}), HasSubstr("must have a number from 0 on for each of"));
  EXPECT_THAT(with("NumberOfPoints", {1e9}), HasSubstr("are needed"));
  EXPECT_THAT(with("NumberOfPoints", {3, 4}), HasSubstr("must have a number from 0 on for each of"));
  EXPECT_THAT(with("Types", {13, 13, 14, 42}), HasSubstr("cell 3 has VTK's type 42"));
  EXPECT_THAT(with("PointData/height", {1, 2}), HasSubstr("are needed"));
  const auto of_type = [&](const std::string& type) {
    {
      Hdf5Writer file(path_);
      file.Group(kRoot);
      file.Text(kRoot, "Type", type);
    }
    return Open().status().message();
  };
  EXPECT_THAT(of_type("HyperTreeGrid"), HasSubstr("VTKHDF file of type 'HyperTreeGrid', which is not supported; supported: ImageData, Un"));
  EXPECT_THAT(of_type("MultiBlockDataSet"), HasSubstr("has no block of type UnstructuredGrid"));
}

// ---- adaptive meshes

constexpr Index3 kFirst = {-8, 0, 4}, kCoarse = {16, 8, 8};  // of level 0: the first cell, and how many there are

class VtkHdfAmrTest : public VtkHdfTest {
 protected:
  static double FieldAt(const Vec3& place, int time) { return place.x - 3 * place.y + 0.25 * place.z + 100 * time; }

  // Two levels, of which the finer one has two boxes. `times`: above 1 the file has Steps. `change`: of the boxes of the finer level.
  void Write(int times = 1, hsize_t chunk = 50, const std::function<void(std::vector<double>&)>& change = {}) {
    Hdf5Writer file(path_);
    file.Group(kRoot);
    file.Text(kRoot, "Type", "OverlappingAMR");
    file.Numbers(kRoot, "Origin", {1, 2, 3});
    if (times > 1) file.Doubles(kRoot + "/Steps/Values", {hsize_t(times)}, {0.5, 0.75});
    for (const int level : {0, 1}) {
      const std::string group = fmt::format("{}/Level{}", kRoot, level), steps = fmt::format("{}/Steps/Level{}", kRoot, level);
      const int factor = level + 1;
      const Index3 first = Uniform(factor) * kFirst;
      const std::vector<Box> boxes = level == 0 ? std::vector<Box>{{{0, 0, 0}, {16, 8, 4}}, {{0, 0, 4}, {16, 8, 8}}}
                                                : std::vector<Box>{{{4, 4, 4}, {12, 8, 12}}, {{12, 4, 8}, {20, 8, 12}}};
      std::vector<double> corners, values, vectors, offsets, counts, begins;
      for (int time = 0; time < times; ++time) {
        offsets.push_back(double(corners.size() / 6));
        begins.push_back(double(values.size()));
        counts.push_back(double(boxes.size()));
        for (const Box& box : boxes) {
          const Index3 low = box.begin + first, high = box.end + first;
          for (int axis = 0; axis < 3; ++axis) corners.insert(corners.end(), {double(low[axis]), double(high[axis] - 1)});
          for (int z = low.z; z < high.z; ++z) {
            for (int y = low.y; y < high.y; ++y) {
              for (int x = low.x; x < high.x; ++x) {
                values.push_back(FieldAt(Vec3{1, 2, 3} + (0.25 / factor) * Vec3{x + 0.5, y + 0.5, z + 0.5}, time));
                vectors.insert(vectors.end(), {7, values.back()});
              }
            }
          }
        }
      }
      if (level == 1 && change) change(corners);
      file.Group(group);
      file.Numbers(group, "Spacing", std::vector<double>(3, 0.25 / factor));
      WriteNumbers(file, group + "/AMRBox", corners, 6, SampleType::kInt64, chunk);
      WriteNumbers(file, group + "/CellData/v", values, 1, SampleType::kFloat64, chunk);
      WriteNumbers(file, group + "/CellData/w", vectors, 2, SampleType::kFloat64, chunk);
      if (times == 1) continue;
      WriteNumbers(file, steps + "/AMRBoxOffset", offsets);
      WriteNumbers(file, steps + "/NumberOfAMRBox", counts);
      WriteNumbers(file, steps + "/CellDataOffset/v", begins);
      WriteNumbers(file, steps + "/CellDataOffset/w", begins);
    }
  }
  void ExpectField(const ReadOptions& options, int time) {
    const std::shared_ptr<VolumeSource> source = Opened(Open(options));
    ASSERT_EQ(source->info().levels.size(), 2U);
    ASSERT_EQ(source->info().levels[0].refined->size(), 2U);
    EXPECT_EQ(source->info().finest().geometry.size, Uniform(2) * kCoarse);
    // Beyond the centres of the coarse cells values are constant.
    const Vec3 corner = Vec3{1, 2, 3} + 0.25 * ToVec3(kFirst), half = {0.125, 0.125, 0.125};
    ExpectValuesOfPlaces(*source, corner + half, corner + 0.25 * ToVec3(kCoarse) - half,
                         [&](const Vec3& place) { return FieldAt(place, time); });
  }
};

TEST_F(VtkHdfAmrTest, ALinearFieldIsThatOfItsPlace) {
  for (const hsize_t chunk : {0, 1, 50, 4000}) {
    Write(1, chunk);
    ExpectField({.dataset = "v"}, 0);
    ExpectField({.channel = 1, .dataset = "VTKHDF/Level0/CellData/w"}, 0);
  }
  Write(2);
  for (const int time : {0, 1}) {
    ExpectField({.time = TimeRange{time, time}, .dataset = "v"}, time);
    ExpectField({.time = TimeRange{time, time}, .channel = 1, .dataset = "w"}, time);
  }
}

TEST_F(VtkHdfAmrTest, WhatIsWrongIsSaidInOneLine) {
  Write();
  EXPECT_EQ(Opened(Open())->info().channels.size(), 0U) << "the one that is no vector";
  ExpectRefusal(Open({.dataset = "u"}), "has no array 'u'; it has v, w");
  ExpectRefusal(Open({.lattice = 40, .dataset = "v"}), "holds voxels, so it takes no option lattice");
  ExpectRefusal(Open({.time = TimeRange{1, 1}, .dataset = "v"}), "time is 1");
  const std::pair<std::function<void(std::vector<double>&)>, const char*> cases[] = {
      {[](std::vector<double>& corners) { corners[0] = 1e12; }, "box 0 of level 1 is from 1000000000000 to"},
      {[](std::vector<double>& corners) { std::swap(corners[2], corners[3]); }, "box 0 of level 1 is from"},
      {[](std::vector<double>& corners) { corners[6] += 40, corners[7] += 40; }, "/VTKHDF/Level1/CellData/v': box 1: lies beyond level 0"},
      {[](std::vector<double>& corners) { corners[5] -= 4; }, ""},  // fewer cells, of other places: nothing tells
      {[](std::vector<double>& corners) { corners[11] += 4; }, "are needed"},
      {[](std::vector<double>& corners) { corners.resize(6); }, ""},
  };
  for (const auto& [change, why] : cases) {
    Write(1, 50, change);
    if (*why == '\0') {
      EXPECT_TRUE(Open({.dataset = "v"}).ok());
    } else {
      ExpectRefusal(Open({.dataset = "v"}), why);
    }
  }
}

}  // namespace
}  // namespace slabstream
