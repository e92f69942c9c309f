// Files of one time each as one source.
#include "data/open/file_times.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>

#include "data/catalogue/catalogue.h"
#include "data/open/read_volume.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class FileTimesTest : public testing::Test {
 protected:
  // A volume of one value.
  void Write(const std::string& name, int value) const {
    WriteFile(directory_ / name, NrrdHeader({.size = {5, 4, 3}}, "raw") + FileBytes(60, char(value)));
  }
  std::string pattern(const std::string& options = "") const { return directory_ / "cell_*.nrrd" + options; }
  static Result<ReadableSource> Read(const std::string& source) { return ReadSource(DataSource(source, ""), 1U << 30); }
  static int ValueOf(const Result<ReadableSource>& read) {
    EXPECT_TRUE(read.ok()) << read.status().message();
    return int(std::get<LoadedSource>(*read).volume->block.samples<std::uint8_t>()[0]);
  }
  static TimeAxis TimesOf(const Result<ReadableSource>& read) { return std::get<LoadedSource>(*read).file.times; }
  const TemporaryDirectory directory_;
};

TEST_F(FileTimesTest, EachFileIsATimeInNaturalOrder) {
  for (const int number : {10, 2, 1, 33}) Write("cell_" + std::to_string(number) + ".nrrd", number);
  Write("other_3.nrrd", 3);
  Write(".cell_4.nrrd", 4);
  const Result<ReadableSource> first = Read(pattern());
  EXPECT_EQ(ValueOf(first), 1);
  EXPECT_EQ(TimesOf(first).count, 4);
  EXPECT_EQ(std::get<LoadedSource>(*first).other_times.size(), 3U) << "statistics are those of all times";
  const std::array<int, 4> values = {1, 2, 10, 33};
  for (std::size_t time = 0; time < values.size(); ++time) {
    EXPECT_EQ(ValueOf(Read(pattern("?time=" + std::to_string(time)))), values.at(time));
  }
}

TEST_F(FileTimesTest, AFileThatComesIsSeen) {
  Write("cell_1.nrrd", 1);
  const Result<ReadableSource> one = Read(pattern());
  ASSERT_TRUE(one.ok());
  const FileStamp& stamp = *std::get<LoadedSource>(*one).stamp;
  EXPECT_EQ(HaveChanged(stamp).value(), false);
  Write("cell_2.nrrd", 2);
  EXPECT_EQ(HaveChanged(stamp).value(), true);
  EXPECT_EQ(TimesOf(Read(pattern())).count, 2);
}

// Another time is not read anew when one more comes.
TEST_F(FileTimesTest, ATimeThatIsNamedIsItsFileAlone) {
  for (const int number : {1, 2}) Write("cell_" + std::to_string(number) + ".nrrd", number);
  const Result<ReadableSource> second = Read(pattern("?time=1"));
  ASSERT_TRUE(second.ok());
  Write("cell_3.nrrd", 3);
  EXPECT_EQ(HaveChanged(*std::get<LoadedSource>(*second).stamp).value(), false);
}

TEST_F(FileTimesTest, TheNewestFileDoesNotCountWhileItIsWritten) {
  for (const int number : {1, 2}) Write("cell_" + std::to_string(number) + ".nrrd", number);
  WriteFile(directory_ / "cell_3.nrrd", NrrdHeader({.size = {5, 4, 3}}, "raw") + FileBytes(20, 'x'));
  EXPECT_EQ(TimesOf(Read(pattern())).count, 2);
  Write("cell_3.nrrd", 3);
  EXPECT_EQ(TimesOf(Read(pattern())).count, 3);
}

TEST_F(FileTimesTest, WhatIsWrongIsSaidInOneLine) {
  EXPECT_THAT(Read(pattern()).status().message(), HasSubstr("cell_*.nrrd: no file has such a name"));
  EXPECT_THAT(FindData({"cells=" + pattern()}).errors.size() + FindData({"cells=/no/where_*.tif"}).errors.size(), 0U) << "it opens nothing";
  for (const int number : {1, 2}) Write("cell_" + std::to_string(number) + ".nrrd", number);
  EXPECT_THAT(Read(pattern("?time=2")).status().message(), HasSubstr("time is 2, must be in [0, 1]: a file each"));
  EXPECT_THAT(ReadVolume(pattern(), {}).status().message(), HasSubstr("holds 2 volumes, a file each, of which --time takes one: 0 to 1"));
  EXPECT_THAT(Read(directory_ / "no/cell_*.nrrd").status().message(), HasSubstr("No such file or directory"));
  const FileSpec times{.dimensions = {5, 4, 3, 2}};
  WriteFile(directory_ / "t_1.nii", NiftiHeader(times) + FileBytes(120, 'x'));
  EXPECT_THAT(Read(directory_ / "t_*.nii").status().message(), HasSubstr("holds 2 times itself"));
}

