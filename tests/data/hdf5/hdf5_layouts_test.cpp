// Files as Imaris, BigDataViewer and others write them, opened as sources.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/files/files.h"
#include "data/hdf5/hdf5_format.h"
#include "data/open/open_source.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

// The library forgets what an external link is as soon as a source was opened (Hdf5Lock), so this file is made before any test.
struct FileWithAnExternalLink {
  FileWithAnExternalLink() {
    const std::uint8_t samples[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    Hdf5Writer(directory / "other.h5").Write("/there", {.size = {2, 2, 2}, .type = SampleType::kUint8}, samples);
    Hdf5Writer writer(path);
    writer.Group("/group");
    H5Lcreate_external((directory / "other.h5").c_str(), "/there", writer.file(), "/group/linked", H5P_DEFAULT, H5P_DEFAULT);
  }
  const TemporaryDirectory directory;
  const std::string path = directory / "linking.h5";
};
const FileWithAnExternalLink external_link;

class Hdf5LayoutsTest : public testing::Test {
 protected:
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options = {}) {
    return OpenSource(path, options, context_);
  }
  void ExpectRefused(const std::string& path, const ReadOptions& options, const std::string& why) {
    ExpectRefusal(Open(path, options), why);
  }

  TemporaryDirectory directory_;
  SourceContext context_ = TestReadContext();
};

std::vector<std::uint16_t> Counted(std::size_t count, int step = 1) {
  std::vector<std::uint16_t> samples(count);
  for (std::size_t i = 0; i < count; ++i) samples[i] = std::uint16_t(i * std::size_t(step));
  return samples;
}

// 10 x 6 x 4 voxels in two levels, padded; two channels, two times. The value tells all of it.
std::string WriteImaris(const std::string& path) {
  Hdf5Writer writer(path);
  const auto set = [&](const std::string& object, const std::string& name, const std::string& value) {
    writer.Characters(object, name, value);
  };
  for (int level = 0; level < 2; ++level) {
    const Index3 size = level == 0 ? Index3{10, 6, 4} : Index3{5, 3, 4};
    const Index3 padded = {8 * ((size.x + 7) / 8), 8, 4};
    for (int time = 0; time < 2; ++time) {
      for (int channel = 0; channel < 2; ++channel) {
        const std::string group = "/DataSet/ResolutionLevel " + std::to_string(level) + "/TimePoint " + std::to_string(time) + "/Channel " +
                                  std::to_string(channel);
        std::vector<std::uint16_t> samples;
        for (int z = 0; z < padded.z; ++z) {
          for (int y = 0; y < padded.y; ++y) {
            for (int x = 0; x < padded.x; ++x) {
              const bool inside = x < size.x && y < size.y && z < size.z;
              samples.push_back(std::uint16_t(inside ? 10000 * level + 4000 * time + 2000 * channel + 100 * z + 10 * y + x : 60000));
            }
          }
        }
        writer.Write(group + "/Data",
                     {.size = {hsize_t(padded.z), hsize_t(padded.y), hsize_t(padded.x)}, .chunk = {2, 8, 8}, .filters = {.deflate = true}},
                     samples.data());
        set(group, "ImageSizeX", std::to_string(size.x));
        set(group, "ImageSizeY", std::to_string(size.y));
        set(group, "ImageSizeZ", std::to_string(size.z));
      }
    }
  }
  for (const char* group : {"/DataSetInfo/Image", "/DataSetInfo/Channel 0", "/DataSetInfo/Channel 1"}) writer.Group(group);
  set("/DataSetInfo/Channel 0", "Name", "DAPI");
  set("/DataSetInfo/Channel 1", "Name", "GFP");
  set("/DataSetInfo/Channel 1", "ColorRange", "100.000 4000.000");
  const char* const kExtents[6] = {"-5", "0", "10", "0", "3", "18"};  // begin of x, y, z and their ends
  for (int axis = 0; axis < 3; ++axis) {
    set("/DataSetInfo/Image", "ExtMin" + std::to_string(axis), kExtents[axis]);
    set("/DataSetInfo/Image", "ExtMax" + std::to_string(axis), kExtents[axis + 3]);
  }
  set("/DataSetInfo/Image", "Unit", "um");
  return path;
}

