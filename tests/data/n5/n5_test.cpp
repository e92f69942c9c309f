// N5 containers, written block by block as the specification says.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "common/files/files.h"
#include "data/n5/n5_array.h"
#include "data/n5/n5_pyramid.h"
#include "data/open/open_source.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/sources/read_array.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using Sizes = std::vector<std::uint64_t>;

std::string BigEndian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += char(value >> (8 * i) & 0xff);
  return text;
}

// As N5 counts: x first.
struct Spec {
  Sizes size, block;
  SampleType type = SampleType::kUint16;
  std::string compression = "raw";  // "zlib" is gzip with useZlib
  bool old_style = false, with_count = false, whole_at_end = false;
  double missing = 0;  // the chance that a block is left out
};

std::string AttributesOf(const Spec& spec, const std::string& more = "") {
  const std::string compression =
      spec.compression == "zlib" ? R"({"type": "gzip", "useZlib": true})" : fmt::format(R"({{"type": "{}"}})", spec.compression);
  return fmt::format(R"({{"dimensions": [{}], "blockSize": [{}], "dataType": "{}", {}: {}{}}})", fmt::join(spec.size, ", "),
                     fmt::join(spec.block, ", "), ToString(spec.type), spec.old_style ? "\"compressionType\"" : "\"compression\"",
                     spec.old_style ? "\"" + spec.compression + "\"" : compression, more);
}

// Random elements; returns all of them, x fastest, in this machine's byte order. Those of missing blocks are 0.
std::vector<std::byte> WriteDataset(const std::filesystem::path& folder, const Spec& spec, Random& random, const std::string& more = "") {
  WriteFile(folder / "attributes.json", AttributesOf(spec, more));
  const std::size_t each = BytesPerSample(spec.type), axes = spec.size.size();
  std::uint64_t count = 1;
  Sizes reversed_counts;
  for (std::size_t axis = axes; axis-- > 0;) reversed_counts.push_back((spec.size[axis] - 1) / spec.block[axis] + 1);
  for (const std::uint64_t along : spec.size) count *= along;
  std::vector<std::byte> elements(count * each);
  Sizes index(axes, 0);
  do {
    if (random.Chance(spec.missing)) continue;
    Sizes begin(axes), inside(axes), stored(axes);
    std::string path = folder.string();
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const std::uint64_t at = index[axes - 1 - axis];
      path += "/" + std::to_string(at);
      begin[axis] = at * spec.block[axis];
      inside[axis] = std::min(spec.block[axis], spec.size[axis] - begin[axis]);
      stored[axis] = spec.whole_at_end ? spec.block[axis] : inside[axis];
    }
    std::string header = BigEndian(spec.with_count ? 1 : 0, 2) + BigEndian(axes, 2), bytes;
    std::uint64_t in_block = 1;
    for (const std::uint64_t along : stored) {
      header += BigEndian(along, 4);
      in_block *= along;
    }
    if (spec.with_count) header += BigEndian(in_block, 4);
    Sizes at(axes, 0);  // the last axis of N5 first
    const Sizes reversed(stored.rbegin(), stored.rend());
    do {
      std::uint64_t place = 0;
      bool outside = false;
      for (std::size_t axis = axes; axis-- > 0;) {
        const std::uint64_t along = at[axes - 1 - axis];
        outside = outside || along >= inside[axis];
        place = place * spec.size[axis] + begin[axis] + along;
      }
      std::string element;  // big endian
      for (std::size_t i = 0; i < each; ++i) element += char(random.Integer(0, 3) * 37);
      bytes += element;
      if (outside) continue;
      std::ranges::reverse(element);
      std::memcpy(elements.data() + place * each, element.data(), each);
    } while (NextIndex(at, reversed));
    WriteFile(path, header + PackBytes(spec.compression == "raw"   ? ""
                                       : spec.compression == "lz4" ? "lz4 java"
                                                                   : spec.compression,
                                       bytes, each));
  } while (NextIndex(index, reversed_counts));
  return elements;
}

