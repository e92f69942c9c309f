// Volumes of Zarr as sources: which voxels are shown, and where they are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "data/open/open_source.h"
#include "data/volume_io/formats.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/data/stores/zip_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Result<std::shared_ptr<VolumeSource>> OpenText(const std::string& text) {
  const Result<SourceText> source = ParseSourceText(text);
  if (!source.ok()) return source.status();
  return OpenSource(source->path, source->options, TestContext());
}

// Data values of a level, x fastest.
std::vector<double> ValuesOf(VolumeSource& source, int level = 0) {
  const VolumeDescription& description = source.info().levels.at(std::size_t(level)).description;
  std::vector<std::byte> bytes(std::size_t(description.voxel_bytes()));
  const Status status = source.ReadNow(level, description.geometry.bounds(), bytes);
  EXPECT_TRUE(status.ok()) << status.message();
  return VisitScalarType(description.type, [&](const auto* null) {
    std::vector<double> values;
    for (std::size_t i = 0; i < bytes.size(); i += sizeof *null) {
      std::remove_cvref_t<decltype(*null)> sample;
      std::memcpy(&sample, bytes.data() + i, sizeof sample);
      values.push_back(description.mapping.FromStored(double(sample)));
    }
    return values;
  });
}

constexpr std::uint64_t kX = 6, kY = 5, kZ = 4, kTimes = 2, kChannels = 3;

// Of a voxel.
double Value(std::uint64_t t, std::uint64_t c, std::uint64_t z, std::uint64_t y, std::uint64_t x) {
  return double(x + 6 * y + 30 * z + 120 * c + 360 * t);
}

std::vector<double> Volume(std::uint64_t t, std::uint64_t c) {
  std::vector<double> values;
  ForEachIndex({kZ, kY, kX}, [&](const Counts& at) { values.push_back(Value(t, c, at[0], at[1], at[2])); });
  return values;
}

std::uint64_t SideOf(char axis) { return axis == 'x' ? kX : axis == 'y' ? kY : axis == 'z' ? kZ : axis == 't' ? kTimes : kChannels; }

// `axes`: such as "tczyx".
ElementAt ElementsOf(const std::string& axes) {
  return [axes](std::span<const std::uint64_t> at) {
    const auto along = [&](char axis) { return axes.find(axis) == std::string::npos ? 0 : at[axes.find(axis)]; };
    return Value(along('t'), along('c'), along('z'), along('y'), along('x'));
  };
}

ZarrSpec SpecOf(const std::string& axes, int version) {
  ZarrSpec spec{.version = version, .separator = '/', .codec = "zstd"};
  for (const char axis : axes) {
    spec.shape.push_back(SideOf(axis));
    spec.chunk.push_back(axis == 't' || axis == 'c' ? 1 : 3);
    if (version == 3) spec.shard.push_back(spec.chunk.back() * 2);
  }
  return spec;
}

// The attributes of an image whose levels are called 0, 1, ...; a scale for each level and axis.
Json ImageAttributes(const std::string& axes, int version, const std::vector<std::vector<double>>& scales, bool types = true) {
  Json image = {{"axes", Json::array()}, {"datasets", Json::array()}};
  if (version == 2) image["version"] = "0.4";
  for (const char axis : axes) {
    Json described = {{"name", std::string(1, axis)}};
    if (types) described["type"] = axis == 't' ? "time" : axis == 'c' ? "channel" : "space";
    if (axis >= 'x') described["unit"] = "micrometer";
    image["axes"].push_back(described);
  }
  for (std::size_t level = 0; level < scales.size(); ++level) {
    const Json scale = {{"type", "scale"}, {"scale", scales[level]}};
    image["datasets"].push_back({{"path", std::to_string(level)}, {"coordinateTransformations", Json::array({scale})}});
  }
  const Json attributes = {{"multiscales", Json::array({image})}};
  if (version == 2) return attributes;
  Json ome = attributes;
  ome["version"] = "0.5";
  return {{"ome", ome}};
}

Json& OmePart(Json& attributes) { return attributes.contains("ome") ? attributes["ome"] : attributes; }

void WriteImage(const std::string& path, const std::string& axes, int version, bool types = true) {
  WriteZarrGroup(path, version, ImageAttributes(axes, version, {std::vector<double>(axes.size(), 1)}, types));
  WriteZarrArray(path + "/0", SpecOf(axes, version), ElementsOf(axes));
}

