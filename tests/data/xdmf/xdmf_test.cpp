// XDMF files whose samples tell where they belong, opened as sources.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/files/file_stamp.h"
#include "data/catalogue/catalogue.h"
#include "data/mosaic/mosaic_source.h"
#include "data/open/open_source.h"
#include "data/volume_io/converted_samples.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/xdmf/xdmf_elements.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

constexpr Index3 kPoints = {7, 6, 5};

double Value(int x, int y, int z, int field = 0) { return x + 10 * y + 100 * z + 1000 * field; }

// Values of a box of points, x fastest; `fields` of them for each, together.
std::vector<double> ValuesOf(const Box& box, int field = 0, int fields = 1) {
  std::vector<double> values;
  for (int z = box.begin.z; z < box.end.z; ++z) {
    for (int y = box.begin.y; y < box.end.y; ++y) {
      for (int x = box.begin.x; x < box.end.x; ++x) {
        for (int i = 0; i < fields; ++i) values.push_back(Value(x, y, z, field + i));
      }
    }
  }
  return values;
}
std::vector<double> ValuesOf(const Index3& size, int field = 0, int fields = 1) { return ValuesOf({{0, 0, 0}, size}, field, fields); }

std::string ZyxOf(const Index3& size) { return fmt::format("{} {} {}", size.z, size.y, size.x); }
std::vector<hsize_t> SizesOf(const Index3& size) { return {hsize_t(size.z), hsize_t(size.y), hsize_t(size.x)}; }

// Spacing 0.5, 1.5, 2 along x, y, z.
std::string EvenMesh(const Index3& points, const Vec3& origin = {1, 0, -3}, const std::string& spacing = "2 1.5 0.5") {
  return fmt::format("<Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"{}\"/>", ZyxOf(points)) +
         Element("Geometry", "GeometryType=\"ORIGIN_DXDYDZ\"",
                 Item("3", fmt::format("{} {} {}", origin.z, origin.y, origin.x)) + Item("3", spacing));
}
class XdmfTest : public testing::Test {
 protected:
  // The file, with this in its domain.
  std::string Write(const std::string& inside, const std::string& name = "a.xmf") {
    const std::string text = "<?xml version=\"1.0\" ?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" []>\n<Xdmf Version=\"2.0\"><Domain>\n" + inside +
                             "</Domain></Xdmf>\n";
    return WriteText(text, name);
  }
  std::string WriteText(const std::string& text, const std::string& name = "a.xmf") {
    WriteFile(directory_ / name, text);
    return directory_ / name;
  }
  void WriteFloats(Hdf5Writer& file, const std::string& path, std::vector<hsize_t> size, const std::vector<double>& values,
                   std::vector<hsize_t> chunk = {}) {
    const std::vector<float> samples(values.begin(), values.end());
    file.Write(path, {.size = std::move(size), .chunk = std::move(chunk), .type = SampleType::kFloat32}, samples.data());
  }
  // All points, at this path of the file.
  void WritePoints(const std::string& name, const std::string& path = "/p", int field = 0) {
    Hdf5Writer file(directory_ / name);
    WriteFloats(file, path, SizesOf(kPoints), ValuesOf(kPoints, field));
  }
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options = {}) {
    return OpenSource(path, options, context_);
  }
  // As they are stored.
  std::vector<double> Read(VolumeSource& source, const Box& box) {
    const SampleType type = source.info().exact.type;
    AlignedVector<std::byte> bytes(std::size_t(box.voxel_count()) * BytesPerSample(type));
    const Status status = source.ReadNow(0, box, BoxRoom::Dense(box, bytes.data(), true));
    EXPECT_TRUE(status.ok()) << status.message();
    const AlignedVector<double> values = Converted<double>(type, bytes);
    return {values.begin(), values.end()};
  }
  std::vector<double> Read(VolumeSource& source) { return Read(source, source.info().finest().geometry.bounds()); }
  void ExpectRefused(const std::string& inside, const std::string& why, const ReadOptions& options = {}) {
    ExpectRefusal(Open(Write(inside), options), why);
  }

  TemporaryDirectory directory_;
  SourceContext context_ = TestReadContext();
};