class N5Test : public testing::Test {
 protected:
  Result<std::shared_ptr<ChunkedArray>> OpenArray() {
    const auto store = FolderStore(root_);
    const Result<std::optional<Json>> json = metadata::ReadJson(*store, "attributes.json");
    if (!json.ok()) return json.status();
    return n5::OpenArray(store, "", metadata::Field("attributes.json", **json), context_);
  }
  Result<std::shared_ptr<VolumeSource>> Open(const ReadOptions& options = {}) { return OpenSource(root_, options, context_); }
  void ExpectRefused(const ReadOptions& options, const std::string& why) { ExpectRefusal(Open(options), why); }

  TemporaryDirectory directory_;
  const std::string root_ = directory_ / "scan.n5";
  SourceContext context_ = TestReadContext();
};

TEST_F(N5Test, BlocksOfEveryShapeTypeAndCompression) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  const std::vector<std::string> compressions = {"raw", "gzip", "zlib", "zstd", "blosc", "lz4", "bzip2", "xz"};
  for (int round = 0; round < 120; ++round) {
    Spec spec{.type = SampleType(random.Integer(0, 9)),
              .compression = compressions[random.Integer<std::size_t>(0, compressions.size() - 1)],
              .with_count = random.Chance(0.3),
              .whole_at_end = random.Chance(0.3),
              .missing = random.Chance(0.5) ? 0.3 : 0};
    spec.old_style = spec.compression != "zlib" && random.Chance(0.3);
    for (int axes = random.Integer(1, 4); axes > 0; --axes) {
      spec.size.push_back(random.Integer<std::uint64_t>(1, 12));
      spec.block.push_back(random.Integer<std::uint64_t>(1, 7));
    }
    SCOPED_TRACE(AttributesOf(spec));
    std::filesystem::remove_all(root_);
    const std::vector<std::byte> expected = WriteDataset(root_, spec, random);
    const auto array = OpenArray();
    ASSERT_TRUE(array.ok()) << array.status().message();
    const Result<std::vector<std::byte>> elements = ReadArray(**array);
    ASSERT_TRUE(elements.ok()) << elements.status().message();
    ASSERT_EQ(*elements, expected);
  }
}

TEST_F(N5Test, DamagedBlocksAreNamed) {
  Random random(6);
  WriteDataset(root_, {.size = {5, 4}, .block = {4, 4}}, random);
  const auto array = OpenArray();
  ASSERT_TRUE(array.ok()) << array.status().message();
  const std::string whole = BigEndian(0, 2) + BigEndian(2, 2) + BigEndian(4, 4) + BigEndian(4, 4) + std::string(32, 'x');
  const std::pair<std::string, const char*> cases[] = {
      {whole.substr(0, 7), "the header of the block is cut off"},
      {"", "is a block of 0 axes, must have 2"},
      {BigEndian(2, 2) + whole.substr(2), "is a block of mode 2, must be 0 or 1"},
      {BigEndian(0, 2) + BigEndian(3, 2) + whole.substr(4), "is a block of 3 axes, must have 2"},
      {whole.substr(0, 4) + BigEndian(0, 4) + whole.substr(8), "is a block of 0 elements along axis 0, must have 1 to 4"},
      {whole.substr(0, 4) + BigEndian(0xffffffff, 4) + whole.substr(8), "is a block of 4294967295 elements along axis 0"},
      {BigEndian(1, 2) + whole.substr(2, 10) + BigEndian(17, 4) + whole.substr(12), "is a block of 17 elements, must have 16"},
      {whole.substr(0, 40), "has 28 bytes, expected 32"},
      {whole + "xx", "has 34 bytes, expected 32"},
  };
  const Sizes first = {0, 0};
  for (const auto& [bytes, why] : cases) {
    WriteFile(root_ + "/0/0", bytes);
    const Status status = ReadChunkNow(**array, first).status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << why;
    EXPECT_THAT(status.message(), testing::AllOf(HasSubstr("scan.n5/0/0: "), HasSubstr(why)));
  }
}

