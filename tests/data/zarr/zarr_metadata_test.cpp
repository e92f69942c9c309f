// Metadata that are wrong: each gives one line that names the object, the field, and what must be there.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "data/zarr/ome.h"
#include "data/zarr/zarr_layout.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/json_at.h"

namespace slabstream {
namespace {

using metadata::Field;
using testing::HasSubstr;

struct Wrong {
  std::string at;     // JSON pointer into right metadata
  std::string value;  // JSON; "": the member is left out
  std::string named;  // in the message
};

Json Changed(Json metadata, const Wrong& wrong) {
  if (!wrong.value.empty()) {
    JsonAt(metadata, wrong.at) = Json::Parse(wrong.value).value();
  } else {
    const std::size_t last = wrong.at.rfind('/');
    JsonAt(metadata, wrong.at.substr(0, last)).erase(wrong.at.substr(last + 1));
  }
  return metadata;
}

template <class Parse>
void ExpectRefused(const Json& right, const std::vector<Wrong>& table, const Parse& parse) {
  ASSERT_TRUE(parse(right).ok()) << parse(right).message();
  for (const Wrong& wrong : table) {
    const Json metadata = Changed(right, wrong);
    const Status status = parse(metadata);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << wrong.at << " " << wrong.value;
    EXPECT_THAT(status.message(), HasSubstr("object: " + wrong.named)) << wrong.at << " " << wrong.value;
    EXPECT_EQ(status.message().find('\n'), std::string::npos);
  }
}

TEST(ZarrMetadataTest, Version2NamesTheFieldThatIsWrong) {
  const ZarrSpec spec{.shape = {20, 30}, .chunk = {4, 5}, .codec = "zstd", .shuffled = true};
  ExpectRefused(MetadataOf(spec),
                {{"/zarr_format", "3", "zarr_format is 3"},
                 {"/zarr_format", "", "zarr_format is missing"},
                 {"/shape", "", "shape is missing"},
                 {"/shape", "[]", "shape is []"},
                 {"/shape", "20", "shape is 20"},
                 {"/shape", "[1,1,1,1,1,1,1,1,1]", "shape is [1,1,1,1,1,1,1,1,1]"},
                 {"/shape/0", "0", "shape[0] is 0"},
                 {"/shape/1", "-3", "shape[1] is -3"},
                 {"/shape/1", "2.5", "shape[1] is 2.5"},
                 {"/shape/1", "1e18", "shape[1] is 1e+18"},
                 {"/shape/1", "1000000000000000000", "shape[1] is 1000000000000000000, must be a whole number in [1, 9007199254740992]"},
                 {"/shape/1", "\"30\"", "shape[1] is \"30\""},
                 {"/chunks", "[4]", "chunks is [4], must be a list of 2 numbers"},
                 {"/chunks/0", "0", "chunks[0] is 0"},
                 {"/chunks/0", "1073741824", "chunks is [1073741824,5], must be smaller"},
                 {"/chunks", "[9007199254740992,9007199254740992]", "chunks is [9007199254740992,9007199254740992], must be smaller"},
                 {"/dtype", "\"<f3\"", "dtype is \"<f3\""},
                 {"/dtype", "\"<c8\"", "dtype is \"<c8\""},
                 {"/dtype", "\"<u3\"", "dtype is \"<u3\""},
                 {"/dtype", "\"|u2\"", "dtype is \"|u2\""},
                 {"/dtype", "\"u2\"", "dtype is \"u2\""},
                 {"/dtype", "[[\"a\",\"<u2\"]]", "dtype is [["},
                 {"/fill_value", "65536", "fill_value is 65536, must be a value of uint16"},
                 {"/fill_value", "-1", "fill_value is -1"},
                 {"/fill_value", "0.5", "fill_value is 0.5"},
                 {"/fill_value", "1e300", "fill_value is 1e+300"},
                 {"/fill_value", "\"NaN\"", "fill_value is \"NaN\""},
                 {"/fill_value", "[0]", "fill_value is [0]"},
                 {"/order", "\"A\"", "order is \"A\""},
                 {"/order", "", "order is missing"},
                 {"/dimension_separator", "\"-\"", "dimension_separator is \"-\""},
                 {"/compressor/id", "\"zfpy\"", "compressor.id is \"zfpy\", must be one of zlib, gzip, zstd, blosc, lz4"},
                 {"/compressor", "\"zstd\"", "compressor.id is missing"},
                 {"/filters", "{}", "filters is {}"},
                 {"/filters/0/id", "\"pcodec\"", "filters[0].id is \"pcodec\""},
                 {"/filters/0", R"({"id": "delta", "dtype": "<i4"})", "filters[0].dtype is \"<i4\", must be uint16"},
                 {"/filters/0", R"({"id": "packbits"})", "filters[0] is {\"id\":\"packbits\"}, must be left out"},
                 {"/filters/0", R"({"id": "fixedscaleoffset", "scale": 0, "offset": 1})", "filters[0].scale is 0"},
                 {"/filters/0/elementsize", "0", "filters[0].elementsize is 0"}},
                [](const Json& metadata) { return zarr::ParseLayout2(Field("object", metadata)).status(); });
}

TEST(ZarrMetadataTest, Version3NamesTheFieldThatIsWrong) {
  const ZarrSpec spec{
      .version = 3, .shape = {20, 30}, .chunk = {4, 5}, .shard = {8, 10}, .transpose = {1, 0}, .codec = "gzip", .names = {"y", "x"}};
  const std::string sharding = "/codecs/1/configuration", named = "codecs[1].configuration.";
  ExpectRefused(MetadataOf(spec),
                {{"/zarr_format", "2", "zarr_format is 2"},
                 {"/shape/0", "0", "shape[0] is 0"},
                 {"/data_type", "\"complex64\"", "data_type is \"complex64\""},
                 {"/data_type", "{\"name\":\"numpy.datetime64\"}", "data_type is {"},
                 {"/chunk_grid/name", "\"rectilinear\"", "chunk_grid.name is \"rectilinear\""},
                 {"/chunk_grid", "", "chunk_grid.name is missing"},
                 {"/chunk_grid/configuration/chunk_shape", "[8]", "chunk_grid.configuration.chunk_shape is [8]"},
                 {"/chunk_grid/configuration/chunk_shape/0", "0", "chunk_grid.configuration.chunk_shape[0] is 0"},
                 {"/chunk_grid/configuration/chunk_shape/0", "4000000000",
                  "chunk_grid.configuration.chunk_shape is [4000000000,10], must be smaller: a shard"},
                 {"/chunk_key_encoding/name", "\"fancy\"", "chunk_key_encoding.name is \"fancy\""},
                 {"/chunk_key_encoding/configuration/separator", "\"\"", "chunk_key_encoding.configuration.separator is \"\""},
                 {"/fill_value", "", "fill_value is missing"},
                 {"/fill_value", "\"0x12\"", "fill_value is \"0x12\""},
                 {"/codecs", "[]", "codecs is []"},
                 {"/codecs", "", "codecs is missing"},
                 {"/codecs/0/name", "\"cast_value\"", "codecs[0].name is \"cast_value\""},
                 {"/codecs/0/configuration/order", "[0,0]", "codecs[0].configuration.order is [0,0]"},
                 {"/codecs/0/configuration/order", "[0,2]", "codecs[0].configuration.order[1] is 2"},
                 {"/codecs/0/configuration/order", "\"F\"", "codecs[0].configuration.order is \"F\""},
                 {"/codecs/1", "{\"name\":\"transpose\",\"configuration\":{\"order\":[0,1]}}", "codecs is "},
                 {"/codecs/2", "{\"name\":\"crc32c\"}", "codecs[2].name is \"crc32c\", must be left out"},
                 {sharding, "", "codecs[1].configuration is missing"},
                 {sharding + "/chunk_shape/0", "3", named + "chunk_shape[0] is 3, must be a divisor of 10"},
                 {sharding + "/chunk_shape", "[1]", named + "chunk_shape is [1]"},
                 {sharding + "/codecs/0/configuration/endian", "\"middle\"", named + "codecs[0].configuration.endian is \"middle\""},
                 {sharding + "/codecs/0/configuration", "{}", named + "codecs[0].configuration.endian is missing"},
                 {sharding + "/codecs/1/name", "\"zfpy\"", named + "codecs[1].name is \"zfpy\""},
                 {sharding + "/codecs/1/name", "\"numcodecs.zfpy\"", named + "codecs[1].name is \"numcodecs.zfpy\""},
                 {sharding + "/codecs/0/name", "\"sharding_indexed\"", named + "codecs[1].name is \"gzip\", must be left out"},
                 {sharding + "/index_codecs", "", named + "index_codecs is missing"},
                 {sharding + "/index_codecs/1", "\"gzip\"", named + "index_codecs[1] is \"gzip\", must be crc32c"},
                 {sharding + "/index_location", "\"middle\"", named + "index_location is \"middle\""},
                 {"/dimension_names", "[\"y\"]", "dimension_names is [\"y\"]"},
                 {"/dimension_names/0", "3", "dimension_names[0] is 3"},
                 {"/storage_transformers", "[{}]", "storage_transformers is [{}]"},
                 {"/new_extension", "{}", "new_extension is {}"},
                 {"/new_extension", "{\"must_understand\":true}", "new_extension is {"}},
                [](const Json& metadata) { return zarr::ParseLayout3(Field("object", metadata)).status(); });
  Json extended = MetadataOf(spec);
  extended["new_extension"] = {{"must_understand", false}};
  EXPECT_TRUE(zarr::ParseLayout3(Field("object", extended)).ok());
}

Json RightImage() {
  return Json::Parse(R"({"multiscales": [{"version": "0.4",
    "axes": [{"name": "c", "type": "channel"}, {"name": "z", "type": "space", "unit": "micrometer"}, {"name": "y", "type": "space"},
             {"name": "x", "type": "space"}],
    "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 2, 0.5, 0.5]},
                                                             {"type": "translation", "translation": [0, 1, 2, 3]}]}],
    "coordinateTransformations": [{"type": "scale", "scale": [1, 10, 10, 10]}]}],
    "omero": {"channels": [{"label": "DAPI", "window": {"start": 5, "end": 200}}]}})")
      .value();
}