TEST_F(XdmfTest, PointsAndCellsLieWhereTheGridSays) {
  const Index3 cells = kPoints - Uniform(1);
  {
    Hdf5Writer file(directory_ / "a.h5");
    WriteFloats(file, "/p", SizesOf(kPoints), ValuesOf(kPoints));
    std::vector<std::int16_t> samples;
    for (const double value : ValuesOf(cells)) samples.push_back(std::int16_t(value - 300));
    file.Write("/group/c", {.size = SizesOf(cells), .chunk = {2, 3, 4}, .type = SampleType::kInt16, .big_endian = true}, samples.data());
  }
  const std::string path = Write(Grid(EvenMesh(kPoints) + Attribute("p", HdfItem(ZyxOf(kPoints), "\n  a.h5:/p\n")) +
                                      Attribute("c", HdfItem(ZyxOf(cells), "a.h5:/group/c"), "Center=\"Cell\"")));
  const auto points = Opened(Open(path));
  const SourceInfo& info = points->info();
  EXPECT_EQ(info.finest().geometry.size, kPoints);
  EXPECT_EQ(info.finest().geometry.spacing, (Vec3{0.5, 1.5, 2}));
  EXPECT_EQ(info.finest().geometry.orientation.origin, (Vec3{1, 0, -3}));
  EXPECT_EQ(info.finest().geometry.orientation.world, World::kScene);
  EXPECT_EQ(info.file_type, "float32");
  EXPECT_TRUE(info.in_parts());
  EXPECT_THAT(info.files, ElementsAre(path, directory_ / "a.h5"));
  EXPECT_THAT(info.notes, ElementsAre("array p of points is shown, of p, c"));
  EXPECT_EQ(Read(*points), ValuesOf(kPoints));
  const Box box = {{2, 1, 3}, {6, 5, 5}};
  EXPECT_EQ(Read(*points, box), ValuesOf(box));

  const auto of_cells = Opened(Open(path, {.array = "c"}));
  EXPECT_EQ(of_cells->info().finest().geometry.size, cells);
  EXPECT_EQ(of_cells->info().finest().geometry.orientation.origin, (Vec3{1.25, 0.75, -2}));
  std::vector<double> expected = ValuesOf(cells);
  for (double& value : expected) value -= 300;
  EXPECT_EQ(Read(*of_cells), expected);
}

TEST_F(XdmfTest, ComponentsAreChannels) {
  {
    Hdf5Writer file(directory_ / "a.h5");
    WriteFloats(file, "/v", {5, 6, 7, 3}, ValuesOf(kPoints, 0, 3), {2, 3, 4, 3});
  }
  const std::string path =
      Write(Grid(EvenMesh(kPoints) + Attribute("v", HdfItem(ZyxOf(kPoints) + " 3", "a.h5:/v"), "AttributeType=\"Vector\"")));
  const auto first = Opened(Open(path));
  EXPECT_EQ(first->info().channels.size(), 3U);
  EXPECT_EQ(Read(*first), ValuesOf(kPoints, 0));
  EXPECT_EQ(Read(*Opened(Open(path, {.channel = 2}))), ValuesOf(kPoints, 2));
  const auto beside = first->At(0, 1);
  ASSERT_NE(beside, nullptr);
  EXPECT_EQ(Read(*beside), ValuesOf(kPoints, 1));
  ExpectRefusal(Open(path, {.channel = 3}), "has 3 channels, so channel must be 0 to 2");
  ExpectRefusal(Open(path, {.channel = kLuminance}), "has 3 channels, so channel must be 0 to 2");
}