TEST_F(N5Test, WrongAttributesAreNamed) {
  const std::string good = AttributesOf({.size = {5, 4, 3}, .block = {2, 2, 2}});
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const std::pair<std::string, const char*> cases[] = {
      {"{", "attributes.json: damaged: not JSON"},
      {"[1]", "must be an object"},
      {with("[5, 4, 3]", "[5, 0, 3]"), "dimensions[1] is 0, must be a whole number"},
      {with("[5, 4, 3]", "7"), "dimensions is 7, must be a list"},
      {with("[2, 2, 2]", "[2, 2]"), "blockSize is [2,2], must be a list of 3 numbers"},
      {with("[2, 2, 2]", "[2000000000, 2000000000, 2000000000]"), "has blocks of more than 1073741824 bytes"},
      {with("uint16", "string"), "dataType is \"string\", must be one of int8"},
      {with("raw", "jpeg"), "compression.type is \"jpeg\", must be a supported compression: raw, gzip, zstd, blosc, lz4, bzip2 or xz"},
      {with("\"compression\"", "\"packing\""), "must be a text"},
  };
  for (const auto& [text, why] : cases) {
    WriteFile(root_ + "/attributes.json", text);
    ExpectRefused({}, why);
  }
}

TEST_F(N5Test, ViewsOfBigStitcher) {
  Random random(7);
  const std::string setup_attributes = R"({"downsamplingFactors": [[1, 1, 1], [2, 2, 1]], "dataType": "uint16"})";
  std::vector<std::byte> fine, coarse;
  for (const std::string setup : {"/setup0", "/setup2"}) {
    WriteFile(root_ + setup + "/attributes.json", setup_attributes);
    for (const std::string time : {"/timepoint0", "/timepoint4"}) {
      WriteFile(root_ + setup + time + "/attributes.json", R"({"multiScale": true, "resolution": [1, 1, 1]})");
      fine = WriteDataset(root_ + setup + time + "/s0", {.size = {9, 8, 5}, .block = {4, 4, 4}, .compression = "gzip"}, random);
      coarse = WriteDataset(root_ + setup + time + "/s1", {.size = {4, 4, 5}, .block = {4, 4, 4}, .compression = "gzip"}, random);
    }
  }
  WriteFile(root_ + "/attributes.json", R"({"n5": "2.5.1"})");
  WriteFile(directory_ / "scan.xml",
            "<SpimData><SequenceDescription><ViewSetups><ViewSetup><id>2</id><name>green</name>"
            "<voxelSize><unit>um</unit><size>0.5 0.5 2</size></voxelSize></ViewSetup></ViewSetups></SequenceDescription></SpimData>");
  WriteFile(directory_ / "scan.settings.xml", "<S><ConverterSetup><id>2</id><min>1</min><max>3</max></ConverterSetup></S>");
  ExpectRefused({.channel = 2}, "scan.n5: has 2 channels, so channel must be 0 to 1 (0, 1: green)");
  ExpectRefused({}, "setup0: holds 2 volumes, of which --time takes one");  // of the first channel
  ExpectRefused({.channel = 1}, "setup2: holds 2 volumes, of which --time takes one");
  const auto source = Open({.time = TimeRange{1, 1}, .channel = 1});
  ASSERT_TRUE(source.ok()) << source.status().message();
  const SourceInfo& info = (*source)->info();
  EXPECT_EQ(info.format, "BigDataViewer N5");
  EXPECT_THAT(info.channels, testing::ElementsAre(FieldInfo{}, FieldInfo{.name = "green", .window = ValueRange{1, 3}}));
  EXPECT_EQ(info.times.count, 2);
  EXPECT_EQ((*source)->At(0, 1), nullptr) << "each has attributes of its own";
  ASSERT_EQ(info.levels.size(), 2U);
  const VolumeGeometry& geometry = info.levels[1].description.geometry;
  EXPECT_EQ(info.levels[0].description.geometry.size, (Index3{9, 8, 5}));
  EXPECT_EQ(geometry.spacing, (Vec3{1, 1, 2}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{0.25, 0.25, 0}));
  EXPECT_EQ(geometry.orientation.unit, LengthUnit::kMicrometre);
  EXPECT_EQ(SamplesOf<std::byte>(**source).value(), fine);
  EXPECT_EQ(SamplesOf<std::byte>(**source, 1).value(), coarse);
}

