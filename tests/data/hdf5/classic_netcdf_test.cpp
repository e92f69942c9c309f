// Classic netCDF files: what they hold is known, and the same as netCDF-4 is read the same. The value of each sample tells where it lies.
#include "data/hdf5/classic_netcdf.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "common/files/files.h"
#include "data/open/open_source.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/hdf5/netcdf_writer.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::Contains;

class ClassicNetcdfTest : public testing::Test {
 protected:
  void Write(const NetcdfWriter& writer) { WriteBytes(writer.Bytes()); }
  void WriteBytes(const std::string& bytes) { ASSERT_TRUE(WriteTextFile(path_, bytes).ok()); }
  std::shared_ptr<VolumeSource> Open(const ReadOptions& options = {}) { return Opened(OpenSource(path_, options, context_)); }
  void ExpectRefused(const std::string& why, const ReadOptions& options = {}) { ExpectRefusal(OpenSource(path_, options, context_), why); }

  // The data values of the finest level.
  static std::vector<float> Values(VolumeSource& source) {
    const VolumeDescription& description = source.info().levels[0].description;
    const AlignedVector<std::byte> bytes = ReadBox(source, 0, description.geometry.bounds());
    std::vector<float> values;
    VisitScalarType(description.type, [&](const auto* null) {
      std::remove_cvref_t<decltype(*null)> sample;
      for (std::size_t i = 0; i < bytes.size(); i += sizeof sample) {
        std::memcpy(&sample, bytes.data() + i, sizeof sample);
        values.push_back(float(description.mapping.FromStored(sample)));
      }
    });
    return values;
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_ / "volume.nc";
  SourceContext context_ = TestReadContext();
};

std::vector<double> Ramp(std::size_t count, double first = 0) {
  std::vector<double> values(count);
  std::iota(values.begin(), values.end(), first);
  return values;
}

// Packed int16 at three times, on a grid whose latitude runs down, beside bounds, a field of bytes and names of stations.
NetcdfWriter Climate(int version) {
  std::vector<double> packed = Ramp(3 * 2 * 3 * 5, -20);
  packed[7] = -999;
  const auto unit = [](const std::string& text) { return NetcdfWriter::Attribute{"units", text}; };
  return {
      .version = version,
      .records = 3,
      .dimensions = {{"time", 0}, {"depth", 2}, {"lat", 3}, {"lon", 5}, {"nv", 2}},
      .attributes = {{"Conventions", "CF-1.8"}},
      .variables = {{"time", {0}, SampleType::kFloat64, {6, 12, 18}, {unit("hours since 1900-01-01 00:00:00"), {"bounds", "time_bnds"}}},
                    {"time_bnds", {0, 4}, SampleType::kFloat64, {3, 9, 9, 15, 15, 21}},
                    {"depth", {1}, SampleType::kInt32, {10, 30}, {unit("m"), {"positive", "down"}}},
                    {"lat", {2}, SampleType::kFloat32, {50, 48, 46}, {unit("degrees_north")}},
                    {"lon", {3}, SampleType::kFloat64, {-1, 0, 1, 2, 3}, {unit("degrees_east"), {"bounds", "lon_bnds"}}},
                    {"lon_bnds", {3, 4}, SampleType::kFloat64, Ramp(10)},
                    {"cells", {0, 1, 2, 3}, std::nullopt, std::vector<double>(90, 'a')},
                    {"ice", {0, 3}, SampleType::kInt8, Ramp(15)},
                    {"thetao",
                     {0, 1, 2, 3},
                     SampleType::kInt16,
                     packed,
                     {{"scale_factor", "", {0.5}},
                      {"add_offset", "", {4}},
                      {"_FillValue", "", {-999}, SampleType::kInt16},
                      {"coordinates", "lon_bnds"}}}}};
}

TEST_F(ClassicNetcdfTest, IsReadAsNetcdf4Is) {
  const std::string netcdf4 = directory_ / "volume.h5";
  {
    const NetcdfWriter same = Climate(1);
    std::vector<std::int16_t> samples(same.variables.back().values.begin(), same.variables.back().values.end());
    Hdf5Writer writer(netcdf4);
    writer.Write("/thetao", {.size = {3, 2, 3, 5}, .chunk = {1, 2, 2, 3}, .type = SampleType::kInt16}, samples.data());
    for (const NetcdfWriter::Variable& each : same.variables) {
      if (each.dimensions.size() != 1) continue;
      writer.Doubles("/" + each.name, {each.values.size()}, each.values);
      for (const NetcdfWriter::Attribute& attribute : each.attributes) writer.Text("/" + each.name, attribute.name, attribute.text);
    }
    writer.Scales("/thetao", {"/time", "/depth", "/lat", "/lon"});
    for (const NetcdfWriter::Attribute& each : same.variables.back().attributes) {
      if (each.text.empty()) writer.Numbers("/thetao", each.name, each.numbers);
    }
  }
  for (const int version : {1, 2, 5}) {
    SCOPED_TRACE(version);
    Write(Climate(version));
    for (int time = 0; time < 3; ++time) {
      const auto classic = Open({.time = TimeRange{time, time}}),
                 other = Opened(OpenSource(netcdf4, {.time = TimeRange{time, time}}, context_));
      EXPECT_EQ(classic->info().format, fmt::format("classic netCDF (CDF-{})", version));
      EXPECT_EQ(classic->info().file_type, "int16");
      EXPECT_EQ(classic->info().times, (TimeAxis{3, 6, "h"}));
      EXPECT_EQ(classic->info().times, other->info().times);
      EXPECT_EQ(classic->info().notes, other->info().notes);
      const VolumeGeometry &geometry = classic->info().levels[0].description.geometry,
                           &as_netcdf4 = other->info().levels[0].description.geometry;
      EXPECT_EQ(geometry.spacing, (Vec3{1, 2, 20}));
      EXPECT_EQ(geometry.orientation.origin, (Vec3{-1, 46, 10}));
      EXPECT_EQ(geometry.spacing, as_netcdf4.spacing);
      EXPECT_EQ(geometry.orientation, as_netcdf4.orientation);
      const std::vector<float> values = Values(*classic), expected = Values(*other);
      ASSERT_EQ(values.size(), 30U);
      for (std::size_t z = 0, i = 0; z < 2; ++z) {
        for (std::size_t y = 0; y < 3; ++y) {
          for (std::size_t x = 0; x < 5; ++x, ++i) {
            const std::size_t number = x + 5 * (2 - y + 3 * (z + 2 * std::size_t(time)));
            SCOPED_TRACE(number);
            ASSERT_EQ(std::isnan(values[i]), number == 7);
            ASSERT_EQ(std::isnan(expected[i]), number == 7);
            if (number == 7) continue;
            ASSERT_EQ(values[i], float(4 + 0.5 * (double(number) - 20)));
            ASSERT_EQ(values[i], expected[i]);
          }
        }
      }
    }
  }
}

TEST_F(ClassicNetcdfTest, EvenBoundsPlaceAnAxisBeforeItsCoordinates) {
  NetcdfWriter writer = Climate(1);
  const auto lon_bnds = std::ranges::find(writer.variables, "lon_bnds", &NetcdfWriter::Variable::name);
  const auto geometry = [&] {
    Write(writer);
    return Open({.time = TimeRange{}})->info().finest().geometry;
  };
  EXPECT_EQ(geometry().spacing.x, 1) << "cells with gaps place nothing";
  lon_bnds->values = {-2, 1, 1, 4, 4, 7, 7, 10, 10, 13};
  EXPECT_EQ(geometry().spacing.x, 3);
  EXPECT_EQ(geometry().orientation.origin.x, -0.5);
}

TEST_F(ClassicNetcdfTest, RecordsOfAnOnlyVariableLieNextToEachOther) {
  for (const bool alone : {true, false}) {
    for (const bool streaming : {true, false}) {
      for (const int version : {1, 2, 5}) {
        SCOPED_TRACE(fmt::format("alone {}, streaming {}, version {}", alone, streaming, version));
        NetcdfWriter writer{.version = version, .streaming = streaming, .records = 4, .dimensions = {{"z", 0}, {"y", 3}, {"x", 3}}};
        writer.variables.push_back({"bytes", {0, 1, 2}, SampleType::kInt8, Ramp(36)});
        if (!alone) writer.variables.push_back({"line", {0, 1}, SampleType::kInt16, Ramp(12)});
        Write(writer);
        EXPECT_THAT(Values(*Open()), testing::ElementsAreArray(Ramp(36)));
      }
    }
  }
}

TEST_F(ClassicNetcdfTest, EveryTypeIsRead) {
  for (const SampleType type : {SampleType::kInt8, SampleType::kUint8, SampleType::kInt16, SampleType::kUint16, SampleType::kInt32,
                                SampleType::kUint32, SampleType::kFloat32, SampleType::kInt64, SampleType::kUint64, SampleType::kFloat64}) {
    SCOPED_TRACE(ToString(type));
    const std::vector<double> values = Ramp(3 * 5 * 7, ToString(type).starts_with('u') ? 3 : -20);
    Write({.version = 5, .dimensions = {{"z", 3}, {"y", 5}, {"x", 7}}, .variables = {{"v", {0, 1, 2}, type, values}}});
    const auto source = Open();
    EXPECT_EQ(source->info().file_type, ToString(type));
    EXPECT_THAT(Values(*source), testing::ElementsAreArray(values));
  }
}

// Rows of more than a slice of the reader, in one piece and in records.
TEST_F(ClassicNetcdfTest, BoxesAreReadFromLargeVariables) {
  for (const std::uint64_t records : {0, 3}) {
    const std::vector<double> values = Ramp(3 * 400 * 500);
    Write({.version = 2,
           .records = records,
           .dimensions = {{"z", records == 0 ? 3 : 0}, {"y", 400}, {"x", 500}},
           .variables = {{"v", {0, 1, 2}, SampleType::kFloat64, values}, {"w", {0, 1, 2}, SampleType::kInt8, values}}});
    const auto source = Open({.dataset = "v"});
    EXPECT_TRUE(source->info().in_parts());
    const Box box{{17, 100, 1}, {400, 371, 3}};
    const AlignedVector<std::byte> bytes = ReadBox(*source, 0, box);
    const float* sample = reinterpret_cast<const float*>(bytes.data());
    for (int z = 1; z < 3; ++z) {
      for (int y = 100; y < 371; ++y) {
        for (int x = 17; x < 400; ++x) ASSERT_EQ(*sample++, float(x + 500 * (y + 400 * z)));
      }
    }
  }
}

TEST_F(ClassicNetcdfTest, SeveralVariablesAreListedWithoutCoordinatesAndTexts) {
  NetcdfWriter writer = Climate(1);
  writer.variables.push_back({"so", {0, 1, 2, 3}, SampleType::kFloat32, Ramp(90)});
  Write(writer);
  ExpectRefused("has 2 datasets, of which --dataset takes one: '/so' of 3 x 2 x 3 x 5 float32, '/thetao' of 3 x 2 x 3 x 5 int16");
  EXPECT_EQ(Open({.time = TimeRange{}, .dataset = "so"})->info().file_type, "float32");
  ExpectRefused("dataset '/cells' holds texts, must hold numbers", {.dataset = "cells"});
  ExpectRefused("dataset '/salt' is not in the file", {.dataset = "salt"});
  ExpectRefused("dataset '/time': has 1 axis, must have 2 or more", {.time = TimeRange{}, .dataset = "time"});
}

TEST_F(ClassicNetcdfTest, MincVolumesAreScaledSliceBySlice) {
  const NetcdfWriter::Attribute varid{"varid", "MINC standard variable"};
  const auto axis = [&](const char* name, double step, double start) {
    return NetcdfWriter::Variable{name, {}, SampleType::kFloat64, {0}, {varid, {"step", "", {step}}, {"start", "", {start}}}};
  };
  std::string bytes =
      NetcdfWriter{.dimensions = {{"zspace", 2}, {"yspace", 3}, {"xspace", 4}},
                   .variables = {axis("xspace", -2, 5),
                                 axis("yspace", 3, -4),
                                 axis("zspace", 1.5, 7),
                                 {"image-max", {0}, SampleType::kFloat64, {255, 510}},
                                 {"image-min", {0}, SampleType::kFloat64, {0, 0}},
                                 {"image", {0, 1, 2}, SampleType::kUint8, Ramp(24, 120), {varid, {"signtype", "unsigned"}}}}}
          .Bytes();
  // MINC 1 has no unsigned types: it stores such bytes as signed ones, here those from 128 on as negative numbers.
  const std::size_t type = bytes.rfind(std::string("\0\0\0\7\0\0\0\x18", 8));
  ASSERT_NE(type, std::string::npos);
  bytes[type + 3] = 1;
  WriteBytes(bytes);
  const auto source = Open();
  EXPECT_EQ(source->info().format, "MINC 1");
  const VolumeGeometry& geometry = source->info().levels[0].description.geometry;
  EXPECT_EQ(geometry.orientation.world, World::kPatient);
  EXPECT_EQ(geometry.spacing, (Vec3{2, 3, 1.5}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{-1, -4, 7}));
  const std::vector<float> values = Values(*source);
  for (std::size_t z = 0, i = 0; z < 2; ++z) {
    for (std::size_t y = 0; y < 3; ++y) {
      for (std::size_t x = 0; x < 4; ++x, ++i) ASSERT_FLOAT_EQ(values[i], float((z + 1) * (120 + (3 - x) + 4 * (y + 3 * z))));
    }
  }
}

TEST_F(ClassicNetcdfTest, WhatAHeaderStatesIsCheckedAgainstTheFile) {
  const NetcdfWriter writer{.dimensions = {{"z", 2}, {"y", 3}, {"x", 4}},
                            .attributes = {{"a", "", {1}}},
                            .variables = {{"v", {0, 1, 2}, SampleType::kInt16, Ramp(24)}}};
  const std::string good = writer.Bytes();
  // Version and records; then each dimension has a length, four bytes of a name and a size.
  struct Mutation {
    std::size_t at;
    std::uint32_t number;
    const char* why;
  };
  const std::size_t attributes = 8 + 8 + 3 * 12, variables = attributes + 8 + 4 + 4 + 4 + 4 + 8, variable = variables + 8;
  for (const auto& [at, number, why] :
       std::vector<Mutation>{{0, 0x43444603, "is a classic netCDF file of version 3, must be 1, 2 or 5"},
                             {8, 13, "has the tag 13 before its dimensions, must be 10 or 0"},
                             {12, 0xffffffff, "states 4294967295 dimensions, must be at most 65536"},
                             {16, 0xfffffff0, "needs 4294967280 bytes from byte 20 on, but the file has"},
                             {24, 0, "'/v' is empty"},
                             {36, 0, "has the unlimited dimension as number 1 of 'v', must be number 0"},
                             {attributes + 4, 70000, "states 70000 attributes, must be at most 65536"},
                             {attributes + 16, 12, "states the type 12 of 'a', must be from 1 to 11"},
                             {attributes + 20, 0x20000000, "needs 4294967296 bytes from byte"},
                             {variables, 10, "has the tag 10 before its variables, must be 11 or 0"},
                             {variable + 8, 2000, "states 2000 dimensions of 'v', must be at most 1024"},
                             {variable + 12, 3, "states the dimension 3 of 'v', must be below 3"},
                             {variable + 32, 2, "'/v' holds texts"},
                             {variable + 32, 6, "'/v' of 2 x 3 x 4 ends at byte"},
                             {variable + 40, 0xffffffff, "'/v' of 2 x 3 x 4 ends at byte 4294967343, but the file has"}}) {
    SCOPED_TRACE(fmt::format("byte {}: {}", at, number));
    std::string bytes = good;
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = char(number >> (24 - 8 * i) & 0xff);
    WriteBytes(bytes);
    ExpectRefused(why, {.dataset = "v"});
  }
  // Of 64 bits, whose products have more.
  NetcdfWriter vast{.version = 5, .records = 1, .dimensions = {{"t", 0}, {"y", 1}, {"x", 1}}};
  vast.variables.push_back({"v", {0, 1, 2}, SampleType::kInt16, {1}});
  vast.variables.push_back({"w", {0, 1}, SampleType::kInt16, {1}});
  std::string bytes = vast.Bytes();
  for (const std::size_t size : {12 + 12 + 20 + 12, 12 + 12 + 2 * 20 + 12}) bytes.replace(size, 8, "\x3f\xff\xff\xff\xff\xff\xff\xff");
  WriteBytes(bytes);
  ExpectRefused("ends at byte 18446744073709551615, but the file has", {.dataset = "v"});
  // More records than the file has.
  NetcdfWriter cut = Climate(1);
  bytes = cut.Bytes();
  bytes[6] = 1;
  WriteBytes(bytes);
  ExpectRefused("dataset '/thetao' of 259 x 2 x 3 x 5 ends at byte", {.time = TimeRange{}, .dataset = "thetao"});
}

TEST_F(ClassicNetcdfTest, FilesThatAreCutOffAnywhereFail) {
  const std::string good = NetcdfWriter{.version = 2,
                                        .records = 2,
                                        .dimensions = {{"z", 0}, {"y", 3}, {"x", 2}},
                                        .attributes = {{"title", "cut"}},
                                        .variables = {{"y", {1}, SampleType::kFloat64, {1, 2, 3}, {{"units", "mm"}}},
                                                      {"v", {0, 1, 2}, SampleType::kInt16, Ramp(12)}}}
                               .Bytes();
  WriteBytes(good);
  EXPECT_THAT(Values(*Open()), testing::ElementsAreArray(Ramp(12)));
  for (std::size_t length = 0; length < good.size(); ++length) {
    SCOPED_TRACE(length);
    WriteBytes(good.substr(0, length));
    ExpectRefused(path_);
  }
}

TEST_F(ClassicNetcdfTest, AlteredBytesNeverDoHarm) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  for (const int version : {1, 2, 5}) {
    NetcdfWriter writer = Climate(version);
    writer.streaming = version == 2;
    const std::string good = writer.Bytes();
    for (int i = 0; i < 700; ++i) {
      std::string bytes = good;
      for (int flips = random.Integer(1, 3); flips > 0; --flips) {
        bytes[random.Integer<std::size_t>(0, bytes.size() - 1)] = char(random.Chance(0.3) ? 0xff : random.Integer(0, 255));
      }
      WriteBytes(bytes);
      const auto source = OpenSource(path_, {.time = TimeRange{}}, context_);
      if (!source.ok()) {
        EXPECT_EQ(source.status().message().find('\n'), std::string::npos);
        continue;
      }
      const VolumeDescription& description = (*source)->info().levels[0].description;
      if (description.voxel_bytes() > 1 << 20) continue;
      AlignedVector<std::byte> samples(std::size_t(description.voxel_bytes()));
      EXPECT_TRUE((*source)->ReadNow(0, description.geometry.bounds(), samples).ok());
    }
  }
}

}  // namespace
}  // namespace slabstream
