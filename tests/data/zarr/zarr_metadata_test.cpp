// Metadata that are wrong: each gives one line that names the object, the field, and what must be there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/zarr/ome.h"
#include "data/zarr/zarr_layout.h"
#include "tests/data/zarr/zarr_files.h"

namespace slabstream {
namespace {

using metadata::Field;
using testing::HasSubstr;

struct Wrong {
  std::string at;     // JSON pointer into right metadata
  std::string value;  // JSON; "": the member is left out
  std::string named;  // in the message
};

ZarrJson Changed(ZarrJson metadata, const Wrong& wrong) {
  const ZarrJson::json_pointer at(wrong.at);
  if (!wrong.value.empty()) {
    metadata[at] = ZarrJson::parse(wrong.value);
  } else {
    metadata.at(at.parent_pointer()).erase(at.back());
  }
  return metadata;
}

template <class Parse>
void ExpectRefused(const ZarrJson& right, const std::vector<Wrong>& table, const Parse& parse) {
  ASSERT_TRUE(parse(right).ok()) << parse(right).message();
  for (const Wrong& wrong : table) {
    const ZarrJson metadata = Changed(right, wrong);
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
                 {"/compressor/id", "\"bz2\"", "compressor.id is \"bz2\", must be one of zlib, gzip, zstd, blosc, lz4"},
                 {"/compressor", "\"zstd\"", "compressor.id is missing"},
                 {"/filters", "{}", "filters is {}"},
                 {"/filters/0/id", "\"delta\"", "filters[0].id is \"delta\""},
                 {"/filters/0/elementsize", "0", "filters[0].elementsize is 0"}},
                [](const ZarrJson& metadata) { return zarr::ParseLayout2(Field("object", metadata)).status(); });
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
                 {sharding + "/codecs/1/name", "\"bz2\"", named + "codecs[1].name is \"bz2\""},
                 {sharding + "/codecs/1/name", "\"numcodecs.bz2\"", named + "codecs[1].name is \"numcodecs.bz2\""},
                 {sharding + "/codecs/0/name", "\"sharding_indexed\"", named + "codecs[1].name is \"gzip\", must be left out"},
                 {sharding + "/index_codecs", "", named + "index_codecs is missing"},
                 {sharding + "/index_codecs/1", "\"gzip\"", named + "index_codecs[1] is \"gzip\", must be crc32c"},
                 {sharding + "/index_location", "\"middle\"", named + "index_location is \"middle\""},
                 {"/dimension_names", "[\"y\"]", "dimension_names is [\"y\"]"},
                 {"/dimension_names/0", "3", "dimension_names[0] is 3"},
                 {"/storage_transformers", "[{}]", "storage_transformers is [{}]"},
                 {"/new_extension", "{}", "new_extension is {}"},
                 {"/new_extension", "{\"must_understand\":true}", "new_extension is {"}},
                [](const ZarrJson& metadata) { return zarr::ParseLayout3(Field("object", metadata)).status(); });
  ZarrJson extended = MetadataOf(spec);
  extended["new_extension"] = {{"must_understand", false}};
  EXPECT_TRUE(zarr::ParseLayout3(Field("object", extended)).ok());
}

ZarrJson RightImage() {
  return ZarrJson::parse(R"({"multiscales": [{"version": "0.4",
    "axes": [{"name": "c", "type": "channel"}, {"name": "z", "type": "space", "unit": "micrometer"}, {"name": "y", "type": "space"},
             {"name": "x", "type": "space"}],
    "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 2, 0.5, 0.5]},
                                                             {"type": "translation", "translation": [0, 1, 2, 3]}]}],
    "coordinateTransformations": [{"type": "scale", "scale": [1, 10, 10, 10]}]}],
    "omero": {"channels": [{"label": "DAPI", "window": {"start": 5, "end": 200}}]}})");
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
                 {image + "/axes/1/name", "\"depth\"", named + "axes[1].name is \"depth\""},
                 {image + "/axes/3/name", "7", named + "axes[3].name is 7"},
                 {image + "/axes/3", "\"q\"", named + "axes is "},
                 {image + "/datasets", "[]", named + "datasets is []"},
                 {level + "/path", "", of_level + "path is missing"},
                 {transformations + "/0/type", "\"affine\"", first + ".type is \"affine\""},
                 {transformations + "/0/scale", "[1, 2]", first + ".scale is [1,2]"},
                 {transformations + "/0/scale/3", "0", first + ".scale[3] is 0"},
                 {transformations + "/0/scale/3", "-1", first + ".scale[3] is -1"},
                 {transformations + "/0/scale/3", "\"1\"", first + ".scale[3] is \"1\""},
                 {transformations + "/1/translation/3", "null", of_level + "coordinateTransformations[1].translation[3] is null"},
                 {transformations + "/0/scale/3", "1e308", named + "coordinateTransformations[0].scale[3] is 10"},
                 {image + "/coordinateTransformations", "3", named + "coordinateTransformations is 3"}},
                [](const ZarrJson& metadata) { return zarr::ParseOmeImage(Field("object", metadata), 2).status(); });
}

TEST(ZarrMetadataTest, AnImageHasTheTransformationsOfItsLevelAndThenItsOwn) {
  const ZarrJson metadata = RightImage();
  const Result<zarr::OmeImage> image = zarr::ParseOmeImage(Field("object", metadata), 2);
  ASSERT_TRUE(image.ok());
  EXPECT_THAT(image->levels[0].scale, testing::ElementsAre(1, 20, 5, 5));
  EXPECT_THAT(image->levels[0].translation, testing::ElementsAre(0, 10, 20, 30));
  EXPECT_EQ(image->axes[1].unit, LengthUnit::kMicrometre);
  EXPECT_EQ(image->channels[0].name, "DAPI");
  EXPECT_EQ(image->channels[0].window, (ValueRange{5, 200}));
}

TEST(ZarrMetadataTest, WhatIsNoJsonIsDamaged) {
  EXPECT_EQ(metadata::ParseJson("object", "{\"shape\": [1,").status(), Status::DataLoss("object: damaged: not JSON"));
  EXPECT_EQ(metadata::ParseJson("object", "").status().code(), StatusCode::kDataLoss);
  const Status deep = metadata::ParseJson("object", std::string(1'000'000, '[')).status();
  EXPECT_EQ(deep.code(), StatusCode::kDataLoss);
  EXPECT_TRUE(metadata::ParseJson("object", std::string(60, '[') + std::string(60, ']')).ok());
  EXPECT_EQ(metadata::ParseJson("object", std::string(80, '[') + std::string(80, ']')).status(),
            Status::DataLoss("object: values nest more than 64 deep"));
}

}  // namespace
}  // namespace slabstream