TEST_F(N5Test, GroupsOfLevels) {
  Random random(8);
  for (const std::string group : {"/raw", "/deep/labels"}) {
    WriteFile(root_ + group + "/attributes.json",
              R"({"scales": [[1, 1, 1], [2, 2, 2], [4, 4, 4]], "pixelResolution": {"unit": "nm", "dimensions": [4, 4, 40]}})");
    WriteDataset(root_ + group + "/s0", {.size = {9, 8, 5}, .block = {4, 4, 4}}, random);
    WriteDataset(root_ + group + "/s1", {.size = {4, 4, 2}, .block = {4, 4, 4}}, random);
    WriteDataset(root_ + group + "/s2", {.size = {2, 2, 1}, .block = {4, 4, 4}}, random, R"(, "downsamplingFactors": [4, 4, 5])");
  }
  const auto only = Open();
  ASSERT_TRUE(only.ok()) << only.status().message();
  ASSERT_EQ((*only)->info().levels.size(), 3U);
  const VolumeGeometry& coarsest = (*only)->info().levels[2].description.geometry;
  EXPECT_EQ(coarsest.spacing, (Vec3{16, 16, 200}));
  EXPECT_EQ(coarsest.orientation.origin, (Vec3{6, 6, 80}));
  EXPECT_EQ(coarsest.orientation.unit, LengthUnit::kNanometre);
  EXPECT_TRUE(Open({.array = "deep/labels"}).ok());
  const auto level = Open({.array = "deep/labels/s1"});
  ASSERT_TRUE(level.ok()) << level.status().message();
  EXPECT_EQ((*level)->info().levels[0].description.geometry.size, (Index3{4, 4, 2}));
  ExpectRefused({.array = "deep"}, "scan.n5/deep: is no dataset, and no group of levels");
  ExpectRefused({.array = "../other"}, "");
  WriteDataset(root_ + "/more", {.size = {4, 4, 2}, .block = {4, 4, 4}}, random);
  ExpectRefused({}, "scan.n5: holds 2 volumes, of which ?array= takes one: more, raw");
  ExpectRefused({.dataset = "/raw"}, "dataset is no option of N5");
}

// A writer that appends may write the levels of a time one after the other.
TEST_F(N5Test, TheFinestLevelTellsTheTimes) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  WriteDataset(root_ + "/s0", {.size = {4, 4, 4, 3}, .block = {4, 4, 4, 1}}, random);
  WriteDataset(root_ + "/s1", {.size = {2, 2, 2, 2}, .block = {2, 2, 2, 1}}, random);
  const auto source = Open({.time = TimeRange{1, 1}});
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_EQ((*source)->info().times.count, 3);
  ExpectRefused({.time = TimeRange{2, 2}}, "scan.n5/s1: time is 2, must be in [0, 1]");
}