TEST_F(Hdf5LayoutsTest, ImarisFilesHaveLevelsWithoutTheirPadding) {
  const auto source = Open(WriteImaris(directory_ / "cells.ims"), {.time = TimeRange{1, 1}, .channel = 1});
  ASSERT_TRUE(source.ok()) << source.status().message();
  const SourceInfo& info = (*source)->info();
  EXPECT_EQ(info.format, "Imaris");
  EXPECT_EQ(info.times.count, 2);
  EXPECT_EQ((*source)->At(0, 1), nullptr) << "each time has datasets of its own";
  EXPECT_EQ((*source)->At(1, 0), nullptr);
  EXPECT_THAT(info.channels, ElementsAre(FieldInfo{.name = "DAPI"}, FieldInfo{.name = "GFP", .window = ValueRange{100, 4000}}));
  ASSERT_EQ(info.levels.size(), 2U);
  const VolumeGeometry& fine = info.levels[0].description.geometry;
  const VolumeGeometry& coarse = info.levels[1].description.geometry;
  EXPECT_EQ(fine.size, (Index3{10, 6, 4}));
  EXPECT_EQ(coarse.size, (Index3{5, 3, 4}));
  EXPECT_EQ(fine.spacing, (Vec3{0.5, 0.5, 2}));
  EXPECT_EQ(coarse.spacing, (Vec3{1, 1, 2}));
  EXPECT_EQ(fine.orientation.unit, LengthUnit::kMicrometre);
  EXPECT_EQ(fine.orientation.origin, (Vec3{-4.75, 0.25, 11}));
  EXPECT_EQ(coarse.orientation.origin, (Vec3{-4.5, 0.5, 11}));
  const std::vector<std::uint16_t> samples = SamplesOf<std::uint16_t>(**source).value(),
                                   of_coarse = SamplesOf<std::uint16_t>(**source, 1).value();
  EXPECT_EQ(samples[0], 6000);
  EXPECT_EQ(samples[9 + 10 * (5 + 6 * 3)], 6000 + 300 + 50 + 9);
  EXPECT_EQ(of_coarse[4 + 5 * (2 + 3 * 3)], 16000 + 300 + 20 + 4);
  EXPECT_THAT(samples, testing::Each(testing::Lt(10000)));
}

