// Files to fields of labels: which files count, what they may hold, and what is wrong with those that do not suit.
#include "data/layers/label_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>

#include "common/files/files.h"
#include "common/planning/shown_fields.h"
#include "data/catalogue/catalogue.h"
#include "data/catalogue/dataset_fields.h"
#include "data/layers/color_table.h"
#include "data/layers/layer_files.h"
#include "data/open/open_source.h"
#include "data/volume_io/volume_writer.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class LabelFields : public testing::Test {
 protected:
  // A volume of these values along x, in a patient unless `world` says otherwise.
  std::string Write(const std::string& name, const std::vector<float>& values, World world = World::kPatient) {
    Volume volume;
    volume.description.geometry = {{std::int32_t(values.size()), 1, 1}, {1, 1, 1}, {.world = world, .origin = {}}};
    volume.description.type = ScalarType::kFloat32;
    volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), ScalarType::kFloat32);
    std::copy(values.begin(), values.end(), volume.block.samples<float>());
    const std::string path = directory_ / name;
    EXPECT_TRUE(WriteVolume(volume, path).ok());
    return path;
  }
  static Result<LoadedSource> Load(const LayerFiles& files) {
    Result<ReadableSource> read = ReadSource(*DataSource("", "", files).labels, std::uint64_t{1} << 30);
    if (!read.ok()) return read.status();
    return std::get<LoadedSource>(*std::move(read));
  }
  static std::string ErrorOf(const LayerFiles& files) {
    const Result<LoadedSource> read = Load(files);
    EXPECT_FALSE(read.ok());
    return read.ok() ? "" : read.status().message();
  }
  static std::vector<std::uint64_t> Values(const LoadedSource& read) {
    return VisitLabelType(read.volume->block.type, [&]<class T>(const T*) {
      const auto* const samples = read.volume->block.samples<T>();
      return std::vector<std::uint64_t>(samples, samples + read.volume->block.box.voxel_count());
    });
  }
  // A volume of samples as they are in its file.
  template <class T>
  std::string WriteRaw(const char* type, const std::vector<T>& values) {
    const std::string header = "NRRD0004\ntype: " + std::string(type) + "\ndimension: 3\nsizes: " + std::to_string(values.size()) +
                               " 1 1\nencoding: raw\nendian: little\n\n";
    const std::string path = directory_ / (std::string(type) + ".nrrd");
    EXPECT_TRUE(WriteTextFile(path, header + std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T))).ok());
    return path;
  }

  const TemporaryDirectory directory_;
};

TEST_F(LabelFields, EveryTypeKeepsItsLabels) {
  constexpr std::uint64_t kBig = 0xFEDCBA9876543210;
  const auto check = [&](const std::string& path, ScalarType type, const std::vector<std::uint64_t>& values) {
    SCOPED_TRACE(path);
    const LoadedSource read = Load({.labels = path}).value();
    EXPECT_EQ(read.volume->description.type, type);
    EXPECT_EQ(read.volume->description.mapping, ValueMapping());
    EXPECT_EQ(Values(read), values);
  };
  check(WriteRaw<std::uint8_t>("uint8", {0, 255, 3}), ScalarType::kUint8, {0, 255, 3});
  check(WriteRaw<std::int8_t>("int8", {0, 127, 3}), ScalarType::kUint8, {0, 127, 3});
  check(WriteRaw<std::uint16_t>("uint16", {0, 65535, 3}), ScalarType::kUint16, {0, 65535, 3});
  check(WriteRaw<std::int16_t>("int16", {0, 32767, 3}), ScalarType::kUint16, {0, 32767, 3});
  check(WriteRaw<std::uint32_t>("uint32", {0, 0xFFFFFFFF, 16777217}), ScalarType::kUint32, {0, 0xFFFFFFFF, 16777217});
  check(WriteRaw<std::int32_t>("int32", {0, 0x7FFFFFFF, 3}), ScalarType::kUint32, {0, 0x7FFFFFFF, 3});
  check(WriteRaw<std::uint64_t>("uint64", {0, kBig, kBig + 1}), ScalarType::kUint64, {0, kBig, kBig + 1});
  check(WriteRaw<std::int64_t>("int64", {0, std::int64_t{1} << 62, 3}), ScalarType::kUint64, {0, std::uint64_t{1} << 62, 3});
  check(WriteRaw<float>("float", {0, 70000, 3}), ScalarType::kUint64, {0, 70000, 3});
  check(WriteRaw<double>("double", {0, 0x1p52 + 1, 3}), ScalarType::kUint64, {0, (std::uint64_t{1} << 52) + 1, 3});
}

