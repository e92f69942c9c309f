// Filters of numcodecs: elements that were stored as something else come back.
#include "data/zarr/element_filters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/zarr/zarr_layout.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

Bytes ToBytes(const std::string& text) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
  return Bytes(std::vector<std::byte>(bytes.begin(), bytes.end()));
}
std::string Text(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.span().data()), bytes.size()}; }

struct Filtered {
  Json filters;                        // as .zarray has them
  SampleType type, stored;             // of the array, and of what its chunks hold
  std::vector<double> values, packed;  // the elements of the array, and those of its chunk
  bool big_endian = false;
};

std::vector<Filtered> Cases() {
  using enum SampleType;
  const auto one = [](const Json& filter) { return Json::array({filter}); };
  return {{one({{"id", "delta"}, {"dtype", "<u2"}}), kUint16, kUint16, {5, 7, 4, 65535, 0}, {5, 2, 65533, 65531, 1}},
          {one({{"id", "delta"}, {"dtype", "<u2"}, {"astype", "|i1"}}), kUint16, kInt8, {5, 7, 4, 65535, 0}, {5, 2, -3, -5, 1}},
          {one({{"id", "delta"}, {"dtype", ">i4"}, {"astype", ">i2"}}), kInt32, kInt16, {-5, 70, 0, 3, 3}, {-5, 75, -70, 3, 0}, true},
          {one({{"id", "delta"}, {"dtype", "<f4"}}), kFloat32, kFloat32, {0.5, 2, -1}, {0.5, 1.5, -3}},
          {one({{"id", "fixedscaleoffset"}, {"scale", 10}, {"offset", 100}, {"dtype", "<f4"}, {"astype", "|u1"}}),
           kFloat32,
           kUint8,
           {100.5, 100, 125.5},
           {5, 0, 255}},
          {one({{"id", "astype"}, {"encode_dtype", "<f8"}, {"decode_dtype", "<i2"}}), kInt16, kFloat64, {-3, 4}, {-3, 4}},
          {one({{"id", "quantize"}, {"digits", 1}, {"dtype", "<f8"}, {"astype", "<f4"}}), kFloat64, kFloat32, {0.5, -8}, {0.5, -8}},
          {one({{"id", "bitround"}, {"keepbits", 3}}), kFloat32, kFloat32, {0.5, -8}, {0.5, -8}},
          {Json::array({{{"id", "fixedscaleoffset"}, {"scale", 2}, {"offset", 0}, {"dtype", "<f4"}, {"astype", "<i4"}},
                        {{"id", "delta"}, {"dtype", "<i4"}, {"astype", "|i1"}}}),
           kFloat32,
           kInt8,
           {1, 0.5, 3},
           {2, -1, 5}}};
}

TEST(ElementFiltersTest, ElementsComeBack) {
  for (const Filtered& each : Cases()) {
    SCOPED_TRACE(each.filters.dump());
    const TemporaryDirectory folder;
    Json metadata =
        MetadataOf({.shape = {each.values.size()}, .chunk = {each.values.size()}, .type = each.type, .big_endian = each.big_endian});
    metadata["filters"] = each.filters;
    WriteJson(folder / ".zarray", metadata);
    WriteFile(folder / "0", EncodeSamples(each.stored, each.packed, each.big_endian));
    const Result<zarr::ZarrArray> array = OpenTestArray(folder.path());
    ASSERT_TRUE(array.ok()) << array.status().message();
    const Result<std::vector<double>> elements = ReadElements(*array);
    ASSERT_TRUE(elements.ok()) << elements.status().message();
    EXPECT_EQ(*elements, each.values);

    // Version 3 has them in front of its codec "bytes", whatever their byte order.
    Json third = MetadataOf({.version = 3, .shape = {each.values.size()}, .chunk = {each.values.size()}, .type = each.type});
    Json codecs = Json::array();
    for (Json filter : each.filters) {
      const std::string name = "numcodecs." + filter["id"].get<std::string>();
      filter.erase("id");
      codecs.push_back({{"name", name}, {"configuration", filter}});
    }
    codecs.push_back({{"name", "bytes"}, {"configuration", {{"endian", "little"}}}});
    third["codecs"] = codecs;
    WriteJson(folder / "v3/zarr.json", third);
    WriteFile(folder / "v3/c.0", EncodeSamples(each.stored, each.packed, false));
    const Result<zarr::ZarrArray> opened = OpenTestArray(folder / "v3");
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    EXPECT_EQ(*ReadElements(*opened), each.values);
  }
}

TEST(ElementFiltersTest, TruthValuesAreUnpacked) {
  const Json settings = Json::object();
  const auto filter = zarr::ReadElementFilter("packbits", metadata::Field("object", settings), SampleType::kUint8, true);
  ASSERT_TRUE(filter.ok());
  const std::string packed = "\x06\xb1\xc0";  // 6 bits of the last byte count for nothing
  const Result<Bytes> bits = DecodeChain(filter->chain, ToBytes(packed), 10);
  ASSERT_TRUE(bits.ok()) << bits.status().message();
  EXPECT_EQ(Text(*bits), std::string("\1\0\1\1\0\0\0\1\1\1", 10));
  for (const std::string& damaged : {std::string(), std::string("\x07"), std::string("\x08\xff")}) {
    EXPECT_EQ(DecodeChain(filter->chain, ToBytes(damaged), 10).status().code(), StatusCode::kDataLoss);
  }
}

TEST(ElementFiltersTest, AChunkTakesNoMoreThanItMay) {
  const Json settings = {{"dtype", "<u2"}, {"astype", "|u1"}};
  const auto filter = zarr::ReadElementFilter("delta", metadata::Field("object", settings), SampleType::kUint16, true);
  ASSERT_TRUE(filter.ok());
  EXPECT_EQ(DecodeChain(filter->chain, ToBytes(std::string(100'000, 'a')), 10).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(DecodeChain(filter->chain, ToBytes(std::string(6, 'a')), 10).status().code(), StatusCode::kDataLoss);
}

TEST(ElementFiltersTest, ChecksumsStandInFrontOrBehind) {
  for (const auto& [name, sum] : {std::pair("crc32", "\x26\x39\xf4\xcb"), std::pair("adler32", "\xde\x01\x1e\x09")}) {
    const std::string text = "123456789", stated(sum, 4);
    for (const bool in_front : {true, false}) {
      const TemporaryDirectory folder;
      Json metadata = MetadataOf({.shape = {9}, .chunk = {9}, .type = SampleType::kUint8});
      metadata["filters"] = Json::array({{{"id", name}}});
      if (!in_front) metadata["filters"][0]["location"] = "end";
      WriteJson(folder / ".zarray", metadata);
      WriteFile(folder / "0", in_front ? stated + text : text + stated);
      EXPECT_TRUE(ReadElements(*OpenTestArray(folder.path())).ok()) << name << in_front;
      WriteFile(folder / "0", in_front ? stated + "123456780" : "123456780" + stated);
      EXPECT_THAT(ReadElements(*OpenTestArray(folder.path())).status().message(), HasSubstr("damaged: its "));
    }
  }
}

}  // namespace
}  // namespace slabstream