// As ParaView and VTK's writers make them: in any order, with times of the simulation.
TEST_F(FileTimesTest, AFileThatNamesFilesOfTimesIsASeries) {
  for (const int number : {1, 2, 3}) Write("run/cell_" + std::to_string(number) + ".nrrd", number);
  WriteFile(directory_ / "run.pvd", R"(<VTKFile type="Collection"><Collection><DataSet timestep="1.5" file="run/cell_3.nrrd"/>
      <DataSet timestep="0.5" part="0" file="run/cell_1.nrrd"/><DataSet timestep="1" file="run/cell_2.nrrd"/></Collection></VTKFile>)");
  WriteFile(directory_ / "run.nrrd.series", R"({"file-series-version": "1.0", "files": [{"name": "run/cell_1.nrrd", "time": 0.5},
      {"name": "run/cell_3.nrrd", "time": 1.5}, {"name": "run/cell_2.nrrd", "time": 1}]})");
  for (const std::string name : {"run.pvd", "run.nrrd.series"}) {
    EXPECT_EQ(TimesOf(Read(directory_ / name)).count, 3);
    EXPECT_EQ(TimesOf(Read(directory_ / name)).step, 0.5);
    for (int time = 0; time < 3; ++time) EXPECT_EQ(ValueOf(Read(directory_ / (name + "?time=" + std::to_string(time)))), time + 1);
  }
}

TEST_F(FileTimesTest, OfASeriesTheListAndTheFileThatShowsAreLookedAt) {
  const auto list = [&](const std::string& files) { WriteFile(directory_ / "a.series", R"({"files": [)" + files + "]}"); };
  const std::string first = R"({"name": "run/0.nrrd", "time": 0})", second = R"({"name": "run/1.nrrd", "time": 1})";
  for (const int number : {0, 1}) Write(fmt::format("run/{}.nrrd", number), number);
  list(first);
  const auto changes = [&](const std::function<void()>& change) {
    const Result<ReadableSource> read = Read(directory_ / "a.series");
    EXPECT_TRUE(read.ok()) << read.status().message();
    const FileStamp& stamp = *std::get<LoadedSource>(*read).stamp;
    EXPECT_EQ(HaveChanged(stamp).value(), false);
    change();
    return HaveChanged(stamp).value();
  };
  EXPECT_TRUE(changes([&] { list(first + "," + second); }));
  EXPECT_TRUE(changes([&] { Write("run/0.nrrd", 7); }));
  EXPECT_EQ(ValueOf(Read(directory_ / "a.series")), 7);
  EXPECT_FALSE(changes([&] { Write("run/1.nrrd", 8); })) << "another time is looked at when it is asked for";
}

TEST_F(FileTimesTest, ASeriesThatIsWrongIsSaidInOneLine) {
  const auto why = [&](const std::string& name, const std::string& text) {
    WriteFile(directory_ / name, text);
    return Read(directory_ / name).status().message();
  };
  const auto collection = [](const std::string& sets) {
    return R"(<VTKFile type="Collection"><Collection>)" + sets + "</Collection></VTKFile>";
  };
  EXPECT_THAT(why("a.pvd", collection("")), HasSubstr("a.pvd: names 0 files, must name 1 to 100000"));
  EXPECT_THAT(why("a.pvd", "<VTKFile type=\"ImageData\"/>"), HasSubstr("a.pvd: not a VTK file of type Collection"));
  EXPECT_THAT(why("a.pvd", collection("<DataSet timestep='x' file='b.nrrd'/>")), HasSubstr("the time of b.nrrd is no number"));
  EXPECT_THAT(why("a.pvd", collection("<DataSet timestep='1'/>")), HasSubstr("has an entry that names no file"));
  EXPECT_THAT(why("a.pvd", collection("<DataSet timestep='1' file='b.nrrd'/><DataSet timestep='1' part='1' file='c.nrrd'/>")),
              HasSubstr("names several files of the time 1"));
  EXPECT_THAT(why("a.pvd", collection("<DataSet timestep='1' file='a.pvd'/>")), HasSubstr("a.pvd, which has several times itself"));
  EXPECT_THAT(why("a.pvd", collection("<DataSet timestep='1' file='a*'/>")), HasSubstr("a*, which has several times itself"));
  EXPECT_THAT(why("a.pvd", collection("<DataSet timestep='1' file='no.nrrd'/>")), HasSubstr("no.nrrd: no such file"));
  EXPECT_THAT(why("a.vti.series", "{}"), HasSubstr("has no list \"files\""));
  EXPECT_THAT(why("a.vti.series", "{"), HasSubstr("a.vti.series: not JSON"));
  EXPECT_THAT(why("a.vti.series", R"({"files": [{"name": "b.nrrd"}]})"), HasSubstr("the time of b.nrrd is no number"));
}

TEST_F(FileTimesTest, AFileWithAStarInItsNameIsAFile) {
  Write("cell_*.nrrd", 7);
  Write("cell_1.nrrd", 1);
  EXPECT_EQ(ValueOf(Read(pattern())), 7);
}

}  // namespace
}  // namespace slabstream