TEST_F(LabelFields, TheTableHasAllLabelsUnlessThereAreTooMany) {
  const LoadedSource few = Load({.labels = Write("labels.nrrd", {0, 70000, 3, 70000, 12})}).value();
  EXPECT_TRUE(few.labels->complete);
  EXPECT_THAT(few.labels->labels,
              ElementsAre(Label{3, StandardColor(3)}, Label{12, StandardColor(12)}, Label{70000, StandardColor(70000)}));
  std::vector<float> values(kMaxLabels + 2);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i);
  ASSERT_TRUE(WriteTextFile(directory_ / "lut.txt", "2 two 255 0 0 0\n").ok());
  const LoadedSource many = Load({.labels = Write("many.nrrd", values), .label_colors = directory_ / "lut.txt"}).value();
  EXPECT_FALSE(many.labels->complete);
  EXPECT_THAT(many.labels->labels, ElementsAre(Label{2, {1, 0, 0}, "two"})) << "those that the table names";
  EXPECT_EQ(Values(many).back(), kMaxLabels + 1);
}

TEST_F(LabelFields, WhatIsNoLabelIsNamed) {
  EXPECT_THAT(ErrorOf({.labels = Write("a.nrrd", {1, 2.5F})}), HasSubstr("the value 2.5 is no label"));
  EXPECT_THAT(ErrorOf({.labels = Write("b.nrrd", {1, -1})}), HasSubstr("the value -1 is no label, which is a whole number of at least 0"));
  EXPECT_THAT(ErrorOf({.labels = Write("d.nrrd", {1, NAN})}), HasSubstr("is no label"));
  EXPECT_THAT(ErrorOf({.labels = WriteRaw<double>("double", {1, 0x1p64})}), HasSubstr("is no label"));
  EXPECT_THAT(ErrorOf({.labels = WriteRaw<std::int64_t>("int64", {1, -5})}), HasSubstr("the value -5 is no label"));
}

TEST_F(LabelFields, BoxesOfASourceHaveTheSameLabelsAsAllOfIt) {
  const std::string path = WriteRaw<std::int32_t>("int32", {5, 6, 0x7FFFFFFF, 8, 9});
  ReadOptions options;
  options.labels = true;
  const std::shared_ptr<VolumeSource> source = OpenSource(path, options, ProcessReadContext()).value();
  std::array<std::uint32_t, 3> box{};
  ASSERT_TRUE(source->ReadNow(0, {{1, 0, 0}, {4, 1, 1}}, std::as_writable_bytes(std::span(box))).ok());
  EXPECT_THAT(box, ElementsAre(6, 0x7FFFFFFF, 8));
}

// Its volume has no values, whatever the labels are.
TEST_F(LabelFields, AFileOfWideLabelsIsADatasetOfLabelsAlone) {
  const DataSource source(WriteRaw<std::int32_t>("int32", {5, 0, 0x7FFFFFFF}) + "?ids=yes", "");
  const LoadedSource volume = std::get<LoadedSource>(ReadSource(source, std::uint64_t{1} << 30).value());
  EXPECT_EQ(volume.volume->description.type, ScalarType::kUint8);
  EXPECT_THAT(std::span(volume.volume->block.samples<std::uint8_t>(), 3), testing::Each(0));
  const std::shared_ptr<const DatasetFields> fields = FieldsOf(source, volume.file);
  ASSERT_TRUE(HasLabelsAlone(*fields));
  const DataSource labels = AtFieldAndTime(source, *fields, *fields->labels(), 0, nullptr);
  EXPECT_THAT(Values(std::get<LoadedSource>(ReadSource(labels, std::uint64_t{1} << 30).value())), ElementsAre(5, 0, 0x7FFFFFFF));
  // Narrow ones stay values.
  const DataSource narrow(WriteRaw<std::uint16_t>("uint16", {5, 0, 70}) + "?ids=yes", "");
  const LoadedSource values = std::get<LoadedSource>(ReadSource(narrow, std::uint64_t{1} << 30).value());
  EXPECT_EQ(FieldsOf(narrow, values.file), nullptr);
  EXPECT_EQ(values.volume->description.type, ScalarType::kUint16);
}

TEST_F(LabelFields, SlantedLabelsKeepTheirNumbers) {
  const std::string path = directory_ / "slanted.nrrd";
  const std::string header =
      "NRRD0004\ntype: uint8\ndimension: 3\nspace: RAS\nsizes: 4 4 4\nencoding: raw\nspace directions: (1,0,0) (0.4,1,0) (0,0.3,1)\n\n";
  std::string samples;
  for (int i = 0; i < 64; ++i) samples += i % 3 == 0 ? char(9) : char(200);
  ASSERT_TRUE(WriteTextFile(path, header + samples).ok());
  EXPECT_THAT(Load({.labels = path}).value().labels->labels, ElementsAre(Label{9, StandardColor(9)}, Label{200, StandardColor(200)}));
}

