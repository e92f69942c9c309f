// Arrays without OME-Zarr: their axes, their place, and their values by the CF conventions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "data/open/open_source.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::Contains;
using testing::IsEmpty;

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options = {}) {
  return OpenSource(path, options, TestContext());
}

double Number(std::span<const std::uint64_t> at) { return double(at[2] + 4 * at[1] + 12 * at[0]); }

// An array "temperature" of 2 x 3 x 4 elements whose axes are called so, in a group.
void WriteXarray(const std::string& folder, int version, const std::vector<std::string>& names, const Json& attributes = Json::object(),
                 SampleType type = SampleType::kInt16) {
  WriteZarrGroup(folder, version, Json::object());
  ZarrSpec spec{.version = version, .shape = {2, 3, 4}, .chunk = {2, 2, 2}, .type = type, .separator = '/'};
  if (version == 3) spec.names = names;
  WriteZarrArray(folder + "/temperature", spec, Number);
  Json all = attributes;
  if (version == 2) all["_ARRAY_DIMENSIONS"] = names;
  if (version == 2) return WriteJson(folder + "/temperature/.zattrs", all);
  Json metadata = MetadataOf(spec);
  metadata["attributes"] = all;
  WriteJson(folder + "/temperature/zarr.json", metadata);
}

// `each`: how many there are for each index, along a second axis; 0: there is none.
void WriteCoordinates(const std::string& folder, int version, const std::string& name, const std::vector<double>& values,
                      const std::string& unit = "", const std::string& bounds = "", std::uint64_t each = 0) {
  ZarrSpec spec{.version = version, .shape = {values.size()}, .chunk = {2}, .type = SampleType::kFloat64};
  if (each > 0) {
    spec.shape = {values.size() / each, each};
    spec.chunk = {2, 1};
  }
  WriteZarrArray(folder + "/" + name, spec, [&](std::span<const std::uint64_t> at) {
    const std::uint64_t index = each > 0 ? at[0] * each + at[1] : at[0];
    return index < values.size() ? values[index] : 0;
  });
  Json attributes = Json::object();
  if (!unit.empty()) attributes["units"] = unit;
  if (!bounds.empty()) attributes["bounds"] = bounds;
  if (version == 2) return WriteJson(folder + "/" + name + "/.zattrs", attributes);
  Json metadata = MetadataOf(spec);
  metadata["attributes"] = attributes;
  WriteJson(folder + "/" + name + "/zarr.json", metadata);
}

TEST(PlainArrayTest, EvenCoordinatesGiveSpacingOriginAndUnit) {
  for (const int version : {2, 3}) {
    const TemporaryDirectory folder;
    WriteXarray(folder.path(), version, {"depth", "y", "x"});
    WriteCoordinates(folder.path(), version, "depth", {100, 103}, "Micrometers");
    WriteCoordinates(folder.path(), version, "y", {-2, 0, 2}, "um");
    WriteCoordinates(folder.path(), version, "x", {0.5, 0.75, 1, 1.25}, "um");
    // The group has one array of three axes.
    const auto source = Opened(Open(folder.path()));
    const VolumeGeometry geometry = source->info().levels[0].description.geometry;
    EXPECT_EQ(geometry.size, (Index3{4, 3, 2}));
    EXPECT_EQ(geometry.spacing, (Vec3{0.25, 2, 3}));
    EXPECT_EQ(geometry.orientation.origin, (Vec3{0.5, -2, 100}));
    EXPECT_THAT(source->info().notes, Contains(HasSubstr("spacing and origin are those of the coordinates x, y, depth")));
    EXPECT_EQ(Opened(Open(folder.path(), {.spacing = Vec3{1, 2, 5}}))->info().levels[0].description.geometry.spacing, (Vec3{1, 2, 5}));

    WriteCoordinates(folder.path(), version, "depth", {100, 90}, "um");
    WriteCoordinates(folder.path(), version, "y", {0, 1, 3}, "um");
    const auto other = Opened(Open(folder.path()));
    const VolumeGeometry& uneven = other->info().levels[0].description.geometry;
    EXPECT_EQ(uneven.spacing, (Vec3{0.25, 1.5, 10}));
    EXPECT_DOUBLE_EQ(uneven.ToWorld(uneven.stretch.ToData(Vec3{0, 2, 0})).y, 3);
    EXPECT_EQ((*SamplesOf<std::uint16_t>(*other))[0], (*SamplesOf<std::uint16_t>(*source))[12]) << "the voxel with the lowest coordinates";
    EXPECT_EQ(other->info().levels[0].description.geometry.orientation.unit, LengthUnit::kMicrometre);
    EXPECT_THAT(other->info().notes, Contains(HasSubstr("the 3 voxels along y, 1 to 2 apart, lie at their own places")));

    WriteCoordinates(folder.path(), version, "y", {3, 1, 0}, "um");
    const auto even = Opened(Open(folder.path(), {.resample = 9}));
    EXPECT_THAT(even->info().notes,
                Contains(HasSubstr("the 3 voxels along y, 1 to 2 apart, are resampled linearly to 9 even ones 0.5 apart")));
    ExpectValuesOfPlaces(*even, {0.5, 0, 90}, {1.25, 3, 100}, [](const Vec3& at) {
      return (at.x - 0.5) / 0.25 + 4 * (at.y < 1 ? 2 - at.y : (3 - at.y) / 2) + 12 * (100 - at.z) / 10;
    });
    WriteCoordinates(folder.path(), version, "y", {3, 1, 1}, "um");
    EXPECT_THAT(Opened(Open(folder.path()))->info().notes, Contains(HasSubstr("coordinates of y are not evenly spaced")));
    ExpectRefusal(Open(folder.path(), {.resample = 9}), "coordinates y: number 2 is 1, must be finite and below number 1, which is 1");
  }
}