TEST(ZarrMetadataTest, ImagesNameTheFieldThatIsWrong) {
  const std::string image = "/multiscales/0", level = image + "/datasets/0", transformations = level + "/coordinateTransformations";
  const std::string named = "multiscales[0].", of_level = named + "datasets[0].", first = of_level + "coordinateTransformations[0]";
  ExpectRefused(RightImage(),
                {{"/multiscales", "[]", "multiscales is []"},
                 {"/multiscales", "{}", "multiscales is {}"},
                 {image + "/version", "\"0.9\"", named + "version is \"0.9\""},
                 {image + "/axes", "[]", named + "axes is []"},
                 {image + "/axes/1/name", "\"x\"", named + "axes[3] is "},
                 {image + "/axes/0/type", "\"space\"", named + "axes[0] is "},
                 {image + "/axes/3/name", "7", named + "axes[3].name is 7"},
                 {image + "/axes/3", "\"q\"", named + "axes is "},
                 {image + "/datasets", "[]", named + "datasets is []"},
                 {level + "/path", "", of_level + "path is missing"},
                 {transformations + "/0/type", "\"byDimension\"", first + ".type is \"byDimension\""},
                 {transformations + "/0/type", "\"affine\"", first + ".affine[0] is missing"},
                 {transformations + "/0/scale", "[1, 2]", first + ".scale is [1,2]"},
                 {transformations + "/0/scale/3", "0", first + ".scale[3] is 0"},
                 {transformations + "/0/scale/3", "-1", first + ".scale[3] is -1"},
                 {transformations + "/0/scale/3", "\"1\"", first + ".scale[3] is \"1\""},
                 {transformations + "/1/translation/3", "null", of_level + "coordinateTransformations[1].translation[3] is null"},
                 {transformations + "/0/scale/3", "1e308", named + "coordinateTransformations[0].scale[3] is 10"},
                 {image + "/coordinateTransformations", "3", named + "coordinateTransformations is 3"}},
                [](const Json& metadata) { return zarr::ParseOmeImage(Field("object", metadata)).status(); });
}

