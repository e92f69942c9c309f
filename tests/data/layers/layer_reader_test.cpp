// Files to layers: which files count, what label volumes may hold, and what is wrong with those that do not suit.
#include "data/layers/layer_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <span>

#include "common/files/files.h"
#include "data/layers/color_table.h"
#include "data/open/read_volume.h"
#include "data/volume_io/volume_writer.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class LayerReader : public testing::Test {
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
  static VolumeGeometry Grid(std::int32_t side, World world = World::kPatient) {
    return {{side, 1, 1}, {1, 1, 1}, {.world = world, .origin = {}}};
  }
  static std::string ErrorOf(const LayerFiles& files, const VolumeGeometry& grid) {
    const Result<Layers> layers = ReadLayers(files, grid);
    EXPECT_FALSE(layers.ok());
    return layers.ok() ? "" : layers.status().message();
  }
  static std::vector<int> Numbers(const Layers& layers) {
    std::vector<int> numbers;
    VisitScalarType(layers.labels->block.type, [&]<class T>(const T*) {
      const auto* const samples = layers.labels->block.samples<T>();
      numbers.assign(samples, samples + layers.labels->block.box.voxel_count());
    });
    return numbers;
  }

  const TemporaryDirectory directory_;
};

TEST_F(LayerReader, LabelsAreNumberedByTheirValues) {
  const std::string path = Write("labels.nrrd", {0, 70000, 3, 70000, 12});
  const Layers layers = ReadLayers({.labels = path}, Grid(6)).value();
  EXPECT_THAT(Numbers(layers), ElementsAre(0, 3, 1, 3, 2, 0)) << "outside there is no label";
  EXPECT_EQ(layers.labels->block.type, ScalarType::kUint8);
  ASSERT_EQ(layers.table->labels.size(), 3U);
  EXPECT_EQ(layers.table->labels[2].value, 70000U);
  EXPECT_EQ(layers.table->labels[0].color, StandardColor(3));
}

TEST_F(LayerReader, ColoursComeFromTheTableThatIsNamed) {
  const std::string path = Write("labels.nrrd", {1, 2, 9});
  ASSERT_TRUE(WriteTextFile(directory_ / "lut.txt", "2 two 255 0 0 0\n77 unused 1 2 3 0\n").ok());
  const Layers layers = ReadLayers({.labels = path, .label_colors = directory_ / "lut.txt"}, Grid(3)).value();
  EXPECT_EQ(layers.table->labels[1], (Label{2, {1, 0, 0}, "two"}));
  EXPECT_EQ(layers.table->labels[0].color, StandardColor(1)) << "which the table does not have";
}

TEST_F(LayerReader, ColoursOfALabelImageCountWithoutATable) {
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
  const Layers layers = ReadLayers({.labels = image}, Grid(3, World::kVoxels)).value();
  EXPECT_THAT(layers.table->labels,
              ElementsAre(Label{1, StandardColor(1), ""}, Label{2, {0, 0, 1}, ""}, Label{9, StandardColor(9), "nine"}));
  ASSERT_TRUE(WriteTextFile(directory_ / "lut.txt", "9 other 255 0 0 0\n").ok());
  const Layers named = ReadLayers({.labels = image, .label_colors = directory_ / "lut.txt"}, Grid(3, World::kVoxels)).value();
  EXPECT_THAT(named.table->labels,
              ElementsAre(Label{1, StandardColor(1), ""}, Label{2, StandardColor(2), ""}, Label{9, {1, 0, 0}, "other"}));
}

TEST_F(LayerReader, ATableBesideANiftiFileCounts) {
  const std::string path = Write("atlas.nii.gz", {1, 2});
  std::string lut(768, '\0');
  lut[1] = char(255);
  ASSERT_TRUE(WriteTextFile(directory_ / "atlas.nii.lut", lut).ok());
  ASSERT_TRUE(WriteTextFile(directory_ / "atlas.nii.txt", "1 Precentral_L 2001\r\n2 Precentral_R 2002\r\nno line of a table\n").ok());
  const Layers layers = ReadLayers({.labels = path}, Grid(2)).value();
  EXPECT_EQ(layers.table->labels[0], (Label{1, {1, 0, 0}, "Precentral_L"}));
  EXPECT_EQ(layers.table->labels[1], (Label{2, StandardColor(2), "Precentral_R"}));
  EXPECT_THAT(CheckLayerHeaders({.labels = path}).value(), ElementsAre(path, directory_ / "atlas.nii.lut", directory_ / "atlas.nii.txt"));
}