TEST(ZarrSourceTest, ImagesShowTheTimeAndChannelThatAreAskedForInAnyOrderOfAxes) {
  const TemporaryDirectory folder;
  for (const int version : {2, 3}) {
    for (const std::string axes : {"tczyx", "ctzyx", "zyx", "czyx", "tzyx", "xyzct", "zcytx"}) {
      SCOPED_TRACE(axes);
      const std::string path = folder / (axes + std::to_string(version) + ".ome.zarr");
      WriteImage(path, axes, version, axes != "zyx");
      const bool times = axes.find('t') != std::string::npos, channels = axes.find('c') != std::string::npos;
      const auto source = OpenText(path + "?time=" + (times ? "1" : "0") + (channels ? ",channel=2" : ""));
      ASSERT_TRUE(source.ok()) << source.status().message();
      EXPECT_EQ(ValuesOf(**source), Volume(times ? 1 : 0, channels ? 2 : 0));
      const SourceInfo& info = (*source)->info();
      EXPECT_EQ(info.format, version == 2 ? "OME-Zarr 0.4" : "OME-Zarr 0.5");
      EXPECT_EQ(info.file_type, "uint16");
      EXPECT_EQ(info.times.count, times ? 2 : 1);
      EXPECT_EQ(info.channels.size(), channels ? 3U : 0U);
      EXPECT_FALSE(info.labels);
      EXPECT_EQ(info.levels[0].description.geometry.orientation.unit, LengthUnit::kMicrometre);
    }
  }
  // The first channel is shown unless another is asked for; a time must be.
  EXPECT_EQ(ValuesOf(**OpenText(folder / "czyx2.ome.zarr")), Volume(0, 0));
  EXPECT_EQ((*OpenText(folder / "czyx2.ome.zarr?channel=2"))->info().channel, 2);
  EXPECT_THAT(OpenText(folder / "tzyx3.ome.zarr").status().message(), HasSubstr("holds 2 volumes, of which --time takes one: 0 to 1"));
  EXPECT_THAT(OpenText(folder / "tzyx3.ome.zarr?time=2").status().message(), HasSubstr("time is 2, must be in [0, 1]"));
  EXPECT_THAT(OpenText(folder / "czyx3.ome.zarr?channel=3").status().message(), HasSubstr("has 3 channels, so channel must be 0 to 2"));
  EXPECT_THAT(OpenText(folder / "zyx3.ome.zarr?channel=luminance").status().message(), HasSubstr("has 1 channel, so channel must be 0"));
  EXPECT_THAT(OpenText(folder / "zyx3.ome.zarr?spacing=1,1,1").status().message(), HasSubstr("states its spacing"));
  EXPECT_THAT(OpenText(folder / "zyx3.ome.zarr?lattice=64").status().message(), HasSubstr("lattice is no option of Zarr"));
}

// By what was read when it was opened.
TEST(ZarrSourceTest, OtherTimesAndChannelsAreReadWithoutAnotherRequestButThoseOfTheirChunks) {
  const TemporaryDirectory folder;
  const ScriptedServer server(ServesFolder(folder.path()));
  for (const int version : {2, 3}) {
    for (const std::string axes : {"tczyx", "ctzyx", "zcytx"}) {
      SCOPED_TRACE(axes);
      const std::string name = axes + std::to_string(version) + ".ome.zarr";
      WriteImage(folder / name, axes, version);
      const auto first = OpenText(server.url() + "/" + name + "?time=0,channel=1");
      ASSERT_TRUE(first.ok()) << first.status().message();
      for (const auto& [time, channel] : {std::pair(1, 1), {1, 2}, {0, 0}}) {
        const std::shared_ptr<VolumeSource> other = (*first)->At(time, channel);
        ASSERT_NE(other, nullptr);
        EXPECT_EQ(other->info().time, time);
        EXPECT_EQ(other->info().channel, channel);
        EXPECT_EQ(other->info().version, (*first)->info().version);
        EXPECT_EQ(ValuesOf(*other), Volume(std::uint64_t(time), std::uint64_t(channel)));
      }
      // The array is described by one of these, and the other is asked for beside it.
      for (const char* const object : {"/0/.zarray", "/0/zarr.json"}) {
        EXPECT_LE(std::ranges::count(server.requests(), "/" + name + object, &ServerRequest::target), 1) << object;
      }
      EXPECT_EQ((*first)->At(2, 0), nullptr);
      EXPECT_EQ((*first)->At(0, 3), nullptr);
      EXPECT_EQ((*first)->At(-1, 0), nullptr);
    }
  }
}