// COSEM's lists are in the order of `axes`, whatever that is.
TEST_F(N5Test, TransformsSayWhereLevelsLie) {
  Random random(9);
  const std::string zyx = R"(, "transform": {"axes": ["z", "y", "x"], "scale": [5, 4, 3], "translate": [100, 200, 300],
    "units": ["nm", "nm", "nm"]})";
  const std::string xyz = R"(, "transform": {"axes": ["x", "y", "z"], "scale": [6, 8, 10], "translate": [301.5, 202, 102.5],
    "units": ["nm", "nm", "nm"]})";
  WriteDataset(root_ + "/em/fine", {.size = {9, 8, 5}, .block = {4, 4, 4}}, random, zyx);
  WriteDataset(root_ + "/em/coarse", {.size = {4, 4, 2}, .block = {4, 4, 4}}, random, xyz);
  WriteFile(root_ + "/em/attributes.json", R"({"multiscales": [{"datasets": [{"path": "fine"}, {"path": "coarse"}]}]})");
  const auto check = [](const SourceInfo& info) {
    ASSERT_EQ(info.levels.size(), 2U);
    const VolumeGeometry &fine = info.levels[0].description.geometry, &coarse = info.levels[1].description.geometry;
    EXPECT_EQ(fine.spacing, (Vec3{3, 4, 5}));
    EXPECT_EQ(fine.orientation.origin, (Vec3{300, 200, 100}));
    EXPECT_EQ(fine.orientation.unit, LengthUnit::kNanometre);
    EXPECT_EQ(coarse.spacing, (Vec3{6, 8, 10}));
    EXPECT_EQ(coarse.orientation.origin, (Vec3{301.5, 202, 102.5}));
    EXPECT_THAT(info.notes, testing::ElementsAre("spacing and origin are those of the attribute transform"));
  };
  const auto own = Open();
  ASSERT_TRUE(own.ok()) << own.status().message();
  check((*own)->info());

  // The group may say it of all levels, in COSEM's words or in those of OME-Zarr.
  WriteDataset(root_ + "/em/fine", {.size = {9, 8, 5}, .block = {4, 4, 4}}, random);
  WriteDataset(root_ + "/em/coarse", {.size = {4, 4, 2}, .block = {4, 4, 4}}, random);
  WriteFile(root_ + "/em/attributes.json",
            R"({"multiscales": [{"datasets": [{"path": "fine")" + zyx + R"(}, {"path": "coarse")" + xyz + "}]}]}");
  check((*Open())->info());
  WriteFile(root_ + "/em/attributes.json",
            R"({"multiscales": [{"axes": [{"name": "z", "unit": "nanometer"}, {"name": "y", "unit": "nanometer"},
    {"name": "x", "unit": "nanometer"}], "datasets": [
    {"path": "fine", "coordinateTransformations": [{"type": "scale", "scale": [5, 4, 3]}, {"type": "translation", "translation": [100, 200, 300]}]},
    {"path": "coarse", "coordinateTransformations": [{"type": "scale", "scale": [10, 8, 6]},
      {"type": "translation", "translation": [102.5, 202, 301.5]}]}]}]})");
  check((*Open())->info());

  const auto refused = [&](const std::string& transform, const char* why) {
    WriteDataset(root_ + "/bad", {.size = {4, 4, 4}, .block = {4, 4, 4}}, random, R"(, "transform": )" + transform);
    ExpectRefused({.array = "bad"}, why);
  };
  refused(R"({"axes": ["z", "y", "x"], "scale": [1, 2]})", "transform.scale is [1,2], must be a list of 3 numbers");
  refused(R"({"axes": ["z", "y", "x"], "scale": [1, 2, 0]})", "transform.scale[2] is 0, must be above 0");
  refused(R"({"scale": [1, 2, 3], "translate": [1, 2]})", "transform.translate[2]");
  refused(R"({"scale": [1, 2, 3], "units": ["nm", "um", "um"]})", "must be one unit for all axes of space");
}