TEST_F(LayerReader, ManyLabelsTakeTwoBytesEach) {
  std::vector<float> values(300);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i);
  const Layers layers = ReadLayers({.labels = Write("many.nrrd", values)}, Grid(300)).value();
  EXPECT_EQ(layers.labels->block.type, ScalarType::kUint16);
  EXPECT_EQ(Numbers(layers).back(), 299);
}

TEST_F(LayerReader, WhatIsNoLabelIsNamed) {
  EXPECT_THAT(ErrorOf({.labels = Write("a.nrrd", {1, 2.5F})}, Grid(2)), HasSubstr("the value 2.5 is no label"));
  EXPECT_THAT(ErrorOf({.labels = Write("b.nrrd", {1, -1})}, Grid(2)), HasSubstr("the value -1 is no label"));
  EXPECT_THAT(ErrorOf({.labels = Write("c.nrrd", {1, 3e8F})}, Grid(2)), HasSubstr("is no label, which is a whole number in [0, 16777216]"));
  EXPECT_THAT(ErrorOf({.labels = Write("d.nrrd", {1, NAN})}, Grid(2)), HasSubstr("is no label"));
  std::vector<float> values(kMaxLabels + 2);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i);
  EXPECT_THAT(ErrorOf({.labels = Write("e.nrrd", values)}, Grid(2)), HasSubstr("more than 4096 labels"));
}

// As float32, 2^24 + 1 is 2^24, which is a label.
TEST_F(LayerReader, LabelsThatFloat32RoundsAreNotTakenForOthers) {
  const std::uint32_t most = kMaxLabelValue;
  const std::vector<std::uint32_t> values = {most, most - 1, most};
  const std::string header = "NRRD0004\ntype: uint32\ndimension: 3\nsizes: 3 1 1\nencoding: raw\nendian: little\n\n";
  const auto write = [&](const std::vector<std::uint32_t>& of) {
    const std::string path = directory_ / "labels.nrrd";
    EXPECT_TRUE(WriteTextFile(path, header + std::string(reinterpret_cast<const char*>(of.data()), 12)).ok());
    return path;
  };
  const VolumeGeometry grid = Grid(3, World::kVoxels);
  EXPECT_THAT(Numbers(ReadLayers({.labels = write(values)}, grid).value()), ElementsAre(2, 1, 2));
  EXPECT_THAT(ErrorOf({.labels = write({most, most + 1, 0})}, grid), HasSubstr("the value 16777217 is no label"));
}

TEST_F(LayerReader, SlantedLabelsKeepTheirNumbers) {
  const std::string path = directory_ / "slanted.nrrd";
  const std::string header =
      "NRRD0004\ntype: uint8\ndimension: 3\nspace: RAS\nsizes: 4 4 4\nencoding: raw\nspace directions: (1,0,0) (0.4,1,0) (0,0.3,1)\n\n";
  std::string samples;
  for (int i = 0; i < 64; ++i) samples += i % 3 == 0 ? char(9) : char(200);
  ASSERT_TRUE(WriteTextFile(path, header + samples).ok());
  const VolumeGeometry grid{{4, 4, 4}, {1, 1, 1}, {.world = World::kPatient, .origin = {}}};
  const Layers layers = ReadLayers({.labels = path}, grid).value();
  ASSERT_EQ(layers.table->labels.size(), 2U);
  EXPECT_EQ(layers.table->labels[0].value, 9U);
  EXPECT_EQ(layers.table->labels[1].value, 200U);
}

TEST_F(LayerReader, LayersLieInTheSameWorld) {
  const std::string path = Write("scene.mha", {1, 2}, World::kVoxels);
  const Result<LoadedVolume> read = ReadVolume(path);
  ASSERT_TRUE(read.ok());
  const World other = read->info.finest().geometry.orientation.world == World::kPatient ? World::kVoxels : World::kPatient;
  EXPECT_THAT(ErrorOf({.labels = path}, Grid(2, other)), HasSubstr("cannot be laid over each other"));
}

TEST_F(LayerReader, MissingFilesAreNamed) {
  EXPECT_THAT(ErrorOf({.labels = directory_ / "none.nii"}, Grid(2)), HasSubstr("none.nii"));
  const std::string path = Write("labels.nrrd", {1});
  EXPECT_THAT(ErrorOf({.labels = path, .label_colors = directory_ / "none.lut"}, Grid(2)), HasSubstr("none.lut"));
  EXPECT_FALSE(CheckLayerHeaders({.labels = path, .label_colors = directory_ / "none.lut"}).ok());
  EXPECT_FALSE(CheckLayerHeaders({.overlay = directory_ / "none.nii"}).ok());
}

TEST_F(LayerReader, AColonDividesFileAndColoursUnlessItBelongsToTheFile) {
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