TEST(ZarrSourceTest, OtherTimesOfAFolderAreThoseOfTheFolder) {
  const TemporaryDirectory folder;
  const std::string path = folder / "a.ome.zarr";
  WriteImage(path, "tczyx", 2);
  for (const std::string options : {"?time=0", "?time=0,ids=yes"}) {
    const auto first = OpenText(path + options);
    ASSERT_TRUE(first.ok()) << first.status().message();
    const std::shared_ptr<VolumeSource> other = (*first)->At(1, 2), opened = *OpenText(path + options + ",channel=2");
    ASSERT_NE(other, nullptr);
    EXPECT_EQ(ValuesOf(*other), Volume(1, 2));
    EXPECT_EQ(other->info().labels, (*first)->info().labels);
    EXPECT_EQ(ValuesOf(*other->At(0, 2)), ValuesOf(*opened));
  }
  const std::shared_ptr<VolumeSource> before = *OpenText(path + "?time=0");
  std::ofstream(path + "/.zattrs", std::ios::app) << "\n";
  std::vector<std::byte> samples(std::size_t(before->info().finest().voxel_bytes()));
  const Status read = before->At(1, 0)->ReadNow(0, before->info().finest().geometry.bounds(), samples);
  EXPECT_EQ(read.code(), StatusCode::kUnavailable) << "they have changed since it was opened";
}

TEST(ZarrSourceTest, ImagesSayHowChannelsAreShownAndWhenTimesAre) {
  const TemporaryDirectory folder;
  using Color = std::array<float, 3>;
  const auto info = [&](const std::string& axes, const Json& channels, const Json& unit, double step, const Json& own = nullptr) {
    const std::string path = folder / (axes + ".ome.zarr");
    Json attributes = ImageAttributes(axes, 2, {std::vector<double>(axes.size(), 1)});
    Json& image = OmePart(attributes)["multiscales"][0];
    if (const std::size_t time = axes.find('t'); time != std::string::npos) {
      image["axes"][time]["unit"] = unit;
      image["datasets"][0]["coordinateTransformations"][0]["scale"][time] = step;
    }
    OmePart(attributes)["omero"] = {{"channels", channels}};
    attributes["slabstream"] = own;
    WriteZarrGroup(path, 2, attributes);
    WriteZarrArray(path + "/0", SpecOf(axes, 2), ElementsOf(axes));
    return (*OpenText(path + "?time=0"))->info();
  };
  const Json right = Json::Parse(R"([{"label": "DAPI", "color": "0000FF", "window": {"min": 0, "max": 65535, "start": 5, "end": 200},
      "active": true}, {"color": "#ff0000", "active": false}])")
                         .value();
  const SourceInfo read = info("tczyx", right, "millisecond", 2.5);
  EXPECT_THAT(read.channels, ElementsAre(FieldInfo{.name = "DAPI", .color = Color{0, 0, 1}, .window = ValueRange{5, 200}},
                                         FieldInfo{.color = Color{1, 0, 0}, .shown = false}, FieldInfo{}));
  EXPECT_EQ(read.times, (TimeAxis{2, 2.5, "ms"}));
  EXPECT_EQ(info("tczyx", right, nullptr, 1).times, (TimeAxis{2}));
  EXPECT_EQ(info("tczyx", right, 7, -3).times, (TimeAxis{2}));
  EXPECT_EQ(info("tczyx", right, "hour", 1).times, (TimeAxis{2, 1, "h"}));
  EXPECT_THAT(info("zyx", right, nullptr, 1).channels, ElementsAre(read.channels[0])) << "of the only channel";
  // Windows are of samples.
  EXPECT_EQ(info("zyx", right, nullptr, 1, {{"values", {{"scale", 2}, {"offset", -10}}}}).channels[0].window, (ValueRange{0, 390}));

  for (const char* damaged : {
           R"([{"label": 5, "color": 255, "window": {"start": "0", "end": 9}, "active": "no"}])",
           R"([{"label": null, "color": "mauve", "window": {"start": 9, "end": 3}, "active": 0}])",
           R"([{"color": "0000FFG", "window": [1, 2], "active": null}])",
           R"([{"color": "000000", "window": {"start": "NaN", "end": "Infinity"}}])",
           R"([{"color": ["00FF00"], "window": {"start": 1e300, "end": 1e301}}])",
           R"([5, null, [], "DAPI"])",
           R"({"0": {"label": "DAPI"}})",
           R"("channels")",
       }) {
    EXPECT_THAT(info("tczyx", Json::Parse(damaged).value(), "s", 1).channels, ElementsAre(FieldInfo{}, FieldInfo{}, FieldInfo{}))
        << damaged;
  }
  Json many = Json::array();
  for (int i = 0; i < 5000; ++i) many.push_back({{"label", "DAPI"}});
  EXPECT_EQ(info("tczyx", many, "s", 1).channels.size(), 3U);
}