TEST(ZarrMetadataTest, AnImageHasTheTransformationsOfItsLevelAndThenItsOwn) {
  const Json metadata = RightImage();
  const Result<zarr::OmeImage> image = zarr::ParseOmeImage(Field("object", metadata));
  ASSERT_TRUE(image.ok());
  EXPECT_THAT(image->levels[0].place.scale, testing::ElementsAre(1, 20, 5, 5));
  EXPECT_THAT(image->levels[0].place.translation, testing::ElementsAre(0, 10, 20, 30));
  EXPECT_EQ(image->axes[1].unit, LengthUnit::kMicrometre);
  EXPECT_EQ(image->channels[0].name, "DAPI");
  EXPECT_EQ(image->channels[0].window, (ValueRange{5, 200}));
}

// As ngff-zarr writes 0.6: axes of named coordinate systems, and sequences.
TEST(ZarrMetadataTest, CoordinateSystemsAndSequencesOf06AreRead) {
  Json metadata = Json::Parse(R"({"ome": {"version": "0.6", "multiscales": [{
    "coordinateSystems": [{"name": "other", "axes": [{"name": "q"}]},
                          {"name": "intrinsic", "axes": [{"name": "z", "type": "space", "unit": "micrometer"},
                           {"name": "y", "type": "space", "unit": "micrometer"}, {"name": "x", "type": "space", "unit": "micrometer"}]}],
    "datasets": [{"path": "s0", "coordinateTransformations": [{"type": "sequence", "input": {"path": "s0"}, "output": {"name": "intrinsic"},
      "transformations": [{"type": "scale", "scale": [3, 2, 1]}, {"type": "identity"}, {"type": "mapAxis", "mapAxis": [0, 1, 2]},
                          {"type": "translation", "translation": [10, 20, 30]}]}]}]}]}})")
                      .value();
  Json& image = metadata["ome"]["multiscales"][0];
  const auto read = [&] { return zarr::ParseOmeImage(Field("object", metadata)); };
  ASSERT_TRUE(read().ok()) << read().status().message();
  EXPECT_THAT(read()->levels[0].place.scale, testing::ElementsAre(3, 2, 1));
  EXPECT_THAT(read()->levels[0].place.translation, testing::ElementsAre(10, 20, 30));
  EXPECT_EQ(read()->axes[0].unit, LengthUnit::kMicrometre);
  EXPECT_THAT(read()->notes, testing::IsEmpty());

  // Further coordinate systems are not those of the image.
  image["coordinateTransformations"] = {{{"type", "affine"}, {"affine", "somewhere"}, {"output", "world"}}};
  EXPECT_THAT(read()->levels[0].place.scale, testing::ElementsAre(3, 2, 1));
  EXPECT_THAT(read()->notes, testing::ElementsAre(HasSubstr("its transformations to others are not applied")));

  Json& one = image["datasets"][0]["coordinateTransformations"][0];
  one = {{"type", "affine"}, {"output", "intrinsic"}, {"affine", {{3, 0, 0, 10}, {0, 2, 0, 20}, {0, 0, 1, 30}}}};
  EXPECT_THAT(read()->levels[0].place.scale, testing::ElementsAre(3, 2, 1));
  EXPECT_THAT(read()->levels[0].place.translation, testing::ElementsAre(10, 20, 30));
  one["affine"][0][1] = 0.5;
  EXPECT_THAT(read().status().message(), HasSubstr("affine[0][1] is 0.5, must be 0: transformations that turn or shear"));
  one = {{"type", "mapAxis"}, {"output", {{"name", "intrinsic"}}}, {"mapAxis", {2, 1, 0}}};
  EXPECT_THAT(read().status().message(), HasSubstr("mapAxis[0] is 2"));
  one = {{"type", "identity"}};
  for (int nested = 0; nested < 9; ++nested) one = {{"type", "sequence"}, {"transformations", Json::array({one})}};
  one["output"] = "intrinsic";
  EXPECT_THAT(read().status().message(), HasSubstr("in at most 4 sequences"));
}