TEST_F(XdmfTest, EvenCoordinatesMakeAGrid) {
  {
    Hdf5Writer file(directory_ / "a.h5");
    WriteFloats(file, "/p", SizesOf(kPoints), ValuesOf(kPoints));
    file.Doubles("/x", {9}, {-1, 1, 1.5, 2, 2.5, 3, 3.5, 4, 9});  // seven of which are even
    file.Doubles("/uneven", {5}, {0, 1, 2, 3, 5});
  }
  // Along y they decrease.
  WriteFile(directory_ / "y.raw", "head" + EncodeSamples(SampleType::kFloat32, {9, 7.5, 6, 4.5, 3, 1.5}, true));
  const auto mesh = [](const std::string& z) {
    return fmt::format("<Topology TopologyType=\"3DRectMesh\" Dimensions=\"{}\"/>", ZyxOf(kPoints)) +
           Element("Geometry", "GeometryType=\"VXVYVZ\"",
                   Slab("1 1 7", HdfItem("9", "a.h5:/x")) +
                       Item("6", "y.raw", "Format=\"Binary\" Endian=\"Big\" Seek=\"4\" NumberType=\"Float\" Precision=\"4\"") + z);
  };
  const std::string attribute = Attribute("p", HdfItem(ZyxOf(kPoints), "a.h5:/p"));
  const auto source = Opened(Open(Write(Grid(mesh(Item("5", "-3 -1\n 1 3 5")) + attribute))));
  const VolumeGeometry& geometry = source->info().finest().geometry;
  EXPECT_EQ(geometry.size, kPoints);
  EXPECT_EQ(geometry.spacing, (Vec3{0.5, 1.5, 2}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{1, 1.5, -3}));
  EXPECT_THAT(source->info().files, ElementsAre(directory_ / "a.xmf", directory_ / "a.h5", directory_ / "y.raw"));
  std::vector<double> expected;
  for (int z = 0; z < 5; ++z) {
    for (int y = 6; y-- > 0;) {
      for (int x = 0; x < 7; ++x) expected.push_back(Value(x, y, z));
    }
  }
  EXPECT_EQ(Read(*source), expected);
  const std::string uneven = Grid(mesh(HdfItem("5", "a.h5:/uneven")) + attribute);
  const auto rectilinear = Opened(Open(Write(uneven)));
  EXPECT_EQ(Read(*rectilinear), expected);
  const VolumeGeometry& grid = rectilinear->info().finest().geometry;
  EXPECT_DOUBLE_EQ(grid.ToWorld(grid.stretch.ToData(Vec3{0, 0, 3})).z, 3);
  EXPECT_DOUBLE_EQ(grid.ToWorld(grid.stretch.ToData(Vec3{0, 0, 4})).z, 5);
  ExpectValuesOfPlaces(*Opened(Open(Write(uneven), {.resample = 0})), {1, 1.5, 0}, {4, 9, 5}, [](const Vec3& at) {
    return (at.x - 1) / 0.5 + 10 * (9 - at.y) / 1.5 + 100 * (at.z < 3 ? at.z : 3 + (at.z - 3) / 2);
  });
  ExpectRefused(Collection("Spatial", uneven + uneven), "is one of several pieces, and its coordinates are not even along z",
                {.resample = 0});
  ExpectRefused(Grid(mesh(Item("5", "0 1 3 3 4")) + attribute),
                "its coordinates along z: number 3 is 3, must be finite and above number 2, which is 3", {.resample = 0});
  ExpectRefused(Grid(mesh(Item("4", "1 2 3 4")) + attribute), "has 7, 6, 4 coordinates along x, y and z, but Dimensions is '5 6 7'");
  // As the library of XDMF 3 writes it.
  std::string turned = mesh(Item("5", "-3 -1 1 3 5"));
  turned.replace(turned.find("5 6 7"), 5, "7 6 5");
  EXPECT_EQ(Read(*Opened(Open(Write(Grid(turned + attribute))))), expected);
}

TEST_F(XdmfTest, BinaryFilesHaveTheirOrderTypeAndPlace) {
  struct Case {
    const char* attributes;
    SampleType type;
    bool big;
  };
  const Case cases[] = {
      {"NumberType=\"Float\" Precision=\"8\" Endian=\"Big\"", SampleType::kFloat64, true},
      {"NumberType=\"Float\" Endian=\"Little\"", SampleType::kFloat32, false},
      {"NumberType=\"Int\" Endian=\"big\"", SampleType::kInt32, true},
      {"NumberType=\"UInt\" Precision=\"2\" Endian=\"Native\"", SampleType::kUint16, false},
      {"NumberType=\"Short\" Endian=\"Big\"", SampleType::kInt16, true},
      {"DataType=\"Int\" Precision=\"8\"", SampleType::kInt64, false},
  };
  for (const Case& each : cases) {
    SCOPED_TRACE(each.attributes);
    WriteFile(directory_ / "b.raw", "12345" + EncodeSamples(each.type, ValuesOf(kPoints), each.big));
    const std::string item = Item(ZyxOf(kPoints), "b.raw", fmt::format("Format=\"Binary\" Seek=\"5\" {}", each.attributes));
    const auto source = Opened(Open(Write(Grid(EvenMesh(kPoints) + Attribute("p", item)))));
    EXPECT_EQ(source->info().exact.type, each.type);
    EXPECT_EQ(Read(*source), ValuesOf(kPoints));
  }
  const std::string chars = "Format=\"Binary\" Seek=\"5\" NumberType=\"Char\"";
  WriteFile(directory_ / "b.raw", std::string("12345") + std::string(210, '\xff'));
  EXPECT_EQ(Read(*Opened(Open(Write(Grid(EvenMesh(kPoints) + Attribute("p", Item(ZyxOf(kPoints), "b.raw", chars)))))))[7], -1);
  const auto refused = [&](const std::string& file, const std::string& attributes, const std::string& why) {
    ExpectRefused(Grid(EvenMesh(kPoints) + Attribute("p", Item(ZyxOf(kPoints), file, "Format=\"Binary\" " + attributes))), why);
  };
  refused("b.raw", "NumberType=\"UChar\" Seek=\"6\"", "b.raw: truncated");
  refused("b.raw", "NumberType=\"UChar\" Seek=\"-1\"", "Seek is '-1', must be a number of bytes");
  refused("b.raw", "NumberType=\"UChar\" Endian=\"Middle\"", "Endian is 'middle', must be Big, Little or Native");
  refused("b.raw", "NumberType=\"UChar\" Compression=\"Zlib\"", "Compression is 'zlib', which is not supported; supported: Raw");
  refused("b.raw", "NumberType=\"String\"", "type 'string' is not supported");
  refused("none.raw", "NumberType=\"UChar\"", "none.raw: no such file");
  // Whoever opens a pipe waits for its writer.
  ASSERT_EQ(::mkfifo((directory_ / "pipe").c_str(), 0600), 0);
  refused("pipe", "NumberType=\"UChar\"", "pipe: no such file");
  ExpectRefused(Grid(EvenMesh(kPoints) + Attribute("p", HdfItem(ZyxOf(kPoints), "pipe:/p"))), "pipe: no such file");
}