TEST(ZarrSourceTest, LevelsLieWhereTheyWereMadeOf) {
  const TemporaryDirectory folder;
  const std::vector<std::vector<double>> scales = {{2, 0.5, 0.25}, {2, 1, 0.5}, {4, 2, 1}};
  for (const int version : {2, 3}) {
    for (const bool translated : {false, true}) {
      const std::string path = folder / (std::to_string(version) + (translated ? "t" : "") + ".zarr");
      Json attributes = ImageAttributes("zyx", version, scales);
      Json& image = OmePart(attributes)["multiscales"][0];
      if (translated) {
        for (std::size_t level = 0; level < scales.size(); ++level) {
          const std::vector<double> by = {100 + double(level), 10, 5};
          image["datasets"][level]["coordinateTransformations"].push_back({{"type", "translation"}, {"translation", by}});
        }
      }
      image["coordinateTransformations"] = {{{"type", "scale"}, {"scale", {10, 10, 10}}}};
      OmePart(attributes)["omero"] = {{"channels", {{{"label", "DAPI"}, {"window", {{"start", 3}, {"end", 99}}}}}}};
      WriteZarrGroup(path, version, attributes);
      for (int level = 0; level < 3; ++level) {
        WriteZarrArray(path + "/" + std::to_string(level),
                       {.version = version, .shape = {8, 8U >> level, 8U >> level}, .chunk = {4, 4, 4}, .separator = '/'},
                       ElementsOf("zyx"));
      }
      const auto source = OpenText(path);
      ASSERT_TRUE(source.ok()) << source.status().message();
      const SourceInfo& info = (*source)->info();
      ASSERT_EQ(info.levels.size(), 3U);
      EXPECT_THAT(info.channels, ElementsAre(FieldInfo{.name = "DAPI", .window = ValueRange{3, 99}}));
      for (std::size_t level = 0; level < 3; ++level) {
        const VolumeGeometry& geometry = info.levels[level].description.geometry;
        EXPECT_EQ(geometry.size, (Index3{8 >> level, 8 >> level, 8}));
        const Vec3 spacing = 10.0 * Vec3{scales[level][2], scales[level][1], scales[level][0]};
        EXPECT_EQ(geometry.spacing, spacing);
        if (translated) {
          EXPECT_EQ(geometry.orientation.origin, 10.0 * (Vec3{5, 10, 100 + double(level)})) << level;
        } else {  // first corners meet
          EXPECT_EQ(geometry.orientation.origin, 0.5 * (spacing - Vec3{2.5, 5, 20})) << level;
        }
      }
      EXPECT_THAT(info.files, testing::Contains(path + (version == 2 ? "/2/.zarray" : "/2/zarr.json")));
    }
  }
}

TEST(ZarrSourceTest, UnitsAreThatOfX) {
  const TemporaryDirectory folder;
  Json attributes = ImageAttributes("zyx", 2, {{2, 3, 4}});
  attributes["multiscales"][0]["axes"][0]["unit"] = "millimeter";
  WriteImage(folder / "a", "zyx", 2);
  WriteZarrGroup(folder / "a", 2, attributes);
  const VolumeGeometry geometry = (*OpenText(folder / "a"))->info().levels[0].description.geometry;
  EXPECT_EQ(geometry.orientation.unit, LengthUnit::kMicrometre);
  EXPECT_NEAR(geometry.spacing.z, 2000, 1e-9);
  attributes["multiscales"][0]["axes"][0]["unit"] = "furlong";
  WriteZarrGroup(folder / "a", 2, attributes);
  const VolumeGeometry unknown = (*OpenText(folder / "a"))->info().levels[0].description.geometry;
  EXPECT_EQ(unknown.orientation.unit, std::nullopt);
  EXPECT_EQ(unknown.spacing, (Vec3{4, 3, 2}));
}