// x, y, channels, slices, frames, without those of 1.
TEST_F(N5Test, HyperstacksOfFiji) {
  Random random(10);
  const auto write = [&](const Sizes& size, int channels, int slices, int frames) {
    std::filesystem::remove_all(root_);
    return WriteDataset(root_, {.size = size, .block = Sizes(size.size(), 8)}, random,
                        fmt::format(R"(, "pixelWidth": 0.5, "pixelHeight": 0.25, "pixelDepth": 2, "pixelUnit": "um", "xOrigin": 4,
      "frameInterval": 2.5, "numChannels": {}, "numSlices": {}, "numFrames": {})",
                                    channels, slices, frames));
  };
  const std::vector<std::byte> elements = write({5, 4, 2, 3}, 2, 3, 1);
  const auto source = Open({.channel = 1});
  ASSERT_TRUE(source.ok()) << source.status().message();
  const SourceInfo& info = (*source)->info();
  const VolumeGeometry& geometry = info.levels[0].description.geometry;
  EXPECT_EQ(info.channels.size(), 2U);
  EXPECT_EQ(info.times.count, 1);
  EXPECT_EQ(geometry.size, (Index3{5, 4, 3}));
  EXPECT_EQ(geometry.spacing, (Vec3{0.5, 0.25, 2}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{-2, 0, 0}));
  EXPECT_EQ(geometry.orientation.unit, LengthUnit::kMicrometre);
  std::vector<std::byte> expected;
  for (std::size_t z = 0; z < 3; ++z) {
    const auto slice = elements.begin() + std::ptrdiff_t((2 * z + 1) * 40);  // of 20 elements of 2 bytes
    expected.insert(expected.end(), slice, slice + 40);
  }
  EXPECT_EQ(SamplesOf<std::byte>(**source).value(), expected);

  write({5, 4, 3, 6}, 1, 3, 6);
  EXPECT_EQ((*Open({.time = TimeRange{5, 5}}))->info().times, (TimeAxis{6, 2.5, ""}));
  EXPECT_EQ((*Open({.describe = true}))->info().time, 0);
  write({5, 4, 2, 3, 6}, 2, 3, 6);
  const auto last = Open({.time = TimeRange{5, 5}, .channel = 1});
  EXPECT_EQ((*last)->info().time, 5);
  EXPECT_EQ(SamplesOf<std::byte>(*(*Open({.describe = true}))->At(5, 1)).value(), SamplesOf<std::byte>(**last).value());
  write({5, 4, 1, 3, 1}, 1, 3, 1);
  EXPECT_EQ((*Open())->info().levels[0].description.geometry.size, (Index3{5, 4, 3}));
  write({5, 4, 6}, 2, 3, 1);  // neither 6 slices nor 2 channels
  ExpectRefused({}, "numChannels is 2, must be that of a dataset of 5 x 4 x 6, whose axes are x, y, channels, slices and frames");
}

TEST_F(N5Test, SpacingInTheWordsOfOthers) {
  Random random(11);
  const auto geometry = [&](const std::string& attributes) {
    WriteDataset(root_, {.size = {5, 4, 3}, .block = {4, 4, 4}}, random, attributes);
    return (*Open())->info().levels[0].description.geometry;
  };
  EXPECT_EQ(geometry(R"(, "pixelResolution": [1, 2, 3])").spacing, (Vec3{1, 2, 3}));
  EXPECT_EQ(geometry(R"(, "pixelResolution": {"unit": "um", "dimensions": [1, 2, 3]})").orientation.unit, LengthUnit::kMicrometre);
  EXPECT_EQ(geometry(R"(, "resolution": [1, 2, 3], "units": ["nm", "nm", "nm"])").orientation.unit, LengthUnit::kNanometre);
  EXPECT_EQ(geometry(R"(, "resolution": [1, 2, 3], "offset": [-4, 5, 6])").orientation.origin, (Vec3{-4, 5, 6}));
  EXPECT_EQ(geometry(R"(, "resolution": [3, 2, 1], "offset": [6, 5, -4], "axes": ["z", "y", "x"])").spacing, (Vec3{1, 2, 3}));
  EXPECT_EQ(geometry(R"(, "resolution": [1, 2, 3], "axes": ["x", "y", "z"])").spacing, (Vec3{1, 2, 3}));
}

TEST_F(N5Test, ChannelsInFolders) {
  Random random(12);
  std::vector<std::byte> second;
  for (const char* const channel : {"/c0", "/c1"}) {
    second = WriteDataset(root_ + channel + "/s0", {.size = {9, 8, 5}, .block = {4, 4, 4}}, random);
    WriteDataset(root_ + channel + "/s1", {.size = {5, 4, 3}, .block = {4, 4, 4}}, random, R"(, "downsamplingFactors": [2, 2, 2])");
    WriteFile(root_ + channel + "/attributes.json", R"({"pixelResolution": [1, 1, 2]})");
  }
  const auto source = Open({.channel = 1});
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_EQ((*source)->info().channels.size(), 2U);
  EXPECT_EQ((*source)->info().levels[1].description.geometry.spacing, (Vec3{2, 2, 4}));
  EXPECT_EQ(SamplesOf<std::byte>(**source).value(), second);
  ExpectRefused({.channel = 2}, "has 2 channels, so channel must be 0 to 1");
}