TEST_F(XdmfTest, SlabsAreBoxesOfArrays) {
  {
    Hdf5Writer file(directory_ / "a.h5");
    std::vector<double> all = ValuesOf(kPoints, 4);
    const std::vector<double> next = ValuesOf(kPoints, 5);
    all.insert(all.end(), next.begin(), next.end());
    WriteFloats(file, "/times", {2, 5, 6, 7}, all, {1, 2, 3, 4});
  }
  const std::string array = HdfItem("2 5 6 7", "a.h5:/times");
  const auto open = [&](const std::string& item, const std::string& spacing = "2 1.5 0.5") {
    return Open(Write(Grid(EvenMesh({4, 3, 2}, {1, 0, -3}, spacing) + Attribute("p", item))));
  };
  const Box box = {{3, 1, 2}, {7, 4, 4}};
  const auto source = Opened(open(Slab("1 2 1 3  1 1 1 1  1 2 3 4", array)));
  EXPECT_EQ(source->info().finest().geometry.orientation.origin, (Vec3{1, 0, -3}));
  EXPECT_EQ(Read(*source), ValuesOf(box, 5));
  // A slab of a slab. A stride along an axis of one element does not matter.
  EXPECT_EQ(Read(*Opened(open(Slab("0 1 1 0  9 1 1 1  1 2 3 4", Slab("0 1 0 3  1 1 1 1  2 4 6 4", array))))), ValuesOf(box, 4));

  // Its axes may run backwards.
  const auto mirrored = Opened(open(Slab("1 2 1 3  1 1 1 1  1 2 3 4", array), "2 -1.5 -0.5"));
  EXPECT_EQ(mirrored->info().finest().geometry.orientation.origin, (Vec3{-0.5, -3, -3}));
  std::vector<double> expected;
  for (int z = 2; z < 4; ++z) {
    for (int y = 4; y-- > 1;) {
      for (int x = 7; x-- > 3;) expected.push_back(Value(x, y, z, 5));
    }
  }
  EXPECT_EQ(Read(*mirrored), expected);

  ExpectRefusal(open(Slab("1 2 1 3  1 2 1 1  1 1 3 4", array)), "is of 1 x 1 x 3 x 4, but its grid has 2 x 3 x 4 points");
  ExpectRefusal(open(Slab("1 0 1 3  1 2 1 1  1 2 3 4", array)), "has a stride of 2, which is not supported; supported: 1");
  ExpectRefusal(open(Slab("1 4 1 3  1 1 1 1  1 2 3 4", array)), "reaches out of the 5 elements along axis 1");
  ExpectRefusal(open(Slab("1 18446744073709551615 1 3  1 1 1 1  1 2 3 4", array)), "reaches out of the 5 elements along axis 1");
  ExpectRefusal(open(Slab("1 2 1  1 1 1  2 3 4", array)), "must be start, stride and count of 4 axes");
  ExpectRefusal(open(Slab("2 1 3 1  1 1 1 1  2 3 4 1", HdfItem("5 6 7 2", "a.h5:/times"))), "Dimensions say 5 x 6 x 7 x 2, but");
}

