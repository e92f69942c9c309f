// `sphere` and `info`: what one writes the other tells.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/json/json.h"
#include "tests/end_to_end/program.h"
#include "tests/support/full_disk.h"

namespace slabstream {
namespace {

class VolumeToolsTest : public EndToEndTest {
 protected:
  Json Info(const std::string& name, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"info", name, "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Json::Parse(MustRun(arguments).out).value();
  }
};

TEST_F(VolumeToolsTest, InfoTellsWhatSphereMade) {
  for (const int sphere_class : {1, 2}) {
    MakeSphere("s.nrrd", sphere_class, 40);
    const Json info = Info("s.nrrd", {"--transfer", "opaque"});
    EXPECT_EQ(info["size"], (Json{40, 40, 40}));
    EXPECT_EQ(info["type"], "uint8");
    EXPECT_EQ(info["file_type"], "uint8");
    EXPECT_EQ(info["format"], "NRRD");
    EXPECT_EQ(info["spacing"], (Json{1.0, 1.0, 1.0}));
    EXPECT_EQ(info["range"]["min"], 0.0);
    EXPECT_GT(info["range"]["max"].get<double>(), 200.0);
    EXPECT_EQ(info["non_finite"], 0);
    EXPECT_NEAR(info["occupancy"].get<double>(), sphere_class == 1 ? 0.05 : 0.3, 0.01);
    std::int64_t voxels = 0;
    for (const Json& count : info["histogram"]) voxels += count.get<std::int64_t>();
    EXPECT_EQ(voxels, 40 * 40 * 40);
    EXPECT_NEAR(info["histogram"][0].get<double>(), 64000 * (1 - info["occupancy"].get<double>()), 1);
  }
}

TEST_F(VolumeToolsTest, ValueTellsWhatLiesAtPoints) {
  MakeSphere("s.nrrd", 2, 20);
  const std::vector<std::string> command = {"value", "s.nrrd", "--local=1", "--at", "9.6,9.6,9.6", "--at", "-0.4,0,0", "--at", "99,0,0"};
  std::vector<std::string> as_json = command;
  as_json.emplace_back("--json");
  const Json values = Json::Parse(MustRun(as_json).out).value();
  ASSERT_EQ(values.size(), 3U);
  EXPECT_EQ(values[0]["voxel"], (Json{10, 10, 10}));
  EXPECT_GE(values[0]["value"].get<double>(), 128);
  EXPECT_EQ(values[1]["value"], 0);
  EXPECT_EQ(values[2]["inside"], false);
  EXPECT_TRUE(values[2]["value"].is_null());
  EXPECT_THAT(MustRun(command).out, HasSubstr("-0.4 0 0  voxel 0 0 0  value 0\n99 0 0  outside the volume\n"));
  const ProgramResult wrong = Slabstream({"value", "s.nrrd", "--local=1", "--at", "1,2"});
  EXPECT_EQ(wrong.exit_status, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--at '1,2'"));
}

TEST_F(VolumeToolsTest, SpheresAreDeterministicInEveryFormat) {
  MakeSphere("a.nrrd", 1, 33);
  const Json reference = Info("a.nrrd");
  for (const char* name : {"b.nrrd", "b.mha", "b.mhd"}) {
    MakeSphere(name, 1, 33);
    const Json info = Info(name);
    for (const char* field : {"size", "type", "range", "histogram", "occupancy"}) EXPECT_EQ(info[field], reference[field]) << name;
  }
}

TEST_F(VolumeToolsTest, AFullDiskKeepsTheOlderVolume) {
  for (const std::string name : {"s.nrrd", "s.mha", "s.mhd"}) {
    MakeSphere(name, 2, 20);
    const Json before = Info(name);
    const ProgramResult result = OnFullDisk(100, [&] { return Slabstream({"sphere", "--class", "2", "--size", "30", "-o", name}); });
    EXPECT_EQ(result.exit_status, 1) << name;
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr("File too large"));
    EXPECT_EQ(Info(name), before);
  }
}

TEST_F(VolumeToolsTest, InfoIsReadable) {
  MakeSphere("s.nrrd", 1, 20);
  const std::string text = MustRun({"info", "s.nrrd"}).out;
  for (const char* part : {"20 x 20 x 20 voxels", "uint8", "spacing      1 1 1", "occupancy", "histogram", "#####"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST_F(VolumeToolsTest, InfoTellsTheLevelsOfAVolume) {
  MakeSphere("s.nrrd", 1, 100);
  MustRun({"convert", "s.nrrd", "s.ome.zarr"});
  const std::string text = MustRun({"info", "s.ome.zarr"}).out;
  for (const char* part : {"format       OME-Zarr 0.5\n", "size         100 x 100 x 100 voxels (1.0 MiB)\n",
                           "levels       2: voxels, spacing, memory, block\n", "   0  100 x 100 x 100  1 1 1  1.0 MiB  64 x 64 x 64\n",
                           "   1  50 x 50 x 50  2 2 2  0.1 MiB  50 x 50 x 50\n", "values       0 ... 248\n", "#####"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  const Json info = Info("s.ome.zarr"), whole = Info("s.nrrd");
  for (const char* field : {"size", "type", "file_type", "spacing", "range", "histogram", "occupancy"})
    EXPECT_EQ(info[field], whole[field]);
  ASSERT_EQ(info["levels"].size(), 2U);
  EXPECT_EQ(info["levels"][0]["block"], (Json{64, 64, 64}));
  EXPECT_EQ(info["levels"][1]["size"], (Json{50, 50, 50}));
  EXPECT_EQ(info["levels"][1]["spacing"], (Json{2.0, 2.0, 2.0}));
  EXPECT_EQ(info["levels"][1]["voxel_bytes"], 125000);
  EXPECT_EQ(info["statistics"], (Json{{"level", 0}, {"sample", false}, {"times", 1}}));
  EXPECT_FALSE(whole.contains("levels"));
}

// Nobody has the time, or the memory, to read all of it.
TEST_F(VolumeToolsTest, InfoOfALargeVolumeTellsOfACoarseLevelOrASample) {
  const auto write = [&](const std::string& name, const Json& text) { std::ofstream(Path(name)) << text; };
  const auto array = [&](const std::string& name, const Json& shape, int fill) {
    std::filesystem::create_directories(Path(name));
    write(name + "/.zarray", {{"zarr_format", 2},
                              {"shape", shape},
                              {"chunks", {64, 64, 64}},
                              {"dtype", "|u1"},
                              {"compressor", nullptr},
                              {"fill_value", fill},
                              {"order", "C"},
                              {"filters", nullptr}});
  };
  const auto scale = [](double step) { return Json::array({{{"type", "scale"}, {"scale", {step, step, step}}}}); };
  array("large.zarr/0", {65535, 4096, 4096}, 0);  // a TiB of which no chunk is there
  array("large.zarr/1", {512, 32, 32}, 7);
  write("large.zarr/.zgroup", {{"zarr_format", 2}});
  const Json axes = {{{"name", "z"}, {"type", "space"}}, {{"name", "y"}, {"type", "space"}}, {{"name", "x"}, {"type", "space"}}};
  const Json datasets = {{{"path", "0"}, {"coordinateTransformations", scale(1)}},
                         {{"path", "1"}, {"coordinateTransformations", scale(128)}}};
  const Json image = {{"version", "0.4"}, {"axes", axes}, {"datasets", datasets}};
  write("large.zarr/.zattrs", {{"multiscales", Json::array({image})}});
  EXPECT_THAT(MustRun({"info", "large.zarr"}).out, HasSubstr("values       7 ... 7 of level 1\n"));
  EXPECT_EQ(Info("large.zarr")["statistics"], (Json{{"level", 1}, {"sample", false}, {"times", 1}}));

  std::ofstream(Path("large.raw"));
  std::filesystem::resize_file(Path("large.raw"), std::uintmax_t{1024} * 1024 * 1100);
  const std::vector<std::string> raw = {"--dims", "1024,1024,1100", "--type", "uint8"};
  std::vector<std::string> command = {"info", "large.raw"};
  command.insert(command.end(), raw.begin(), raw.end());
  EXPECT_THAT(MustRun(command).out, HasSubstr("values       0 ... 0 of a sample of level 0\n"));
  EXPECT_EQ(Info("large.raw", raw)["statistics"], (Json{{"level", 0}, {"sample", true}, {"times", 1}}));
}

// It cannot be read in parts.
TEST_F(VolumeToolsTest, InfoTellsOfTheLuminanceOfAnUncompressedFile) {
  std::ofstream(Path("rgb.nrrd")) << "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\nencoding: raw\n\n" << std::string(24, 'x');
  const Json info = Info("rgb.nrrd", {"--channel", "luminance"});
  EXPECT_EQ(info["size"], (Json{2, 2, 2}));
  EXPECT_EQ(info["range"]["max"], 120);
}

TEST_F(VolumeToolsTest, AMagnitudeIsThatOfAVectorOfTwoOrThreeComponents) {
  const auto write = [&](const std::string& name, int components, const std::string& voxel) {
    std::string voxels;
    for (int i = 0; i < 8; ++i) voxels += voxel;
    std::ofstream(Path(name)) << "NRRD0004\ntype: uint8\ndimension: 4\nsizes: " << components << " 2 2 2\nencoding: raw\n\n" << voxels;
  };
  write("vector.nrrd", 3, {3, 4, 12});
  write("four.nrrd", 4, {1, 2, 3, 4});
  EXPECT_EQ(Info("vector.nrrd?channel=magnitude")["range"], (Json{{"max", 13}, {"min", 13}}));
  EXPECT_EQ(Info("vector.nrrd", {"--channel", "magnitude"})["range"], (Json{{"max", 13}, {"min", 13}}));
  EXPECT_THAT(MustRun({"value", "vector.nrrd", "--at", "1,1,1", "--channel", "magnitude", "--local"}).out, HasSubstr("value 13"));
  const ProgramResult four = Slabstream({"info", "four.nrrd", "--channel", "magnitude"});
  EXPECT_EQ(four.exit_status, 2);
  EXPECT_THAT(four.err, HasSubstr("four.nrrd: has 4 components a voxel, so channel must be 0 to 3, or luminance"));
}

TEST_F(VolumeToolsTest, HelpNamesWhatCanBeChosen) {
  const std::string text = MustRun({"render", "--help-all"}).out;
  for (const char* part : {"--local", "--transfer", "auto", "opaque", "slab", "fan-in", "--azimuth"}) EXPECT_THAT(text, HasSubstr(part));
  const std::string presets = "colour map: dark violet, green, yellow";
  EXPECT_EQ(text.find(presets), text.rfind(presets)) << "the list of presets is printed once";
  EXPECT_EQ(MustRun({"help", "render"}).out, MustRun({"render", "--help"}).out);
  EXPECT_EQ(MustRun({"help"}).out, MustRun({"--help"}).out);
  EXPECT_THAT(MustRun({"man", "render"}).out, HasSubstr(".SH EXAMPLES\n.TP\n.B slabstream render head.nii.gz"));
  EXPECT_THAT(MustRun({"help", "experiment", "sweep"}).out, HasSubstr("What to vary"));
  EXPECT_EQ(Slabstream({"help", "rendr"}).exit_status, 2);
}

TEST_F(VolumeToolsTest, HelpExplainsEveryOptionInWords) {
  const std::string program = Command({}).front();
  std::vector<std::vector<std::string>> commands = {{program + "-coordinator"}, {program + "-worker"}};
  for (const char* command : {"render", "turntable", "info", "convert", "sphere", "up", "down", "status", "bench", "experiment", "help"}) {
    commands.push_back({program, command});
  }
  for (std::vector<std::string>& arguments : commands) {
    const std::string command = arguments.back();
    arguments.push_back(command == "render" || command == "turntable" ? "--help-all" : "--help");
    const ProgramResult help = RunningProgram(arguments, directory_).Wait();
    ASSERT_EQ(help.exit_status, 0) << command;
    std::string text = help.out;
    const std::string place = "{name}";  // which users type
    for (std::size_t at = text.find(place); at != std::string::npos; at = text.find(place)) text.erase(at, place.size());
    for (const char* notation : {"REQUIRED", "{", "}", ":{", " x ", "Needs:", "Excludes:", "=36", "TEXT", "UINT"}) {
      EXPECT_THAT(text, Not(HasSubstr(notation))) << command;
    }
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      // An option that stands alone has its text on the next line; that line is indented.
      if (line.rfind("  -", 0) != 0 || line.size() > 34) continue;
      ASSERT_TRUE(std::getline(lines, line)) << command;
      EXPECT_EQ(line.rfind(std::string(30, ' '), 0), 0U) << command << ": no text before '" << line << "'";
    }
  }
  const std::string text = MustRun({"turntable", "--help-all"}).out;
  for (const char* heading : {"View:", "Look:", "Distribution", "Output:", "(required)", "(default: 512)"})
    EXPECT_THAT(text, HasSubstr(heading));
}

TEST_F(VolumeToolsTest, EveryProgramTellsItsVersion) {
  EXPECT_THAT(MustRun({"--version"}).out, testing::MatchesRegex("slabstream [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

}  // namespace
}  // namespace slabstream