TEST(ZarrSourceTest, LabelImagesSayThatTheyAre) {
  const TemporaryDirectory folder;
  for (const int version : {2, 3}) {
    const std::string path = folder / std::to_string(version);
    WriteImage(path, "zyx", version);
    Json attributes = ImageAttributes("zyx", version, {{1, 1, 1}});
    OmePart(attributes)["image-label"] = {{"colors", Json::array()}};
    WriteZarrGroup(path + "/labels", version);
    WriteZarrGroup(path + "/labels/cells", version, attributes);
    WriteZarrArray(path + "/labels/cells/0", SpecOf("zyx", version), ElementsOf("zyx"));
    for (const std::string& text : {path + "/labels/cells", path + "?array=labels/cells"}) {
      const auto source = OpenText(text);
      ASSERT_TRUE(source.ok()) << source.status().message();
      EXPECT_TRUE((*source)->info().labels);
      EXPECT_EQ(ValuesOf(**source), Volume(0, 0));
    }
    EXPECT_FALSE((*OpenText(path))->info().labels);
  }
}

TEST(ZarrSourceTest, ArchivesHoldWhatFoldersHold) {
  const TemporaryDirectory folder;
  for (const int version : {2, 3}) {
    const std::string path = folder / std::to_string(version), archive = path + (version == 2 ? ".zip" : ".ozx");
    WriteImage(path, "czyx", version);
    std::vector<ZipMember> members;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
      if (entry.is_regular_file())
        members.push_back({entry.path().lexically_relative(path).string(), ReadFile(entry.path().string()), version == 2});
    }
    WriteZip(archive, members);
    const auto source = OpenText(archive + "?channel=1");
    ASSERT_TRUE(source.ok()) << source.status().message();
    EXPECT_EQ(ValuesOf(**source), Volume(0, 1));
    EXPECT_THAT((*source)->info().files, ElementsAre(archive));
    EXPECT_EQ(ValuesOf(**OpenText(archive + "?array=0,channel=1")), Volume(0, 1));
  }
}

TEST(ZarrSourceTest, PlainArraysTakeTheirAxesFromNamesOrFromTheirOrder) {
  const TemporaryDirectory folder;
  const auto write = [&](const std::string& name, const std::string& axes, const Json& names, int version) {
    ZarrSpec spec = SpecOf(axes, version);
    spec.names = version == 3 ? names : Json();
    WriteZarrArray(folder / name, spec, ElementsOf(axes));
    if (version == 2 && !names.is_null()) WriteJson(folder / (name + "/.zattrs"), {{"_ARRAY_DIMENSIONS", names}});
    return folder / name;
  };
  for (const int version : {2, 3}) {
    const std::string v = std::to_string(version);
    EXPECT_EQ(ValuesOf(**OpenText(write("zyx" + v, "zyx", nullptr, version))), Volume(0, 0));
    EXPECT_EQ(ValuesOf(**OpenText(write("xyz" + v, "xyz", {"x", "y", "z"}, version))), Volume(0, 0));
    EXPECT_EQ(ValuesOf(**OpenText(write("named" + v, "zyx", {"level", "lat", "lon"}, version))), Volume(0, 0));
    EXPECT_EQ(ValuesOf(**OpenText(write("yxcz" + v, "yxcz", {"Y", "X", "channel", "Z"}, version) + "?channel=1")), Volume(0, 1));
    EXPECT_EQ(ValuesOf(**OpenText(write("time" + v, "zyxt", {"level", "lat", "lon", "time"}, version) + "?time=1")), Volume(1, 0));
    EXPECT_EQ(ValuesOf(**OpenText(write("five" + v, "tczyx", nullptr, version) + "?time=1,channel=2")), Volume(1, 2));
    EXPECT_EQ(ValuesOf(**OpenText(write("four" + v, "tzyx", nullptr, version) + "?time=1")), Volume(1, 0));
    EXPECT_EQ(ValuesOf(**OpenText(write("other" + v, "czyx", nullptr, version) + "?channel=2")), Volume(0, 2));
  }
  const auto source = OpenText(folder / "zyx3?spacing=1,2,3");
  EXPECT_EQ((*source)->info().format, "Zarr 3");
  EXPECT_EQ((*source)->info().levels[0].description.geometry.spacing, (Vec3{1, 2, 3}));
  EXPECT_THAT((*source)->info().channels, IsEmpty());
  EXPECT_EQ((*OpenText(folder / "zyx2"))->info().format, "Zarr 2");
  EXPECT_THAT(OpenText(folder / "four2").status().message(), HasSubstr("four2: holds 2 volumes, of which --time takes one: 0 to 1"));
  EXPECT_EQ(ValuesOf(**OpenText(folder / "five2?time=0")), Volume(0, 0));
  WriteZarrArray(folder / "one", {.shape = {5}, .chunk = {5}}, ElementsOf("x"));
  EXPECT_THAT(OpenText(folder / "one").status().message(), HasSubstr("one: has 1 axis, must have 2 or more"));
  WriteZarrArray(folder / "six", {.shape = {2, 1, 1, 4, 4, 4}, .chunk = {1, 1, 1, 4, 4, 4}}, [](auto) { return 0; });
  EXPECT_TRUE(OpenText(folder / "six?time=0").ok());
  WriteZarrArray(folder / "bad", {.shape = {1, 1, 2, 4, 4, 4}, .chunk = {1, 1, 1, 4, 4, 4}}, [](auto) { return 0; });
  EXPECT_THAT(OpenText(folder / "bad").status().message(), HasSubstr("axis 2 has 2 indices and is none of x, y, z, time and channel"));
  // A slice is one voxel thick.
  WriteZarrArray(folder / "flat", {.shape = {kY, kX}, .chunk = {2, 2}}, ElementsOf("yx"));
  EXPECT_EQ((*OpenText(folder / "flat"))->info().levels[0].description.geometry.size, (Index3{kX, kY, 1}));
}