TEST_F(Hdf5LayoutsTest, ImarisFilesSayHowChannelsAreShownAndWhenTimesAre) {
  const std::string path = WriteImaris(directory_ / "cells.ims");
  using Attributes = std::vector<std::pair<const char*, const char*>>;
  const auto info = [&](const Attributes& of_channel, const Attributes& of_times) {
    const std::string other = directory_ / "other.ims";
    std::filesystem::copy_file(path, other, std::filesystem::copy_options::overwrite_existing);
    const hid_t file = H5Fopen(other.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Gclose(H5Gcreate2(file, "/DataSetInfo/TimeInfo", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    const auto write = [&](const char* object, const Attributes& attributes) {
      for (const auto& [name, text] : attributes) {
        const hsize_t size = std::string_view(text).size();
        const hid_t space = H5Screate_simple(1, &size, nullptr);
        const hid_t attribute = H5Acreate_by_name(file, object, name, H5T_C_S1, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        H5Awrite(attribute, H5T_C_S1, text);
        H5Aclose(attribute);
        H5Sclose(space);
      }
    };
    write("/DataSetInfo/Channel 0", of_channel);
    write("/DataSetInfo/TimeInfo", of_times);
    H5Fclose(file);
    return Opened(Open(other, {.time = TimeRange{}}))->info();
  };
  const FieldInfo plain{.name = "DAPI"};
  const SourceInfo read = info({{"Color", "0.000 0.500 1.000"}, {"ColorMode", "BaseColor"}, {"ColorRange", "0.000 255.000"}},
                               {{"TimePoint1", "2008-02-29 23:59:50.250"}, {"TimePoint2", "2008-03-01 00:00:20.250"}});
  EXPECT_EQ(read.channels[0], (FieldInfo{.name = "DAPI", .color = std::array{0.0F, 0.5F, 1.0F}, .window = ValueRange{0, 255}}));
  EXPECT_EQ(read.times, (TimeAxis{2, 30, "s"}));
  EXPECT_EQ(info({{"Color", "1 0 0"}, {"ColorMode", "TableColor"}}, {}).channels[0], plain);
  for (const Attributes& damaged :
       {Attributes{{"Color", "1 0"}, {"ColorRange", "9 3"}}, Attributes{{"Color", "1 0 red"}, {"ColorRange", "nan 3"}},
        Attributes{{"Color", "2 0 0"}, {"ColorRange", "1"}}, Attributes{{"Color", " "}, {"ColorRange", "1 2 3"}}}) {
    EXPECT_EQ(info(damaged, {}).channels[0], plain);
  }
  for (const char* stamp : {"2008-02-29 23:59:50.250", "2007-02-29 00:00:00", "2008-13-01 00:00:00", "2008-03-01 24:00:00", "2008-03-01",
                            "2008-03-01 00:00:xx", "20080301T0000000000", "9999999999999999999"}) {
    EXPECT_EQ(info({}, {{"TimePoint1", "2008-02-29 23:59:50.250"}, {"TimePoint2", stamp}}).times, (TimeAxis{2})) << stamp;
  }
}

TEST_F(Hdf5LayoutsTest, ImarisFilesShowTheFirstChannelAndAskForATime) {
  const std::string path = WriteImaris(directory_ / "cells.ims");
  const auto first = Open(path, {.time = TimeRange{0, 0}}), named = Open(path, {.time = TimeRange{0, 0}, .channel = 0});
  ASSERT_TRUE(first.ok()) << first.status().message();
  EXPECT_EQ((*first)->info().channel, 0);
  EXPECT_EQ(SamplesOf<std::uint16_t>(**first).value(), SamplesOf<std::uint16_t>(**named).value());
  ExpectRefused(path, {.channel = 0}, "cells.ims: holds 2 volumes, of which --time takes one: 0 to 1");
  ExpectRefused(path, {.time = TimeRange{2, 2}, .channel = 0}, "time is 2, must be in [0, 1]");
  ExpectRefused(path, {.time = TimeRange{0, 0}, .channel = 2}, "cells.ims: has 2 channels, so channel must be 0 to 1 (0: DAPI, 1: GFP)");
  ExpectRefused(path, {.spacing = Vec3{1, 1, 1}}, "spacing is no option of HDF5");
}

TEST_F(Hdf5LayoutsTest, BigDataViewerFilesHaveSetupsAndUnsignedSamples) {
  const std::string path = directory_ / "embryo.h5";
  {
    Hdf5Writer writer(path);
    const std::vector<double> factors = {1, 1, 1, 2, 2, 1};
    for (const int setup : {0, 1}) {
      const std::string name = "/s0" + std::to_string(setup);
      writer.Write(name + "/resolutions", {.size = {2, 3}, .type = SampleType::kFloat64}, factors.data());
      for (const int level : {0, 1}) {
        std::vector<std::uint16_t> samples = Counted(level == 0 ? 4 * 6 * 8 : 4 * 3 * 4, 40000 / 192);
        for (std::uint16_t& sample : samples) sample = std::uint16_t(sample + 20000 * setup);
        const std::vector<hsize_t> size = level == 0 ? std::vector<hsize_t>{4, 6, 8} : std::vector<hsize_t>{4, 3, 4};
        writer.Write("/t00000/s0" + std::to_string(setup) + "/" + std::to_string(level) + "/cells",
                     {.size = size, .chunk = {2, 2, 2}, .type = SampleType::kInt16, .filters = {.deflate = true}}, samples.data());
      }
    }
  }
  ASSERT_TRUE(WriteTextFile(directory_ / "embryo.xml", R"(<?xml version="1.0" encoding="UTF-8"?>
<SpimData version="0.2"><SequenceDescription>
  <ViewSetups>
    <ViewSetup><id>0</id><name>first</name><size>8 6 4</size><voxelSize><unit>pixel</unit><size>1 1 1</size></voxelSize></ViewSetup>
    <ViewSetup><id>1</id><name>green</name><size>8 6 4</size><voxelSize><unit>micrometer</unit><size>0.25 0.25 1.5</size></voxelSize>
      <attributes><channel>1</channel></attributes></ViewSetup>
  </ViewSetups></SequenceDescription></SpimData>)")
                  .ok());
  ExpectRefused(path, {.channel = 2}, "has 2 channels, so channel must be 0 to 1 (0: first, 1: green)");
  EXPECT_EQ((*Open(path))->info().channel, 0);
  const auto source = Open(path, {.channel = 1});
  ASSERT_TRUE(source.ok()) << source.status().message();
  const SourceInfo& info = (*source)->info();
  EXPECT_EQ(info.format, "BigDataViewer HDF5");
  ASSERT_EQ(info.levels.size(), 2U);
  EXPECT_EQ(info.levels[0].description.type, ScalarType::kUint16);
  EXPECT_EQ(info.levels[0].description.mapping, ValueMapping());
  EXPECT_EQ(info.levels[0].description.geometry.spacing, (Vec3{0.25, 0.25, 1.5}));
  EXPECT_EQ(info.levels[1].description.geometry.spacing, (Vec3{0.5, 0.5, 1.5}));
  EXPECT_EQ(info.levels[1].description.geometry.orientation.origin, (Vec3{0.125, 0.125, 0}));
  EXPECT_EQ(info.levels[0].description.geometry.orientation.unit, LengthUnit::kMicrometre);
  EXPECT_EQ(info.files.size(), 2U) << "the XML file belongs to it";
  const std::vector<std::uint16_t> samples = SamplesOf<std::uint16_t>(**source).value();
  EXPECT_EQ(samples[1], 20000 + 208);
  EXPECT_EQ(samples.back(), 20000 + 191 * 208) << "above 32767";

  const auto channels = [&](const std::string& settings) {
    CHECK(WriteTextFile(directory_ / "embryo.settings.xml", settings).ok());
    const auto with_settings = Opened(Open(path));
    EXPECT_EQ(with_settings->info().files.size(), 3U);
    return with_settings->info().channels;
  };
  const FieldInfo first{.name = "first"}, green{.name = "green"};
  EXPECT_THAT(info.channels, ElementsAre(first, green));
  EXPECT_THAT(channels(R"(<Settings><ViewerState><Sources><Source><active>false</active></Source><Source><active>true</active></Source>
        <Source><active>false</active></Source></Sources></ViewerState><SetupAssignments><ConverterSetups>
        <ConverterSetup><id>1</id><min>10.0</min><max>4000.5</max><color>-16711936</color><groupId>0</groupId></ConverterSetup>
        <ConverterSetup><id>7</id><min>1</min><max>2</max><color>-1</color></ConverterSetup>
        </ConverterSetups>
        <MinMaxGroups><MinMaxGroup><id>0</id><currentMin>3</currentMin></MinMaxGroup></MinMaxGroups></SetupAssignments></Settings>)"),
              ElementsAre(FieldInfo{.name = "first", .shown = false},
                          FieldInfo{.name = "green", .color = std::array{0.0F, 1.0F, 0.0F}, .window = ValueRange{10, 4000.5F}}));
  EXPECT_THAT(channels("<S><ConverterSetup><id>0</id><min>9</min><max>3</max><color>red</color></ConverterSetup>"
                       "<ConverterSetup><min>1</min><max>3</max></ConverterSetup><ConverterSetup/></S>"),
              ElementsAre(first, green));
  EXPECT_THAT(channels("<S><ConverterSetup><id>0</id><min>1</min><max>3</max></ConverterSetup><oops></S>"), ElementsAre(first, green))
      << "damaged settings say nothing";

  ASSERT_TRUE(WriteTextFile(directory_ / "embryo.xml", "<SpimData><oops></SpimData>").ok());
  ExpectRefused(path, {.channel = 1}, "embryo.xml: ");
  std::filesystem::remove(directory_ / "embryo.xml");
  const auto plain = Open(path, {.channel = 1});
  ASSERT_TRUE(plain.ok()) << plain.status().message();
  EXPECT_EQ((*plain)->info().levels[0].description.geometry.spacing, (Vec3{1, 1, 1}));
}

TEST_F(Hdf5LayoutsTest, BigDataViewerSetupsSayWhatTheirSamplesAre) {
  const std::string path = directory_ / "typed.h5";
  const auto write = [&](const std::string& said, SampleType stored, const void* samples) {
    Hdf5Writer writer(path);
    const std::vector<double> factors = {1, 1, 1};
    writer.Write("/s01/resolutions", {.size = {1, 3}, .type = SampleType::kFloat64}, factors.data());
    if (!said.empty()) writer.Text("/s01", "dataType", said);
    writer.Write("/t00003/s01/0/cells", {.size = {2, 2, 2}, .type = stored}, samples);
  };
  const std::vector<std::int16_t> samples = {-100, 5, 0, 1, 2, 3, 4, -1};
  const auto first = [&] {
    const auto source = Opened(Open(path));
    return source->info().levels[0].description.mapping.FromStored(SamplesOf<std::uint16_t>(*source).value()[0]);
  };
  write("int16", SampleType::kInt16, samples.data());
  EXPECT_EQ(first(), -100);
  write("uint16", SampleType::kInt16, samples.data());
  EXPECT_EQ(first(), 65436);
  write("", SampleType::kInt16, samples.data());
  EXPECT_EQ(first(), 65436);
  EXPECT_THAT(Opened(Open(path))->info().notes, testing::Contains("samples of int16 are taken for uint16"));
  const std::vector<std::int32_t> wide(8, -1);
  write("uint32", SampleType::kInt32, wide.data());
  EXPECT_EQ(Opened(Open(path))->info().file_type, "uint32");
  write("float32", SampleType::kInt32, wide.data());
  ExpectRefused(path, {}, "typed.h5: setup s01 has the dataType 'float32', but holds int32");
}

TEST_F(Hdf5LayoutsTest, BigDataViewerTimesAreCountedFromTheFirstOneThatIsThere) {
  const std::string path = directory_ / "late.h5";
  {
    Hdf5Writer writer(path);
    const std::vector<double> factors = {1, 1, 1};
    writer.Write("/s00/resolutions", {.size = {1, 3}, .type = SampleType::kFloat64}, factors.data());
    for (const int time : {1, 4}) {
      const std::vector<std::uint16_t> samples(8, std::uint16_t(time));
      writer.Write("/t0000" + std::to_string(time) + "/s00/0/cells", {.size = {2, 2, 2}, .type = SampleType::kInt16}, samples.data());
    }
    writer.Group("/t00005");
  }
  const auto source = Opened(Open(path, {.time = TimeRange{1, 1}}));
  EXPECT_EQ(source->info().times.count, 3);
  EXPECT_EQ(source->info().time, 1);
  EXPECT_EQ(SamplesOf<std::uint16_t>(*source).value()[0], 4);
  EXPECT_THAT(source->info().notes, testing::Contains("time 1 is t00004 of the file"));
  EXPECT_EQ(Opened(Open(path, {.describe = true}))->info().times.count, 3);
  ExpectRefused(path, {.time = TimeRange{2, 2}}, "setup s00 has no samples of level 0 at time 2");
}

TEST_F(Hdf5LayoutsTest, ImarisLevelsOfAnotherTypeAreLeftOut) {
  const std::string path = WriteImaris(directory_ / "cells.ims");
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const std::string data = "/DataSet/ResolutionLevel 1/TimePoint 0/Channel 0/Data";
  H5Ldelete(file, data.c_str(), H5P_DEFAULT);
  const hsize_t size[3] = {4, 8, 8};
  const hid_t space = H5Screate_simple(3, size, nullptr);
  H5Dclose(H5Dcreate2(file, data.c_str(), H5T_STD_U8LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Sclose(space);
  H5Fclose(file);
  EXPECT_EQ(Opened(Open(path, {.time = TimeRange{0, 0}}))->info().levels.size(), 1U);
  EXPECT_EQ(Opened(Open(path, {.time = TimeRange{1, 1}}))->info().levels.size(), 2U);
}

TEST_F(Hdf5LayoutsTest, TheOnlyVolumeOfAFileIsTaken) {
  const std::string path = directory_ / "scan.h5";
  const std::vector<std::uint16_t> samples = Counted(3 * 4 * 5);
  {
    Hdf5Writer writer(path);
    writer.Write("/exchange/data", {.size = {3, 4, 5}, .chunk = {2, 2, 2}, .big_endian = true}, samples.data());
    writer.Write("/exchange/theta", {.size = {3}}, samples.data());
    writer.Numbers("/exchange/data", "element_size_um", {3, 0.5, 0.25});
    H5Lcreate_soft("/exchange/data", writer.file(), "/shortcut", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_hard(writer.file(), "/exchange", writer.file(), "/exchange/itself", H5P_DEFAULT, H5P_DEFAULT);
  }
  for (const char* dataset : {"", "/exchange/data", "exchange/data", "/shortcut", "/exchange/itself/itself/data"}) {
    const auto source = Open(path, {.dataset = dataset});
    ASSERT_TRUE(source.ok()) << source.status().message();
    EXPECT_EQ((*source)->info().format, "HDF5");
    EXPECT_EQ((*source)->info().levels[0].description.geometry.spacing, (Vec3{0.25, 0.5, 3}));
    EXPECT_EQ((*source)->info().levels[0].description.geometry.orientation.unit, LengthUnit::kMicrometre);
    EXPECT_EQ(SamplesOf<std::uint16_t>(**source).value(), samples);
  }
  ExpectRefused(path, {.dataset = "/nothing"}, "scan.h5: dataset '/nothing' cannot be opened");
  ExpectRefused(path, {.dataset = "/exchange"}, "dataset '/exchange' cannot be opened");
  ExpectRefused(path, {.dataset = "/exchange/theta"}, "dataset '/exchange/theta': has 1 axis, must have 2 or more");
  ExpectRefused(path, {.dataset = "/a\nb"}, "cannot be opened");
}

TEST_F(Hdf5LayoutsTest, SeveralVolumesAreListed) {
  const std::string path = directory_ / "several.h5";
  const std::vector<std::uint16_t> samples = Counted(3 * 4 * 5);
  {
    Hdf5Writer writer(path);
    writer.Write("/b", {.size = {3, 4, 5}}, samples.data());
    writer.Write("/a/c", {.size = {5, 4, 3}}, samples.data());
  }
  ExpectRefused(path, {}, "several.h5: has 2 datasets, of which --dataset takes one: '/a/c' of 5 x 4 x 3 uint16, '/b' of 3 x 4 x 5 uint16");
  {
    Hdf5Writer writer(path);
    for (int i = 0; i < 500; ++i) writer.Write("/" + std::string(200, 'n') + std::to_string(i), {.size = {3, 4, 5}}, samples.data());
  }
  const Status many = Open(path).status();
  EXPECT_THAT(many.message(), HasSubstr("more"));
  EXPECT_LT(many.message().size(), 2000U);
  Hdf5Writer(path).Write("/line", {.size = {60}}, samples.data());
  ExpectRefused(path, {}, "several.h5: has no dataset of two axes or more");
}

TEST_F(Hdf5LayoutsTest, AnAxisBeforeTheLastThreeIsTime) {
  const std::string path = directory_ / "times.h5";
  const std::vector<std::uint16_t> samples = Counted(2 * 3 * 4 * 5);
  Hdf5Writer(path).Write("/data", {.size = {2, 1, 3, 4, 5}, .chunk = {1, 1, 3, 4, 5}}, samples.data());
  ExpectRefused(path, {}, "holds 2 volumes, of which --time takes one: 0 to 1");
  const auto source = Open(path, {.time = TimeRange{1, 1}});
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_EQ((*source)->info().times.count, 2);
  EXPECT_EQ(SamplesOf<std::uint16_t>(**source).value()[0], 60);
  EXPECT_EQ((*Open(path, {.describe = true}))->info().times.count, 2);
  Hdf5Writer(path).Write("/data", {.size = {2, 2, 3, 5, 2}}, samples.data());
  const auto both = Open(path, {.time = TimeRange{1, 1}, .channel = 1});
  ASSERT_TRUE(both.ok()) << both.status().message();
  EXPECT_EQ(SamplesOf<std::uint16_t>(**both).value()[0], 90);
  EXPECT_THAT((*both)->info().notes, testing::Contains("axes of the dataset: time, channel, z, y, x (by their order)"));
  Hdf5Writer(path).Write("/data", {.size = {2, 2, 2, 3, 5, 1}}, samples.data());
  ExpectRefused(path, {}, "axis 2 has 2 indices and is none of x, y, z, time and channel, so it must have 1");
}

TEST_F(Hdf5LayoutsTest, OtherFilesAreNotOpened) {
  ExpectRefused(external_link.path, {.dataset = "/group/linked"},
                "'/group/linked' lies in another file: '/group/linked' is an external link");
  ExpectRefused(external_link.path, {}, "has no dataset of two axes");

  const std::string path = directory_ / "outward.h5";
  const hsize_t size[3] = {2, 2, 2};
  {
    Hdf5Writer writer(path);
    const hid_t space = H5Screate_simple(3, size, nullptr), elsewhere = H5Pcreate(H5P_DATASET_CREATE),
                made_of = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(elsewhere, (directory_ / "samples.raw").c_str(), 0, 8);
    H5Dclose(H5Dcreate2(writer.file(), "/external", H5T_NATIVE_UINT8, space, H5P_DEFAULT, elsewhere, H5P_DEFAULT));
    H5Pset_virtual(made_of, space, (directory_ / "other.h5").c_str(), "/there", space);
    H5Dclose(H5Dcreate2(writer.file(), "/virtual", H5T_NATIVE_UINT8, space, H5P_DEFAULT, made_of, H5P_DEFAULT));
    H5Pclose(elsewhere);
    H5Pclose(made_of);
    H5Sclose(space);
  }
  ExpectRefused(path, {.dataset = "/external"},
                "dataset '/external' keeps its samples in other files (external storage), which are not read");
  ExpectRefused(path, {.dataset = "/virtual"}, "dataset '/virtual' is a virtual dataset, made of parts of others, which is not supported");
}

TEST_F(Hdf5LayoutsTest, TypesThatAreNotSupportedAreNamed) {
  const std::string path = directory_ / "types.h5";
  const hsize_t size[3] = {2, 2, 2};
  {
    Hdf5Writer writer(path);
    const hid_t space = H5Screate_simple(3, size, nullptr);
    const hid_t compound = H5Tcreate(H5T_COMPOUND, 8), narrow = H5Tcopy(H5T_NATIVE_UINT16), half = H5Tcopy(H5T_IEEE_F32LE);
    H5Tinsert(compound, "r", 0, H5T_NATIVE_FLOAT);
    H5Tset_precision(narrow, 12);
    H5Tset_fields(half, 15, 10, 5, 0, 10);
    H5Tset_precision(half, 16);
    H5Tset_size(half, 2);
    for (const auto& [name, type] : {std::pair("/compound", compound), std::pair("/narrow", narrow), std::pair("/half", half)}) {
      H5Dclose(H5Dcreate2(writer.file(), name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
      H5Tclose(type);
    }
    H5Sclose(space);
  }
  ExpectRefused(path, {.dataset = "/compound"}, "dataset '/compound' holds compounds (members r) of 64 bits; supported: integers");
  ExpectRefused(path, {.dataset = "/narrow"}, "dataset '/narrow' holds integers of 16 bits, of which 12 are used; supported");
  ExpectRefused(path, {.dataset = "/half"}, "dataset '/half' holds floats of 16 bits; supported");
}

TEST_F(Hdf5LayoutsTest, FilesThatAreNoneAreRefused) {
  ASSERT_TRUE(WriteTextFile(directory_ / "text.h5", "no HDF5").ok());
  ExpectRefused(directory_ / "text.h5", {}, "text.h5: not an HDF5 file, or damaged");
  const std::string path = directory_ / "cut.h5";
  const std::vector<std::uint16_t> samples = Counted(60000);
  Hdf5Writer(path).Write("/data", {.size = {30, 40, 50}}, samples.data());
  std::filesystem::resize_file(path, 10000);
  ExpectRefused(path, {}, "cut.h5: not an HDF5 file, or damaged: truncated file");
  EXPECT_EQ(Open(directory_ / "none.h5").status().code(), StatusCode::kNotFound);
  // By its first bytes, whatever its name.
  Hdf5Writer(directory_ / "volume.dat").Write("/data", {.size = {30, 40, 50}}, samples.data());
  EXPECT_TRUE(Open(directory_ / "volume.dat").ok());
}

}  // namespace
}  // namespace slabstream