TEST(PlainArrayTest, EvenBoundsPlaceAnAxisBeforeItsCoordinates) {
  for (const int version : {2, 3}) {
    const TemporaryDirectory folder;
    WriteXarray(folder.path(), version, {"depth", "lat", "x"});
    WriteCoordinates(folder.path(), version, "depth", {10, 30}, "", "depth_bnds");
    WriteCoordinates(folder.path(), version, "depth_bnds", {0, 15, 15, 50}, "", "", 2);
    WriteCoordinates(folder.path(), version, "lat", {50, 47, 46}, "", "lat_bnds");
    WriteCoordinates(folder.path(), version, "lat_bnds", {51, 49, 49, 47, 47, 45}, "", "", 2);
    WriteCoordinates(folder.path(), version, "x", {0, 1.25, 2, 3}, "", "x_bnds");
    WriteCoordinates(folder.path(), version, "x_bnds", {-0.5, 0.5, 0.5, 1.5, 1.5, 2.5, 2.5, 3.5}, "", "", 2);
    const auto source = Opened(Open(folder.path()));
    const VolumeGeometry& geometry = source->info().finest().geometry;
    EXPECT_EQ(geometry.spacing, (Vec3{1, 2, 20}));
    EXPECT_EQ(geometry.orientation.origin, (Vec3{0, 46, 10}));
    EXPECT_TRUE(geometry.stretch.even());
    const double first = source->info().finest().mapping.FromStored((*SamplesOf<std::uint16_t>(*source))[0]);
    EXPECT_EQ(first, 8) << "the axis of lat falls";
    EXPECT_THAT(source->info().notes, Contains(HasSubstr("spacing and origin are those of the coordinates x_bnds, lat_bnds, depth")));

    // Bounds that place nothing, so that the coordinates do: an array of another shape, cells with gaps between them, an end that is not a
    // number, and an array that is not there.
    const auto uneven = [&] {
      EXPECT_THAT(Opened(Open(folder.path()))->info().notes,
                  Contains(HasSubstr("the 4 voxels along x, 0.75 to 1.25 apart, lie at their own places")));
    };
    for (const std::vector<double>& bounds : {std::vector<double>{-0.5, 0.5, 1.5, 2.5, 3.5},
                                              {-0.4, 0.4, 0.6, 1.4, 1.6, 2.4, 2.6, 3.4},
                                              {-0.5, 0.5, 0.5, NAN, 1.5, 2.5, 2.5, 3.5}}) {
      std::filesystem::remove_all(folder / "x_bnds");
      WriteCoordinates(folder.path(), version, "x_bnds", bounds, "", "", bounds.size() == 8 ? 2 : 0);
      uneven();
    }
    std::filesystem::remove_all(folder / "x_bnds");
    WriteCoordinates(folder.path(), version, "x_bnds", std::vector<double>(16, 1), "", "", 4);
    uneven();
    std::filesystem::remove_all(folder / "x_bnds");
    uneven();
  }
}

TEST(PlainArrayTest, WhatOthersNameIsNoVolume) {
  const TemporaryDirectory folder;
  WriteXarray(folder.path(), 2, {"z", "y", "x"}, {{"coordinates", "heights lat"}});
  const ZarrSpec spec{.shape = {2, 3, 4}, .chunk = {2, 2, 2}, .type = SampleType::kInt16, .separator = '/'};
  WriteZarrArray(folder / "heights", spec, Number);
  EXPECT_EQ(Opened(Open(folder.path()))->info().finest().geometry.size, (Index3{4, 3, 2}));

  // A slice, and coordinates of two axes with the corners of its cells.
  const TemporaryDirectory flat;
  WriteZarrGroup(flat.path(), 2, Json::object());
  const ZarrSpec slice{.shape = {3, 4}, .chunk = {2, 2}, .type = SampleType::kInt16};
  const ElementAt first = [](std::span<const std::uint64_t> at) { return double(at[1] + 4 * at[0]); };
  WriteZarrArray(flat / "tos", slice, first);
  WriteJson(flat / "tos/.zattrs", {{"coordinates", "lat"}});
  WriteZarrArray(flat / "lat", slice, first);
  WriteJson(flat / "lat/.zattrs", {{"bounds", "vertices"}});
  WriteZarrArray(flat / "vertices", {.shape = {3, 4, 4}, .chunk = {2, 2, 4}, .type = SampleType::kFloat64}, Number);
  EXPECT_EQ(Opened(Open(flat.path()))->info().finest().geometry.size, (Index3{4, 3, 1}));
}