TEST(ZarrSourceTest, GroupsOpenTheirOnlyArrayOrNameThem) {
  const TemporaryDirectory folder;
  for (const int version : {2, 3}) {
    const std::string path = folder / std::to_string(version);
    WriteZarrGroup(path, version);
    EXPECT_THAT(OpenText(path).status().message(), HasSubstr(": a group without arrays"));
    WriteZarrGroup(path + "/deep", version);
    EXPECT_THAT(OpenText(path).status().message(), HasSubstr("a group without arrays, but with groups, of which ?array= takes one: deep"));
    WriteZarrArray(path + "/deep/density", SpecOf("zyx", version), ElementsOf("zyx"));
    EXPECT_EQ(ValuesOf(**OpenText(path + "?array=deep")), Volume(0, 0));
    WriteZarrArray(path + "/deep/speed", SpecOf("zyx", version), ElementsOf("zyx"));
    EXPECT_THAT(OpenText(path + "?array=deep").status().message(),
                HasSubstr("/deep: a group of 2 arrays, of which ?array= takes one: deep/density, deep/speed"));
    EXPECT_EQ(ValuesOf(**OpenText(path + "?array=deep/speed")), Volume(0, 0));
    EXPECT_EQ(OpenText(path + "?array=deep/none").status().code(), StatusCode::kNotFound);
    EXPECT_EQ(OpenText(path + "?array=../elsewhere").status().code(), StatusCode::kInvalidArgument);
  }
}

TEST(ZarrSourceTest, SeriesOfImagesOpenTheFirst) {
  const TemporaryDirectory folder;
  for (const int version : {2, 3}) {
    const std::string path = folder / std::to_string(version);
    Json attributes = Json::object();
    (version == 3 ? attributes["ome"] : attributes)["bioformats2raw.layout"] = 3;
    WriteZarrGroup(path, version, attributes);
    WriteImage(path + "/0", "zyx", version);
    WriteImage(path + "/1", "czyx", version);
    EXPECT_EQ(ValuesOf(**OpenText(path)), Volume(0, 0));
    EXPECT_EQ(ValuesOf(**OpenText(path + "?array=1,channel=1")), Volume(0, 1));
  }
}