TEST_F(XdmfTest, ACollectionHasTimes) {
  WritePoints("first.h5");
  WritePoints("second.h5", "/later/p", 1);
  const auto grid = [](const std::string& time, const std::string& place) {
    return Grid(time + EvenMesh(kPoints) + Attribute("p", HdfItem(ZyxOf(kPoints), place)));
  };
  const auto times = [&](const std::string& of_all, const std::string& first, const std::string& second) {
    return Collection("Temporal", of_all + grid(first, "first.h5:/p") + grid(second, "second.h5:/later/p"));
  };
  const std::string path = Write(times("", "<Time Value=\"3\"/>", "<Time Value=\" 3.25 \"/>"));
  const auto second = Opened(Open(path, {.time = TimeRange{1, 1}}));
  EXPECT_EQ(Read(*second), ValuesOf(kPoints, 1));
  EXPECT_EQ(second->info().times, (TimeAxis{.count = 2, .step = 0.25}));
  EXPECT_EQ(second->info().time, 1);
  EXPECT_THAT(second->info().files, ElementsAre(path, directory_ / "second.h5"));
  EXPECT_EQ(second->At(0, 0), nullptr);  // it lies in another file
  EXPECT_EQ(Read(*Opened(Open(path, {.describe = true}))), ValuesOf(kPoints, 0));
  ExpectRefusal(Open(path), "--time");
  ExpectRefusal(Open(path, {.time = TimeRange{2, 2}}), "time is 2, must be in [0, 1]");

  for (const char* of_all : {"<Time TimeType=\"HyperSlab\"><DataItem>3 0.25 2</DataItem></Time>",
                             "<Time TimeType=\"List\"><DataItem>3 3.25</DataItem></Time>"}) {
    EXPECT_EQ(Opened(Open(Write(times(of_all, "", "")), {.describe = true}))->info().times.step, 0.25) << of_all;
  }
  EXPECT_EQ(Opened(Open(Write(times("", "", "<Time Value=\"x\"/>")), {.describe = true}))->info().times, TimeAxis{.count = 2});
  // One that is in another, or that has another in it.
  EXPECT_EQ(Opened(Open(Write(Collection("Spatial", times("", "", ""))), {.describe = true}))->info().times.count, 2);
  ExpectRefused(Collection("Temporal", times("", "", "")), "is a collection of times in another collection, which is not supported");
  for (const char* type : {"Temporal", "Spatial"}) {
    ExpectRefused(Collection(type, ""), "is a collection of no grids");
    ExpectRefused(Collection("Spatial", Collection(type, "") + Collection(type, "")), "is a collection of no grids");
  }
  ExpectRefused(Grid(""), "time is 0:1, must be one volume here", {.time = TimeRange{0, 1}});
}

// As a simulation writes it: samples first, then the file that names them.
TEST_F(XdmfTest, TimesThatComeAreSeen) {
  const auto write = [&](int times) {
    std::string grids;
    for (int time = 0; time < times; ++time) {
      const std::string place = fmt::format("{}.h5:/p", time);
      grids += Grid(fmt::format("<Time Value=\"{}\"/>", time) + EvenMesh(kPoints) + Attribute("p", HdfItem(ZyxOf(kPoints), place)));
    }
    return Write(Collection("Temporal", grids));
  };
  const auto read = [&](const std::string& options = "") { return ReadSource(DataSource(directory_ / ("a.xmf" + options), ""), 1U << 30); };
  for (const int time : {0, 1, 2}) WritePoints(fmt::format("{}.h5", time), "/p", time);
  write(2);
  const Result<ReadableSource> two = read();
  ASSERT_TRUE(two.ok()) << two.status().message();
  EXPECT_EQ(std::get<LoadedSource>(*two).file.times.count, 2);
  const FileStamp& stamp = *std::get<LoadedSource>(*two).stamp;
  EXPECT_EQ(HaveChanged(stamp).value(), false);
  write(3);
  EXPECT_EQ(HaveChanged(stamp).value(), true);
  EXPECT_EQ(std::get<LoadedSource>(*read()).file.times.count, 3);
  EXPECT_EQ(std::get<LoadedSource>(*read("?time=2")).volume->block.samples<float>()[0], 2000);

  // A time whose samples are not there yet leaves the others alone.
  write(4);
  EXPECT_EQ(std::get<LoadedSource>(*read()).file.times.count, 4);
  EXPECT_EQ(std::get<LoadedSource>(*read("?time=2")).volume->block.samples<float>()[0], 2000);
  EXPECT_THAT(read("?time=3").status().message(), HasSubstr("3.h5: no such file"));
  WritePoints("3.h5", "/p", 3);
  EXPECT_EQ(std::get<LoadedSource>(*read("?time=3")).volume->block.samples<float>()[0], 3000);
}