TEST_F(LabelFields, MissingFilesAreNamed) {
  EXPECT_THAT(ErrorOf({.labels = directory_ / "none.nii"}), HasSubstr("none.nii"));
  const std::string path = Write("labels.nrrd", {1});
  EXPECT_THAT(ErrorOf({.labels = path, .label_colors = directory_ / "none.lut"}), HasSubstr("none.lut"));
  const auto headers = [](const LayerFiles& files) { return CheckFields(DataSource("", "", files)).message(); };
  EXPECT_THAT(headers({.labels = path, .label_colors = directory_ / "none.lut"}), HasSubstr("labels: "));
  EXPECT_THAT(headers({.overlay = directory_ / "none.nii"}), HasSubstr("overlay: "));
  EXPECT_EQ(headers({.labels = path, .overlay = path}), "");
}

TEST_F(LabelFields, ColoursComeFromTheTableThatIsNamed) {
  const std::string path = Write("labels.nrrd", {1, 2, 9});
  ASSERT_TRUE(WriteTextFile(directory_ / "lut.txt", "2 two 255 0 0 0\n77 unused 1 2 3 0\n").ok());
  const LoadedSource layers = Load({.labels = path, .label_colors = directory_ / "lut.txt"}).value();
  EXPECT_EQ(layers.labels->labels[1], (Label{2, {1, 0, 0}, "two"}));
  EXPECT_EQ(layers.labels->labels[0].color, StandardColor(1)) << "which the table does not have";
}

TEST_F(LabelFields, ColoursOfALabelImageCountWithoutATable) {
  const std::string image = directory_ / "cells.zarr";
  std::filesystem::create_directories(image + "/0");
  const auto write = [&](const std::string& name, const std::string& text) { ASSERT_TRUE(WriteTextFile(image + "/" + name, text).ok()); };
  write(".zgroup", R"({"zarr_format": 2})");
  write(".zattrs", R"({"multiscales": [{"version": "0.4", "axes": [{"name": "z", "type": "space"}, {"name": "y", "type": "space"},
    {"name": "x", "type": "space"}], "datasets": [{"path": "0"}]}], "image-label": {"properties": [{"label-value": 9, "name": "nine"}],
    "colors": [{"label-value": 2, "rgba": [0, 0, 255, 255]}]}})");
  write("0/.zarray", R"({"zarr_format": 2, "shape": [1, 1, 3], "chunks": [1, 1, 3], "dtype": "|u1", "compressor": null, "filters": null,
    "fill_value": 0, "order": "C"})");
  write("0/0.0.0", "\x01\x02\x09");
  const LoadedSource layers = Load({.labels = image}).value();
  EXPECT_THAT(layers.labels->labels,
              ElementsAre(Label{1, StandardColor(1), ""}, Label{2, {0, 0, 1}, ""}, Label{9, StandardColor(9), "nine"}));
  ASSERT_TRUE(WriteTextFile(directory_ / "lut.txt", "9 other 255 0 0 0\n").ok());
  const LoadedSource named = Load({.labels = image, .label_colors = directory_ / "lut.txt"}).value();
  EXPECT_THAT(named.labels->labels,
              ElementsAre(Label{1, StandardColor(1), ""}, Label{2, StandardColor(2), ""}, Label{9, {1, 0, 0}, "other"}));
}

TEST_F(LabelFields, ATableBesideANiftiFileCounts) {
  const std::string path = Write("atlas.nii.gz", {1, 2});
  std::string lut(768, '\0');
  lut[1] = char(255);
  ASSERT_TRUE(WriteTextFile(directory_ / "atlas.nii.lut", lut).ok());
  ASSERT_TRUE(WriteTextFile(directory_ / "atlas.nii.txt", "1 Precentral_L 2001\r\n2 Precentral_R 2002\r\nno line of a table\n").ok());
  const LoadedSource layers = Load({.labels = path}).value();
  EXPECT_EQ(layers.labels->labels[0], (Label{1, {1, 0, 0}, "Precentral_L"}));
  EXPECT_EQ(layers.labels->labels[1], (Label{2, StandardColor(2), "Precentral_R"}));
  EXPECT_THAT(ReadLabelColors(path, "").value().files, ElementsAre(directory_ / "atlas.nii.lut", directory_ / "atlas.nii.txt"));
}

TEST_F(LabelFields, AColonDividesFileAndColoursUnlessItBelongsToTheFile) {
  const std::string path = Write("labels.nrrd", {1}), odd = Write("a:b.nrrd", {1});
  LayerFiles files;
  SetLabelFiles(path + ":colours.lut", files);
  EXPECT_EQ(files, (LayerFiles{.labels = path, .label_colors = "colours.lut"}));
  EXPECT_EQ(LabelText(files), path + ":colours.lut");
  SetLabelFiles(odd, files);
  EXPECT_EQ(files, (LayerFiles{.labels = odd}));
  SetLabelFiles(odd + ":c.txt", files);
  EXPECT_EQ(files, (LayerFiles{.labels = odd, .label_colors = "c.txt"}));
  SetLabelFiles("not-there:colours.lut", files);
  EXPECT_EQ(files, (LayerFiles{.labels = "not-there:colours.lut"}));
}

}  // namespace
}  // namespace slabstream