// spatialdata leads from pixels to several coordinate systems.
TEST(ZarrMetadataTest, TransformationsToOtherSystemsDoNotMoveTheImage) {
  Json metadata = RightImage();
  Json& all = metadata["multiscales"][0]["coordinateTransformations"];
  const auto read = [&] { return zarr::ParseOmeImage(Field("object", metadata)); };
  all = {{{"type", "identity"}, {"output", {{"name", "global"}}}}};
  EXPECT_THAT(read()->notes, testing::IsEmpty());
  all.push_back({{"type", "affine"}, {"affine", {{0, 1}, {1, 0}}}, {"output", {{"name", "other"}}}});
  ASSERT_TRUE(read().ok()) << read().status().message();
  EXPECT_THAT(read()->levels[0].place.scale, testing::ElementsAre(1, 2, 0.5, 0.5));
  EXPECT_THAT(read()->notes, testing::ElementsAre(HasSubstr("are not applied")));
}

TEST(ZarrMetadataTest, VersionsWithEndingsAreKnown) {
  Json metadata = RightImage();
  for (const char* const version : {"0.1", "0.4-dev-spatialdata", "0.5.2", "0.5-dev-spatialdata", "0.6.dev3"}) {
    metadata["multiscales"][0]["version"] = version;
    const Result<zarr::OmeImage> image = zarr::ParseOmeImage(Field("object", metadata));
    ASSERT_TRUE(image.ok()) << image.status().message();
    EXPECT_EQ(image->version, version);
  }
  for (const char* const version : {"0.7", "0.45", "1.4", "latest", ""}) {
    metadata["multiscales"][0]["version"] = version;
    EXPECT_FALSE(zarr::ParseOmeImage(Field("object", metadata)).ok()) << version;
  }
}