TEST_F(XdmfTest, PiecesInSpaceAreOneVolume) {
  const Box left = {{0, 0, 0}, {4, 6, 5}}, right = {{3, 0, 0}, {7, 6, 5}};  // they meet at the points of x = 3
  const auto cells_of = [](const Box& points) { return Box{points.begin, points.end - Uniform(1)}; };
  const auto piece = [&](const std::string& name, const Box& points, const Vec3& origin, const std::string& spacing = "2 1.5 0.5") {
    Hdf5Writer file(directory_ / (name + ".h5"));
    const Box cells = cells_of(points);
    WriteFloats(file, "/p", SizesOf(points.size()), ValuesOf(points));
    WriteFloats(file, "/c", SizesOf(cells.size()), ValuesOf(cells));
    return Grid(EvenMesh(points.size(), origin, spacing) + Attribute("p", HdfItem(ZyxOf(points.size()), name + ".h5:/p")) +
                    Attribute("c", HdfItem(ZyxOf(cells.size()), name + ".h5:/c"), "Center=\"Cell\""),
                "Name=\"" + name + "\"");
  };
  const std::string first = piece("right", right, {2.5, 0, -3}), second = piece("left", left, {1, 0, -3});
  const std::string path = Write(Collection("Temporal", Collection("Spatial", first + second)));
  const auto points = Opened(Open(path));
  EXPECT_EQ(points->info().finest().geometry.size, kPoints);
  EXPECT_EQ(points->info().finest().geometry.orientation.origin, (Vec3{1, 0, -3}));
  EXPECT_THAT(points->info().files, ElementsAre(path, directory_ / "left.h5", directory_ / "right.h5"));
  EXPECT_EQ(Read(*points), ValuesOf(kPoints));
  const auto cells = Opened(Open(path, {.array = "c"}));
  EXPECT_EQ(cells->info().finest().geometry.orientation.origin, (Vec3{1.25, 0.75, -2}));
  EXPECT_EQ(Read(*cells), ValuesOf(kPoints - Uniform(1)));

  ExpectRefused(Collection("Spatial", second + piece("far", right, {3.5, 0, -3})), "its parts hold 240 of the 270 voxels between them");
  ExpectRefused(Collection("Spatial", second + piece("other", right, {2.5, 0, -3}, "2 1.5 0.4")), "Grid 'other': has another spacing");
  ExpectRefused(Collection("Spatial", second + piece("between", right, {2.3, 0, -3})), "Grid 'between': has its voxels between those");
  ExpectRefused(Collection("Spatial", second + piece("away", right, {1e9, 0, -3})), "Grid 'away': lies too far from the first piece");
  ExpectRefused(Collection("Spatial", second + Grid(EvenMesh(kPoints), "Name=\"bare\"")), "Grid 'bare': has no attribute 'p' of points");
}

TEST_F(XdmfTest, ReferencesLeadToElements) {
  WritePoints("a.h5");
  const std::string shared =
      Item(ZyxOf(kPoints), "a.h5:/p", "Name=\"a/[b]\" Format=\"HDF\"") + Item(ZyxOf(kPoints), "a.h5:/none", "Name=\"none\" Format=\"HDF\"");
  const auto open = [&](const std::string& reference, const std::string& inside) {
    const std::string item = Element("DataItem", fmt::format("Reference=\"{}\"", reference), inside);
    return Open(Write(shared + Grid(EvenMesh(kPoints) + Attribute("p", item))));
  };
  for (const char* path : {"/Xdmf/Domain/DataItem", "/Xdmf/Domain/DataItem[1]", "/Xdmf[1]/Domain/DataItem[@Name='a/[b]']", "//DataItem[1]",
                           "//DataItem[@Name = 'a/[b]'][@Format='HDF']"}) {
    EXPECT_EQ(Read(*Opened(open("XML", path))), ValuesOf(kPoints)) << path;
    EXPECT_EQ(Read(*Opened(open(path, ""))), ValuesOf(kPoints)) << path;
  }
  ExpectRefusal(open("XML", "/Xdmf/Domain/DataItem[2]"), "'/none'");
  ExpectRefusal(open("XML", "/Xdmf/Domain/DataItem[3]"), "leads to no element");
  ExpectRefusal(open("XML", "/Xdmf/Domain"), "leads to an element Domain, must lead to DataItem");
  for (const char* path :
       {"../DataItem", "/Xdmf/Domain/DataItem[last()]", "/Xdmf/Domain/DataItem[0]", "/Xdmf/Domain/DataItem[1", "/", "//", "/Xdmf//", "x"}) {
    ExpectRefusal(open("XML", path), "is not supported; supported: names from the root with");
  }
  ExpectRefusal(open("XML", "/Xdmf/Domain/Grid/Attribute/DataItem"), "more than 16 references one behind the other");
  // A topology and a geometry may stand elsewhere, too.
  const std::string mesh = "<Topology Reference=\"/Xdmf/Domain/Topology\"/><Geometry Reference=\"XML\">/Xdmf/Domain/Geometry</Geometry>";
  EXPECT_EQ(Read(*Opened(Open(Write(EvenMesh(kPoints) + Grid(mesh + Attribute("p", HdfItem(ZyxOf(kPoints), "a.h5:p"))))))),
            ValuesOf(kPoints));
}