TEST(PlainArrayTest, CoordinatesOfAnotherSizeDoNotCount) {
  const TemporaryDirectory folder;
  WriteXarray(folder.path(), 2, {"z", "y", "x"});
  WriteCoordinates(folder.path(), 2, "x", {1, 3, 5});
  WriteFile(folder / "y/.zarray", "{");
  EXPECT_EQ(Opened(Open(folder / "temperature"))->info().levels[0].description.geometry.spacing, (Vec3{1, 1, 1}));
  EXPECT_EQ(Opened(Open(folder.path(), {.array = "temperature"}))->info().levels[0].description.geometry.spacing, (Vec3{1, 1, 1}));
}

TEST(PlainArrayTest, PackedValuesAreUnpacked) {
  for (const int version : {2, 3}) {
    const TemporaryDirectory folder;
    WriteXarray(folder.path(), version, {"z", "y", "x"}, {{"scale_factor", 0.5}, {"add_offset", {100.0}}});
    const auto source = Opened(Open(folder.path()));
    const VolumeDescription& description = source->info().levels[0].description;
    EXPECT_EQ(description.mapping.FromStored(double((*SamplesOf<std::uint16_t>(*source))[5])), 0.5 * 5 + 100);
    EXPECT_THAT(source->info().notes, ElementsAre("values are scale_factor 0.5 * stored + add_offset 100"));
    WriteXarray(folder.path(), version, {"z", "y", "x"}, {{"scale_factor", 0}});
    EXPECT_THAT(Open(folder.path()).status().message(), HasSubstr("scale_factor is 0, must be a number other than 0"));
  }
}

TEST(PlainArrayTest, MissingValuesAreNotANumber) {
  const Json five = {{"_FillValue", 5}}, in_base64 = {{"_FillValue", "AAAAAAAAFEA="}}, by_name = {{"missing_value", 5}};
  for (const Json& attributes : {five, in_base64, by_name}) {
    for (const SampleType type : {SampleType::kUint8, SampleType::kInt16, SampleType::kFloat16, SampleType::kFloat64}) {
      const TemporaryDirectory folder;
      WriteXarray(folder.path(), 3, {"z", "y", "x"}, attributes, type);
      const auto source = Opened(Open(folder.path()));
      EXPECT_EQ(source->info().file_type, ToString(type));
      EXPECT_THAT(source->info().notes, ElementsAre("stored values of 5 mean that there is none (NaN)"));
      const std::vector<float> values = *SamplesOf<float>(*source);
      for (std::size_t i = 0; i < values.size(); ++i) EXPECT_TRUE(i == 5 ? std::isnan(values[i]) : values[i] == float(i)) << i;
    }
  }
  // NaN is none already.
  const TemporaryDirectory folder;
  WriteXarray(folder.path(), 3, {"z", "y", "x"}, {{"_FillValue", "AAAAAAAA+H8="}}, SampleType::kFloat32);
  EXPECT_THAT(Opened(Open(folder.path()))->info().notes, IsEmpty());
}

TEST(PlainArrayTest, NotesTellWhichAxesWereTaken) {
  const TemporaryDirectory folder;
  const auto notes = [&](const std::vector<std::string>& names) {
    WriteXarray(folder.path(), 3, names);
    const auto source = Opened(Open(folder.path(), {.describe = true}));
    EXPECT_EQ(source->info().levels[0].description.geometry.size, (Index3{4, 3, 2}));
    return source->info().notes;
  };
  EXPECT_THAT(notes({"plane", "Lat", "LON"}), IsEmpty());
  EXPECT_THAT(notes({"scan", "y", "x"}), ElementsAre("the axes scan, y, x are taken for z, y, x"));
  EXPECT_THAT(notes({"x", "x", "x"}), ElementsAre("the axes x, x, x are taken for z, y, x"));
  WriteXarray(folder.path(), 3, {"time", "y", "x"});
  const auto series = Opened(Open(folder.path(), {.describe = true}));
  EXPECT_EQ(series->info().times.count, 2);
  EXPECT_EQ(series->info().time, 0);
  WriteCoordinates(folder.path(), 3, "time", {6, 12}, "hours since 1900-01-01");
  EXPECT_EQ(Opened(Open(folder.path(), {.describe = true}))->info().times, (TimeAxis{2, 6, "h"}));
  WriteCoordinates(folder.path(), 3, "time", {6, NAN}, "hours since 1900-01-01");
  EXPECT_EQ(Opened(Open(folder.path(), {.describe = true}))->info().times, (TimeAxis{2}));
  EXPECT_EQ(Opened(Open(folder.path(), {.time = TimeRange{1, 1}}))->info().time, 1);
}

}  // namespace
}  // namespace slabstream