// Zarr 3 has a member "ome" for what lay beside it before; some writers left it there.
TEST(ZarrMetadataTest, AttributesOf04CountBesideOme) {
  const Json old = RightImage();
  const auto labels = [&](const Json& ome) {
    Json both = old;
    both["ome"] = ome;
    return zarr::ParseOmeImage(Field("object", both))->axes.size();
  };
  EXPECT_EQ(labels({{"version", "0.5"}}), 4U);
  Json other = old;
  other["multiscales"][0]["axes"] = {"z", "y", "x"};
  other["multiscales"][0].erase("coordinateTransformations");
  other["multiscales"][0]["datasets"] = {{{"path", "0"}}};
  EXPECT_EQ(labels(other), 3U);
}

TEST(ZarrMetadataTest, AxesOfSpaceWithOtherNamesAreTakenByTheirOrder) {
  Json metadata = RightImage();
  const auto kinds = [&](const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < 3; ++i) metadata["multiscales"][0]["axes"][i + 1] = {{"name", names[i]}, {"type", "space"}};
    std::vector<AxisKind> read;
    const auto image = zarr::ParseOmeImage(Field("object", metadata));
    for (const zarr::OmeAxis& axis : image->axes) read.push_back(axis.kind);
    return read;
  };
  using enum AxisKind;
  EXPECT_THAT(kinds({"depth", "lat", "lon"}), testing::ElementsAre(kChannel, kZ, kY, kX));
  EXPECT_THAT(kinds({"k", "j", "i"}), testing::ElementsAre(kChannel, kZ, kY, kX));
  EXPECT_THAT(kinds({"X", "t", "Z"}), testing::ElementsAre(kChannel, kX, kY, kZ));
}