TEST_F(XdmfTest, SamplesMayBeText) {
  std::string text;
  for (const double value : ValuesOf(kPoints)) text += fmt::format("{}\n", value + 0.25);
  const auto source = Opened(Open(Write(Grid(EvenMesh(kPoints) + Attribute("p", Item(ZyxOf(kPoints), text))))));
  std::vector<double> expected = ValuesOf(kPoints);
  for (double& value : expected) value += 0.25;
  EXPECT_EQ(Read(*source), expected);
  ExpectRefused(Grid(EvenMesh(kPoints) + Attribute("p", Item(ZyxOf(kPoints), text + "1"))), "its text must be 210 numbers");
  ExpectRefused(Grid(EvenMesh(kPoints) + Attribute("p", Item(ZyxOf(kPoints), text + "x"))), "its text must be 210 numbers");
}

TEST_F(XdmfTest, RefusalsSayWhatIsWrong) {
  WritePoints("a.h5");
  const std::string item = HdfItem(ZyxOf(kPoints), "a.h5:/p"), attribute = Attribute("p", item), good = Grid(EvenMesh(kPoints) + attribute);
  ASSERT_TRUE(Open(Write(good)).ok());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = good;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return changed.replace(at, from.size(), to);
  };
  const std::pair<std::string, const char*> cases[] = {
      {with("3DCoRectMesh", "3DSMesh"), "GeometryType 'origin_dxdydz' is not supported for cells"},
      {with("3DCoRectMesh", "Polyhedron"), "TopologyType 'polyhedron' is not supported; supported: 3DCoRectMesh, 3DRectMesh"},
      {with("ORIGIN_DXDYDZ", "XYZ"), "GeometryType is 'xyz', must be origin_dxdydz for 3dcorectmesh"},
      {with("<Topology", "<Topo"), "Grid 'g': has no Topology"},
      {with("Dimensions=\"5 6 7\"/>", "Dimensions=\"5 6\"/>"), "Dimensions is '5 6', must be 3 whole numbers above 0"},
      {with("Dimensions=\"5 6 7\"/>", "Dimensions=\"5 6 70000\"/>"), "the size along x is 70000, must be a whole number in [1, 65535]"},
      {with("Dimensions=\"5 6 7\"/>", "Dimensions=\"5 6 8\"/>"), "DataItem: is of 5 x 6 x 7, but its grid has 5 x 6 x 8 points"},
      {with("2 1.5 0.5", "2 0 0.5"), "DXDYDZ: the step along y is"},
      {with("2 1.5 0.5", "2 1 nan"), "DXDYDZ: the step along x is"},
      {with("2 1.5 0.5", "2 1"), "its text must be 3 numbers"},
      {with("GridType=\"Uniform\"", "GridType=\"Subset\""), "Grid 'g': GridType 'subset' is not supported"},
      {with("Format=\"HDF\"", "Format=\"HDF\" ItemType=\"Function\""), "ItemType 'function' is not supported; supported: Uniform and"},
      {with("Format=\"HDF\"", "Format=\"TIFF\""), "Format 'tiff' is not supported; supported: XML, HDF and Binary"},
      {with("a.h5:/p", "a.h5"), "is 'a.h5', must be FILE:/DATASET"},
      {with("a.h5:/p", ":/p"), "names no file"},
      {with("a.h5:/p", "b.h5:/p"), "b.h5: no such file"},
      {with("a.h5:/p", "a.xmf:/p"), "a.xmf: not an HDF5 file"},
      {with("a.h5:/p", "a.h5:/q"), "dataset '/q' cannot be opened"},
      {with("Name=\"p\" ", "Name=\"p\" Center=\"Face\""), "has no array of points or cells"},
      {Grid(EvenMesh(kPoints) + Attribute("p", "")), "Attribute 'p': has 0 of DataItem, must have 1"},
      {Grid(EvenMesh(kPoints) + attribute + Attribute("q", item)), "choose one by its name (--array): p, q"},
      {Grid(EvenMesh(kPoints) + Attribute("p", HdfItem("5 6 0", "a.h5:/p"))),
       "Dimensions is '5 6 0', must be 1 to 8 whole numbers above 0"},
      {Grid(EvenMesh(kPoints) + Attribute("p", HdfItem("4294967296 4294967296 4294967296", "a.h5:/p"))), "Dimensions is '4294967296"},
      {good + good, "has 2 grids, must have 1, which may be a collection of others"},
      {"", "has 0 grids"},
      {Grid("<xi:include xmlns:xi=\"http://www.w3.org/2001/XInclude\" href=\"/etc/passwd\"/>"), "includes other files (XInclude)"},
  };
  for (const auto& [inside, why] : cases) ExpectRefused(inside, why);
  ExpectRefused(good, "has no array 'q'; it has p", {.array = "q"});
  ExpectRefusal(Open(WriteText("<VTKFile/>")), "its first element is 'VTKFile', must be Xdmf");
  ExpectRefusal(Open(WriteText("<Xdmf><Domain></Xdmf>")), "its XML cannot be read in line 1");
  ExpectRefusal(Open(WriteText("<!DOCTYPE Xdmf [<!ENTITY a \"b\">]><Xdmf/>")), "document type definition declares entities");
  ExpectRefusal(Open(WriteText("<!DOCTYPE Xdmf [<!ATTLIST Xdmf a CDATA \"b\">]><Xdmf/>")), "document type definition declares entities");
}