TEST(ZarrSourceTest, PlatesAndWellsNameTheirImages) {
  const TemporaryDirectory folder;
  for (const int version : {2, 3}) {
    const std::string path = folder / std::to_string(version);
    const auto group = [&](const std::string& at, const Json& attributes) {
      WriteZarrGroup(path + at, version, version == 3 ? Json{{"ome", attributes}} : attributes);
    };
    group("", {{"plate", {{"wells", {{{"path", "A/1"}}, {{"path", "B/2"}}}}}}});
    group("/A/1", {{"well", {{"images", {{{"path", "0"}}, {{"path", "1"}}}}}}});
    group("/B/2", {{"well", {{"images", {{{"path", "field"}}}}}}});
    WriteImage(path + "/A/1/1", "zyx", version);
    WriteImage(path + "/B/2/field", "zyx", version);
    EXPECT_THAT(OpenText(path).status().message(),
                HasSubstr(": a plate of 2 wells, of which ?array= takes an image, such as A/1/0: A/1, B/2"));
    EXPECT_THAT(OpenText(path + "?array=A/1").status().message(),
                HasSubstr("/A/1: a well of 2 images, of which ?array= takes one: A/1/0, A/1/1"));
    EXPECT_THAT(OpenText(path + "/A/1").status().message(), HasSubstr(": a well of 2 images, of which ?array= takes one: 0, 1"));
    EXPECT_EQ(ValuesOf(**OpenText(path + "?array=A/1/1")), Volume(0, 0));
    EXPECT_EQ(ValuesOf(**OpenText(path + "?array=B/2")), Volume(0, 0)) << "its only image";
  }
}

TEST(ZarrSourceTest, AGroupOfLabelImagesNamesThem) {
  const TemporaryDirectory folder;
  WriteZarrGroup(folder / "labels", 2, {{"labels", {"cells", "nuclei"}}});
  EXPECT_THAT(OpenText(folder / "labels").status().message(), HasSubstr("2 images, of which ?array= takes one: cells, nuclei"));
  WriteZarrGroup(folder / "labels", 2, {{"labels", {"cells"}}});
  WriteImage(folder / "labels/cells", "zyx", 2);
  EXPECT_EQ(ValuesOf(**OpenText(folder / "labels")), Volume(0, 0));
}

TEST(ZarrSourceTest, LabelImagesSayHowTheirLabelsLook) {
  const TemporaryDirectory folder;
  WriteImage(folder / "a", "zyx", 2);
  Json attributes = ImageAttributes("zyx", 2, {{1, 1, 1}});
  attributes["image-label"] = {{"colors",
                                {{{"label-value", 3}, {"rgba", {255, 0, 51, 255}}},
                                 {{"label-value", 1}, {"rgba", {0, 300, 0}}},
                                 {{"label-value", 2}},
                                 {{"label-value", -1}, {"rgba", {0, 0, 0}}}}},
                               {"properties", {{{"label-value", 3}, {"class", "nerve"}}, {{"label-value", 9}, {"name", "bone"}}}}};
  WriteZarrGroup(folder / "a", 2, attributes);
  EXPECT_THAT((*OpenText(folder / "a"))->info().looks,
              ElementsAre(StatedLabel{1, {{0, 1, 0}}, ""}, StatedLabel{3, {{1, 0, 0.2F}}, "nerve"}, StatedLabel{9, std::nullopt, "bone"}));
}

TEST(ZarrSourceTest, ChunksInFoldersAreFoundEvenIfTheMetadataDoNotSaySo) {
  const TemporaryDirectory folder;
  for (const char separator : {'.', '/'}) {
    const std::string path = folder / (separator == '.' ? "flat" : "nested");
    ZarrSpec spec = SpecOf("zyx", 2);
    spec.separator = separator;
    WriteZarrArray(path, spec, ElementsOf("zyx"), [](auto index) { return index[0] == 0 && index[2] == 0; });
    Json metadata = MetadataOf(spec);
    metadata.erase("dimension_separator");
    WriteJson(path + "/.zarray", metadata);
    const std::vector<double> values = ValuesOf(**OpenText(path)), all = Volume(0, 0);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(values[i], i % kX < 3 && i < 3 * kX * kY ? 0 : all[i]) << i;
  }
}