// A folder that is only asked for objects by their names, like a server. Counts them.
class Unlisted : public Store {
 public:
  explicit Unlisted(std::shared_ptr<Store> store) : store_(std::move(store)) {}
  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    ++reads;
    store_->Read(key, range, most, std::move(done));
  }
  Result<std::vector<std::string>> List(const std::string&) override { return Status::InvalidArgument("it cannot list"); }
  const std::string& name() const override { return store_->name(); }

  int reads = 0;

 private:
  const std::shared_ptr<Store> store_;
};

TEST_F(N5Test, WhatCannotBeListedOpensLikeAFolder) {
  Random random(13);
  const auto levels = [&](const std::string& folder) {
    WriteDataset(folder + "/s0", {.size = {9, 8, 5}, .block = {4, 4, 4}}, random);
    WriteDataset(folder + "/s1", {.size = {5, 4, 3}, .block = {4, 4, 4}}, random);
  };
  const auto open = [&](const ReadOptions& options = {}) -> Result<Pyramid> {
    const auto store = std::make_shared<Unlisted>(FolderStore(root_));
    Result<Pyramid> pyramid = n5::OpenPyramid(store, options, context_);
    EXPECT_LT(store->reads, 40);
    return pyramid;
  };
  levels(root_ + "/volumes/raw");
  EXPECT_EQ(open({.array = "volumes/raw"})->levels.size(), 2U);
  EXPECT_EQ(open().status().message(), "it cannot list");
  levels(root_ + "/c0");
  levels(root_ + "/c1");
  EXPECT_EQ(open({.channel = 1})->info.channels.size(), 2U);
  levels(root_);
  EXPECT_EQ(open()->levels.size(), 2U);
  std::filesystem::remove_all(root_);
  for (int setup = 0; setup < 3; ++setup) {
    WriteFile(fmt::format("{}/setup{}/attributes.json", root_, setup), "{}");
    for (int time = 0; time < 21; ++time) {
      WriteFile(fmt::format("{}/setup{}/timepoint{}/s0/attributes.json", root_, setup, time), "{}");
    }
    levels(fmt::format("{}/setup{}/timepoint20", root_, setup));
  }
  const Result<Pyramid> views = open({.time = TimeRange{20, 20}, .channel = 2});
  ASSERT_TRUE(views.ok()) << views.status().message();
  EXPECT_EQ(views->info.times.count, 21);
  EXPECT_EQ(views->info.channels.size(), 3U);
  EXPECT_EQ(views->levels.size(), 2U);
}

TEST_F(N5Test, AnEmptyContainerSaysSo) {
  std::filesystem::create_directories(root_);
  ExpectRefused({}, "scan.n5: holds no dataset");
}

TEST(N5Source, OneLineTellsThatNoBlockIsThere) {
  const TemporaryDirectory directory;
  Random random(15);
  SCOPED_TRACE(random.trace());
  // Attributes that Python wrote may hold NaN.
  WriteDataset(directory / "a.n5", {.size = {6, 5, 4}, .block = {3, 3, 3}, .missing = 1}, random, R"(, "offset": NaN)");
  const auto source = Opened(OpenSource(directory / "a.n5", {}, TestReadContext()));
  testing::internal::CaptureStderr();
  EXPECT_EQ(*SamplesOf<std::uint16_t>(*source), std::vector<std::uint16_t>(120, 0));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("no chunk was found, so that all voxels have the fill value; looked for " +
                                                                (directory / "a.n5/0/0/0") + " and 7 others"));
}

}  // namespace
}  // namespace slabstream