TEST_F(XdmfTest, HostileFilesEndSoon) {
  WritePoints("a.h5");
  std::string nested = "<Xdmf>";
  for (int i = 0; i < 100000; ++i) nested += "<Grid>";
  ExpectRefusal(Open(WriteText(nested)), "elements in more than 64 others");
  std::string many = "<Xdmf>";
  for (int i = 0; i < 600000; ++i) many += "<a b=\"\"/>";
  ExpectRefusal(Open(WriteText(many + "</Xdmf>")), "more than 1048576 elements and attributes");
  // Collections that hold themselves.
  std::string cycle;
  for (int i = 0; i < 300; ++i) cycle += "<Grid Reference=\"/Xdmf/Domain/Grid\"/>";
  ExpectRefused(Collection("Spatial", cycle), "others");
  ExpectRefused(Grid("", "Reference=\"/Xdmf/Domain/Grid\""), "more than 16 references");
  // Boxes of themselves.
  const std::string self = "<DataItem Reference=\"//Attribute/DataItem\"/>";
  ExpectRefused(Grid(EvenMesh(kPoints) + Attribute("p", Slab("0 1 1", self))), "lies in more than 16 others");
  // Many references over many elements.
  const std::string attribute = Attribute("p", HdfItem(ZyxOf(kPoints), "a.h5:/p"));
  std::string mesh = EvenMesh(kPoints), others, pieces, same;
  mesh.insert(mesh.find("<Topology") + 9, " Name=\"last\"");
  const std::string piece = Grid("<Topology Reference=\"//Topology[@Name='last']\"/><Geometry Reference=\"//Geometry\"/>" + attribute);
  for (int i = 0; i < 100000; ++i) others += "<a/>";
  for (int i = 0; i < 2000; ++i) pieces += piece;
  ExpectRefused(others + mesh + Collection("Spatial", pieces), "its references and numbers take more than 67108864 steps to read");
  // Many pieces of few words.
  for (std::size_t i = 0; i < kMaxMosaicParts; ++i) same += "<Grid Reference=\"//Grid[@Name='one']\"/>";
  ExpectRefused(Collection("Spatial", Grid(EvenMesh(kPoints) + attribute, "Name=\"one\"") + same), "has more than 262144 grids");
}

}  // namespace
}  // namespace slabstream