TEST(ZarrSourceTest, OneLineTellsThatNoChunkIsThere) {
  const TemporaryDirectory folder;
  const auto said = [&](const IsMissing& missing) {
    std::filesystem::remove_all(folder / "a");
    WriteZarrArray(folder / "a", SpecOf("czyx", 2), ElementsOf("czyx"), missing);
    const auto source = OpenText(folder / "a?channel=0");
    testing::internal::CaptureStderr();
    ValuesOf(**source);
    ValuesOf(**source);
    return testing::internal::GetCapturedStderr();
  };
  const std::string line = said([](auto) { return true; });
  EXPECT_THAT(line, HasSubstr("/a: no chunk was found, so that all voxels have the fill value; looked for " + folder.path() +
                              "/a/0/0/0/0 and 7 others"));
  EXPECT_EQ(std::ranges::count(line, '\n'), 1);
  EXPECT_EQ(said([](auto index) { return index[1] + index[2] + index[3] < 3; }), "") << "a sparse volume has some";
  EXPECT_THAT(said([](auto index) { return index[0] == 0; }), HasSubstr("no chunk was found")) << "of the channel that is shown";
}

TEST(ZarrSourceTest, SignedAndWideSamplesKeepTheirValues) {
  const TemporaryDirectory folder;
  for (int type = 0; type <= int(SampleType::kFloat64); ++type) {
    const std::string path = folder / std::to_string(type);
    const bool is_signed = SampleType(type) != SampleType::kUint8 && SampleType(type) != SampleType::kUint16 &&
                           SampleType(type) != SampleType::kUint32 && SampleType(type) != SampleType::kUint64;
    const ElementAt element = [&](std::span<const std::uint64_t> at) { return double(at[2]) - (is_signed ? 3 : 0); };
    WriteZarrArray(path, {.shape = {2, 2, 6}, .chunk = {2, 2, 4}, .type = SampleType(type), .big_endian = true}, element);
    const auto source = OpenText(path);
    ASSERT_TRUE(source.ok()) << source.status().message();
    EXPECT_EQ((*source)->info().file_type, ToString(SampleType(type)));
    const std::vector<double> values = ValuesOf(**source);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], double(i % 6) - (is_signed ? 3 : 0)) << type;
  }
}

TEST(ZarrSourceTest, OneLineSaysWhatIsWrongWithAnImage) {
  const TemporaryDirectory folder;
  const std::string path = folder / "a";
  WriteImage(path, "zyx", 2);
  const auto message = [&] { return OpenText(path).status().message(); };
  Json attributes = ImageAttributes("zyx", 2, {{1, 1, 1}});
  attributes["multiscales"][0]["datasets"][0]["path"] = "gone";
  WriteZarrGroup(path, 2, attributes);
  EXPECT_THAT(message(), HasSubstr("a/gone: no Zarr array or group is there"));
  attributes["multiscales"][0]["datasets"][0]["path"] = "../../secret";
  WriteZarrGroup(path, 2, attributes);
  EXPECT_THAT(message(), HasSubstr("names no object: a part of it is '..'"));
  WriteZarrGroup(path, 2, ImageAttributes("tzyx", 2, {{1, 1, 1, 1}}));
  EXPECT_THAT(message(), HasSubstr("a/0: has 3 axes, must have 4 as its image"));
  WriteFile(path + "/.zattrs", "{\"multiscales\": [");
  EXPECT_THAT(message(), HasSubstr("a/.zattrs: damaged: not JSON"));
  WriteFile(path + "/.zattrs", "{}");
  WriteFile(path + "/0/.zarray", std::string(17 << 20, ' '));
  EXPECT_THAT(message(), HasSubstr("a group without arrays"));
  EXPECT_THAT(OpenText(path + "?array=0").status().message(), HasSubstr("0/.zarray: has 17825792 bytes, at most 16777216 are read"));
}

TEST(ZarrSourceTest, KnowsItsFolders) {
  const TemporaryDirectory folder;
  std::filesystem::create_directories(folder / "plain/sub");
  WriteImage(folder / "plain/sub", "zyx", 3);
  EXPECT_EQ(FindFormat(folder / "plain"), nullptr);
  // Some writers leave out .zgroup.
  WriteImage(folder / "bare", "zyx", 2);
  std::filesystem::remove(folder / "bare/.zgroup");
  EXPECT_EQ(ValuesOf(**OpenText(folder / "bare")), Volume(0, 0));
  ASSERT_NE(FindFormat(folder / "plain/sub"), nullptr);
  EXPECT_EQ(FindFormat(folder / "plain/sub")->name, "Zarr");
  EXPECT_EQ(OpenText(folder / "none.zarr").status().code(), StatusCode::kNotFound);
  WriteZip(folder / "other.zip", {{"readme", "text"}});
  EXPECT_EQ(FindFormat(folder / "other.zip"), nullptr);
}

}  // namespace
}  // namespace slabstream
