// `convert`, and options for reading on the command line.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/json/json.h"
#include "tests/end_to_end/program.h"
#include "tests/support/full_disk.h"

namespace slabstream {
namespace {

class ConvertTest : public EndToEndTest {
 protected:
  Json Info(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "info");
    arguments.emplace_back("--json");
    return Json::Parse(MustRun(arguments).out).value();
  }
  std::string Read(const std::string& name) {
    std::ostringstream bytes;
    bytes << std::ifstream(Path(name), std::ios::binary).rdbuf();
    return bytes.str();
  }
  void Write(const std::string& name, const std::string& bytes) { std::ofstream(Path(name), std::ios::binary) << bytes; }
  // Exit status 2 and one line that says why.
  void ExpectRefused(const std::vector<std::string>& arguments, const std::string& why) {
    const ProgramResult result = Slabstream(arguments);
    EXPECT_EQ(result.exit_status, 2) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_THAT(result.err, HasSubstr(why));
  }
};

TEST_F(ConvertTest, WritesEveryFormatAndTellsSo) {
  MakeSphere("s.nrrd", 1, 20);
  const Json before = Info({"s.nrrd"});
  std::string from = "s.nrrd";
  for (const std::string to : {"a.nii", "b.nii.gz", "c.mha", "d.mhd", "e.npy", "f.vti", "g.nrrd"}) {
    const ProgramResult result = MustRun({"convert", from, to, "--progress"});
    EXPECT_THAT(result.out, HasSubstr("wrote " + to));
    EXPECT_THAT(result.err, AllOf(HasSubstr("reading " + from), HasSubstr("writing " + to + ": 100 %")));
    const Json info = Info({to});
    for (const char* field : {"size", "type", "spacing", "range", "histogram"}) EXPECT_EQ(info[field], before[field]) << to;
    from = to;
  }
}

TEST_F(ConvertTest, WritesAnOmeZarrWithLevels) {
  MakeSphere("s.nrrd", 1, 100);
  const ProgramResult result = MustRun({"convert", "s.nrrd", "a.ome.zarr", "--memory", "256M", "--progress"});
  EXPECT_EQ(result.out, "wrote a.ome.zarr: OME-Zarr 0.5, 100 x 100 x 100 voxels\n");
  EXPECT_THAT(result.err, HasSubstr("writing a.ome.zarr: 100 % of 2 MiB"));
  EXPECT_TRUE(std::filesystem::exists(Path("a.ome.zarr/1/c/0/0/0")));
  // The source is read in parts; the voxels are the same.
  MustRun({"convert", "a.ome.zarr", "b.ome.zarr/", "--zarr-version", "0.4"});
  EXPECT_TRUE(std::filesystem::exists(Path("b.ome.zarr/0/1/1/1")));
  MustRun({"convert", "b.ome.zarr", "c.ome.zarr"});
  MustRun({"convert", "a.ome.zarr", "d.ome.zarr"});
  for (const std::string shard : {"/0/c/0/0/0", "/1/c/0/0/0"}) EXPECT_EQ(Read("c.ome.zarr" + shard), Read("d.ome.zarr" + shard));
  ExpectRefused({"convert", "s.nrrd", "a.ome.zarr"}, "OUTPUT 'a.ome.zarr' exists: remove it, or name another folder");
  ExpectRefused({"convert", "s.nrrd", "x.ome.zarr", "--type", "int8"}, "--type: an OME-Zarr keeps the type of SOURCE");
  ExpectRefused({"convert", "s.nrrd", "x.ome.zarr", "--zarr-version", "0.3"}, "--zarr-version: expected 0.4 or 0.5, not '0.3'");
  EXPECT_FALSE(std::filesystem::exists(Path("x.ome.zarr")));
}

TEST_F(ConvertTest, AFullDiskIsToldAndTheConversionGoesOnWhenThereIsRoom) {
  MakeSphere("s.nrrd", 1, 130);
  const ProgramResult full = OnFullDisk(5000, [&] { return Slabstream({"convert", "s.nrrd", "a.ome.zarr"}); });
  EXPECT_EQ(full.exit_status, 1);
  ASSERT_EQ(full.err_lines().size(), 1U) << full.err;
  EXPECT_THAT(full.err, AllOf(HasSubstr("a.ome.zarr"), HasSubstr("File too large")));
  EXPECT_NE(Slabstream({"info", "a.ome.zarr"}).exit_status, 0) << "it is no image yet";
  MustRun({"convert", "s.nrrd", "a.ome.zarr"});
  MustRun({"convert", "s.nrrd", "b.ome.zarr"});
  for (const std::string shard : {"/0/c/0/0/0", "/1/c/0/0/0"}) EXPECT_EQ(Read("a.ome.zarr" + shard), Read("b.ome.zarr" + shard));
}

TEST_F(ConvertTest, RawSamplesAreDescribedByOptionsInEitherForm) {
  Write("v.raw", "head" + std::string({0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 1, 0}));
  const std::vector<std::string> options = {"--dims", "3,2,1",    "--type", "uint16",    "--endian",
                                            "big",    "--offset", "4",      "--spacing", "0.5,1,2"};
  std::vector<std::string> apart = {"v.raw"};
  apart.insert(apart.end(), options.begin(), options.end());
  const Json info = Info(apart);
  EXPECT_EQ(info["size"], (Json{3, 2, 1}));
  EXPECT_EQ(info["spacing"], (Json{0.5, 1.0, 2.0}));
  EXPECT_EQ(info["range"]["max"], 256.0);
  EXPECT_EQ(Info({"v.raw?dims=3,2,1,type=uint16,endian=big,offset=4,spacing=0.5,1,2"}), info);
  // --type of convert is that of raw samples too, unless they have their own.
  std::vector<std::string> convert = {"convert", "v.raw", "a.nrrd"};
  convert.insert(convert.end(), options.begin(), options.end());
  MustRun(convert);
  EXPECT_EQ(Info({"a.nrrd"})["file_type"], "uint16");
  MustRun({"convert", "v.raw?dims=3,2,1,type=uint16,endian=big,offset=4", "b.nrrd", "--type", "int32"});
  EXPECT_EQ(Info({"b.nrrd"})["file_type"], "int32");
  EXPECT_EQ(Info({"b.nrrd"})["range"], info["range"]);
}

TEST_F(ConvertTest, SamplesStayOfTheirTypeIfThatHoldsTheirValues) {
  const std::string header = "NRRD0004\ndimension: 3\nsizes: 2 1 1\nencoding: raw\ntype: ";
  Write("i.nrrd", header + "int32\n\n" + std::string({1, 0, 0, 0, 2, 0, 0, 0}));
  Write("d.nrrd", header + "double\n\n" + std::string(16, '\0'));
  for (const auto& [file, type] : {std::pair{"i", "int32"}, {"d", "float64"}}) {
    MustRun({"convert", file + std::string(".nrrd"), "v.nii"});
    EXPECT_EQ(Info({"v.nii"})["file_type"], type);
  }
}

// Labels of a file that is read as a whole, of one that is read in parts, and of a store.
TEST_F(ConvertTest, LabelsOf64BitsAreExactInFilesValuesAndStores) {
  const std::vector<std::uint64_t> ids = {0, 12857642016, 12857642017, 13046505472, std::uint64_t{1} << 63 | 1};
  const std::string samples(reinterpret_cast<const char*>(ids.data()), ids.size() * sizeof ids[0]);
  Write("ids.nrrd", "NRRD0004\ntype: uint64\ndimension: 3\nsizes: 5 1 1\nencoding: raw\nendian: little\n\n" + samples);
  const auto values = [&](const std::string& source) {
    std::vector<std::string> arguments = {"value", source, "--local", "--json"};
    for (std::size_t x = 0; x < ids.size(); ++x) arguments.insert(arguments.end(), {"--at", std::to_string(x) + ",0,0"});
    std::vector<std::uint64_t> found;
    const Json told = Json::Parse(MustRun(arguments).out).value();
    for (const Json& sample : told) {
      EXPECT_TRUE(sample["value"].is_number_unsigned()) << sample;
      found.push_back(sample["value"].get<std::uint64_t>());
    }
    return found;
  };
  std::string from = "ids.nrrd";
  for (const std::string to : {"a.nii.gz", "b.ome.zarr", "c.nrrd", "d.mha", "e.zarr", "f.npy"}) {
    EXPECT_EQ(MustRun({"convert", from, to}).err, "");
    EXPECT_EQ(values(to), ids) << to;
    from = to;
  }
  EXPECT_THAT(Read("f.npy"), testing::EndsWith(samples));
  const std::string at_last = "4,0,0";
  EXPECT_THAT(MustRun({"value", "f.npy", "--local", "--at", at_last}).out, HasSubstr("value 9223372036854775809"));
  EXPECT_THAT(MustRun({"convert", "f.npy", "g.nrrd", "--type", "float32"}).err, HasSubstr("--type float32 rounds values of type uint64"));
  EXPECT_THAT(MustRun({"info", "f.npy"}).err, HasSubstr("values from 0 to 9223372036854775809 are rounded to float32 for pictures"));
}

TEST_F(ConvertTest, WarnsOfWhatIsNotKept) {
  Write("v.nrrd",
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 1 1\nencoding: raw\nspace: RAS\nspace directions: (0.5,0,0) (0,1,0) (0,0,2)\n\nab");
  EXPECT_THAT(MustRun({"convert", "v.nrrd", "v.npy"}).err,
              HasSubstr("v.npy: NumPy files do not keep the spacing 0.5,1,2, nor the origin and the directions of the axes"));
  EXPECT_EQ(MustRun({"convert", "v.nrrd", "v.mha"}).err, "");
}

TEST_F(ConvertTest, NeverOverwritesItsInput) {
  MakeSphere("s.mhd", 1, 20);
  const std::string header = ReadFile("s.mhd"), samples = ReadFile("s.raw");
  std::filesystem::create_symlink(Path("s.mhd"), Path("link.mhd"));
  std::filesystem::create_hard_link(Path("s.raw"), Path("t.raw"));
  ExpectRefused({"convert", "s.mhd", "s.mhd"}, "OUTPUT 's.mhd': would overwrite the input 's.mhd'");
  ExpectRefused({"convert", "s.mhd", "link.mhd"}, "would overwrite the input");
  ExpectRefused({"convert", "s.raw", "s.mhd", "--dims", "20,20,20", "--type", "uint8"}, "would overwrite the input 's.raw'");
  ExpectRefused({"convert", "s.mhd", "t.mhd"}, "would overwrite the input 's.raw'");
  EXPECT_EQ(ReadFile("s.mhd"), header);
  EXPECT_EQ(ReadFile("s.raw"), samples);
}

TEST_F(ConvertTest, WhatIsWrongIsNamed) {
  MakeSphere("s.nrrd", 1, 20);
  ExpectRefused({"convert", "s.nrrd"}, "OUTPUT");
  ExpectRefused({"convert", "s.nrrd", "s.png"}, "OUTPUT 's.png' must end in one of .nii, .nii.gz, .nrrd");
  ExpectRefused({"convert", "missing.nrrd", "a.mha"}, "SOURCE missing.nrrd: no such file");
  ExpectRefused({"convert", "s.nrrd", "no/a.mha"}, "OUTPUT");
  ExpectRefused({"convert", "s.nrrd", "a.mha", "--type", "int8"}, "does not fit int8, which holds whole numbers from -128 to 127");
  ExpectRefused({"convert", "s.nrrd", "a.mha", "--type", "int12"}, "--type 'int12' must be one of int8");
  ExpectRefused({"convert", "s.nrrd", "a.mha", "--dims", "1,2,3"}, "dims is no option of NRRD");
  ExpectRefused({"convert", "s.nrrd", "a.mha", "--time", "two"}, "--time 'two' must be a whole number");
  ExpectRefused({"convert", "s.nrrd?time=1", "a.mha", "--time", "1"}, "time is given twice");
  ExpectRefused({"info", "s.nrrd", "--time", "1"}, "s.nrrd: time is 1, must be in [0, 0]");
  ExpectRefused({"info", "s.nrrd?tine=1"}, "'tine' is no option for reading a file");
  ExpectRefused({"render", "s", "-o", "s.png", "--spacing", "1,1,1"}, "'s' is a dataset at the service");
  EXPECT_THAT(Files(), testing::ElementsAre("s.nrrd"));
}

}  // namespace
}  // namespace slabstream