TEST(ZarrMetadataTest, FillValuesMayBeTexts) {
  const auto fill = [](const Json& value, SampleType type) {
    Json metadata = MetadataOf({.shape = {4}, .chunk = {4}, .type = type});
    metadata["fill_value"] = value;
    const Result<zarr::ZarrLayout> layout = zarr::ParseLayout2(Field("object", metadata));
    if (!layout.ok()) return std::string("refused");
    return VisitSampleType(type, [&](const auto* null) {
      std::remove_cvref_t<decltype(*null)> element;
      std::memcpy(&element, layout->shape.fill.data(), sizeof element);
      return fmt::format("{}", double(element));
    });
  };
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt64, SampleType::kFloat16, SampleType::kFloat64}) {
    EXPECT_EQ(fill("0", type), "0");
    EXPECT_EQ(fill("0.0", type), "0");
    EXPECT_EQ(fill("12", type), "12");
    EXPECT_EQ(fill(nullptr, type), "0");
    EXPECT_EQ(fill(true, type), "1");
    EXPECT_EQ(fill("none", type), "refused");
    EXPECT_EQ(fill("", type), "refused");
  }
  EXPECT_EQ(fill("-7", SampleType::kInt16), "-7");
  EXPECT_EQ(fill("-7", SampleType::kUint16), "refused");
  EXPECT_EQ(fill("0.5", SampleType::kUint16), "refused");
  EXPECT_EQ(fill("NaN", SampleType::kUint16), "refused");
  EXPECT_EQ(fill("NaN", SampleType::kFloat32), "nan");
  EXPECT_EQ(fill("-Infinity", SampleType::kFloat16), "-inf");
  EXPECT_EQ(fill("0x3c00", SampleType::kFloat16), "1");
  EXPECT_EQ(fill("0x3f800000", SampleType::kFloat32), "1");
}

TEST(ZarrMetadataTest, NumbersThatPythonWritesAreTexts) {
  const Result<Json> json =
      metadata::ParseJson("object", R"({"a": NaN, "b": [-Infinity, Infinity, 1], "NaN": "NaN \" Infinity", "c\\": -1})");
  ASSERT_TRUE(json.ok());
  EXPECT_EQ(*json, Json::Parse(R"({"a": "NaN", "b": ["-Infinity", "Infinity", 1], "NaN": "NaN \" Infinity", "c\\": -1})").value());
  for (const char* const text : {"{\"a\": NaNs}", "NaN NaN", "{NaN}", "-NaN", "\"NaN", "[nan]"}) {
    EXPECT_EQ(metadata::ParseJson("object", text).status().code(), StatusCode::kDataLoss) << text;
  }
}

TEST(ZarrMetadataTest, WhatIsNoJsonIsDamaged) {
  const Status cut = metadata::ParseJson("object", "{\"shape\": [1,").status();
  EXPECT_EQ(cut.code(), StatusCode::kDataLoss);
  EXPECT_THAT(cut.message(), testing::StartsWith("object: damaged: not JSON: parse error at line 1, column 14"));
  EXPECT_EQ(metadata::ParseJson("object", "").status().code(), StatusCode::kDataLoss);
  const Status deep = metadata::ParseJson("object", std::string(1'000'000, '[')).status();
  EXPECT_EQ(deep.code(), StatusCode::kDataLoss);
  EXPECT_TRUE(metadata::ParseJson("object", std::string(60, '[') + std::string(60, ']')).ok());
  EXPECT_EQ(metadata::ParseJson("object", std::string(80, '[') + std::string(80, ']')).status(),
            Status::DataLoss("object: damaged: values nest more than 64 deep"));
}

}  // namespace
}  // namespace slabstream
