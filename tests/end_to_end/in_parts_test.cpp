// Volumes with levels, and volumes that no process holds, as a user meets them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>

#include "common/json/json.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

constexpr double kSame = 2e-5 + 1.0 / 1024;  // of pictures that were composed of other boxes

class InPartsTest : public EndToEndTest {
 protected:
  // 130 voxels a side, levels 0 to 2.
  std::string MakeLevels() const {
    MakeSphere("ball.nrrd", 2, 130);
    MustRun({"convert", "ball.nrrd", "ball.ome.zarr"});
    return "ball.ome.zarr";
  }
  // 274 MiB, in a file that takes little room: a small block of voxels amid zeros.
  void MakeLarge(const std::string& name, int value = 200) const {
    constexpr int kSide = 660, kBegin = 300, kEnd = 360;
    std::ofstream file(Path(name), std::ios::binary);
    file << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: " << kSide << ' ' << kSide << ' ' << kSide << "\nencoding: raw\n\n";
    const std::streamoff header = file.tellp();
    const std::string row(kEnd - kBegin, char(value));
    for (int z = kBegin; z < kEnd; ++z) {
      for (int y = kBegin; y < kEnd; ++y) {
        file.seekp(header + (std::streamoff(z) * kSide + y) * kSide + kBegin);
        file << row;
      }
    }
    file.close();
    std::filesystem::resize_file(Path(name), std::uintmax_t(header) + std::uintmax_t(kSide) * kSide * kSide);
  }
  PictureFile Render(const std::string& data, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"render", data, "-o", "picture.exr", "--size", "128"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path("picture.exr"));
  }
  static double Opaque(const PictureFile& picture) {  // share of pixels
    int count = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) count += picture.At(x, y, 3) > 0.05 ? 1 : 0;
    }
    return double(count) / (picture.width * picture.height);
  }
};

TEST_F(InPartsTest, VolumesBehindAWebServerAreShownLikeFiles) {
  const std::string levels = MakeLevels();
  const ScriptedServer server(ServesFolder(Path("")));
  const std::string url = server.url() + "/" + levels;
  EXPECT_EQ(MustRun({"info", url}).out, MustRun({"info", levels}).out);
  const std::vector<std::string> look = {"--local=2", "--zoom", "2", "--level", "0"};
  EXPECT_LE(LargestDifference(Render(url, look), Render(levels, look)), kSame);
  std::filesystem::create_directory(Path("nothing"));
  ExpectRefused({"info", server.url() + "/nothing"}, "/nothing: is no volume that can be read from an address");
}

// Coordinator and workers open the dataset, and each of its times by that.
TEST_F(InPartsTest, OtherTimesBehindAWebServerCostNoMetadata) {
  constexpr std::uint64_t kTimes = 12, kSide = 112;  // more than the coordinator would hold of each time
  const Json scale = {{"type", "scale"}, {"scale", {1, 1, 1, 1}}};
  Json image = {{"version", "0.4"},
                {"axes", Json::array()},
                {"datasets", Json::array({{{"path", "0"}, {"coordinateTransformations", Json::array({scale})}}})}};
  for (const char* const axis : {"t", "z", "y", "x"}) image["axes"].push_back({{"name", axis}, {"type", *axis == 't' ? "time" : "space"}});
  WriteZarrGroup(Path("times.zarr"), 2, {{"multiscales", Json::array({image})}});
  WriteZarrArray(Path("times.zarr/0"),
                 {.shape = {kTimes, kSide, kSide, kSide}, .chunk = {1, 56, 56, 56}, .type = SampleType::kUint8, .separator = '/'},
                 [](std::span<const std::uint64_t> at) { return double(at[3] > 8 * at[0] ? 100 + at[1] % 16 : 0); });
  const ScriptedServer server(ServesFolder(Path("")));
  const auto movie = [&](const std::string& source, const std::string& name) {
    MustRun({"turntable", source, "--local=2", "--time", fmt::format("0:{}", kTimes - 1), "--turns", "0", "--in-flight", "1", "--size",
             "64", "--no-fit", "-o", name + "_%d.exr"});
  };
  const auto metadata = [&] {
    return std::ranges::count_if(server.requests(), [](const ServerRequest& each) { return each.target.find("/.z") != std::string::npos; });
  };
  MustRun({"info", server.url() + "/times.zarr"});
  const auto to_open = metadata();
  movie(server.url() + "/times.zarr", "far");
  EXPECT_LE(metadata() - to_open, 6 * to_open) << "of the command, the coordinator, and workers, at most twice each";
  movie("times.zarr", "near");
  for (std::uint64_t time = 0; time < kTimes; ++time) {
    const std::string end = fmt::format("_{}.exr", time);
    EXPECT_LE(LargestDifference(ReadPicture(Path("far" + end)), ReadPicture(Path("near" + end))), kSame) << time;
  }
  EXPECT_GT(LargestDifference(ReadPicture(Path("far_0.exr")), ReadPicture(Path("far_11.exr"))), 0.1);
}

TEST_F(InPartsTest, LevelsAreChosenByNumberOrDetailAndWrongOnesRefused) {
  const std::string levels = MakeLevels();
  std::vector<double> shown;
  std::vector<PictureFile> pictures;
  for (const std::string level : {"0", "1", "2"}) {
    pictures.push_back(Render(levels, {"--local=1", "--zoom", "3", "--level", level}));
    shown.push_back(Opaque(pictures.back()));
    EXPECT_NEAR(shown.back(), shown.front(), 0.05) << level;
  }
  EXPECT_EQ(LargestDifference(pictures[0], Render("ball.nrrd", {"--local=1", "--zoom", "3"})), 0) << "the same voxels";
  EXPECT_GT(LargestDifference(pictures[0], pictures[1]), kSame);
  EXPECT_GT(LargestDifference(pictures[1], pictures[2]), kSame);
  // A voxel is about 1.7 pixels wide at zoom 3.
  EXPECT_EQ(LargestDifference(Render(levels, {"--local=1", "--zoom", "3"}), pictures[0]), 0);
  EXPECT_EQ(LargestDifference(Render(levels, {"--local=1", "--zoom", "3", "--detail", "5"}), pictures[1]), 0);
  EXPECT_EQ(LargestDifference(Render(levels, {"--local=1", "--zoom", "3", "--detail", "100"}), pictures[2]), 0);

  const std::vector<std::string> render = {"render", "--local=1", "-o", "no.png"};
  ExpectEachRefused(render, {
                                {{levels, "--level", "9"}, "has levels 0 to 2"},
                                {{"ball.nrrd", "--level", "1"}, "has level 0 alone"},
                                {{levels, "--level", "fine"}, "level"},
                                {{levels, "--detail", "-1"}, "detail"},
                            });
}

TEST_F(InPartsTest, StatisticsAndRecordsTellLevelsAndBytes) {
  const std::string levels = MakeLevels();
  std::uintmax_t size = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(Path(levels)))
    size += entry.is_regular_file() ? entry.file_size() : 0;
  MustRun({"turntable", levels, "--local=1", "-o", "f_%04d.png", "--frames", "2", "--in-flight", "1", "--size", "64", "--level", "1",
           "--stats", "stats.json"});
  const Json stats = Json::Parse(ReadFile("stats.json")).value();
  for (const Json& frame : stats["frames"]) {
    ASSERT_EQ(frame["levels"].size(), 1U);
    EXPECT_EQ(frame["levels"][0]["level"], 1);
    EXPECT_GE(frame["levels"][0]["boxes"].get<double>(), 1);
    EXPECT_GT(frame["levels"][0]["voxels"].get<double>(), 0);
    EXPECT_LE(frame["levels"][0]["voxels"].get<double>(), 65 * 65 * 65);
  }
  EXPECT_GT(stats["frames"][0]["bytes"]["stored"].get<double>(), 0) << "the coordinator reads the level for the first frame";
  EXPECT_LE(stats["bytes"]["stored"].get<double>(), size) << "packed as they lie in the file";
  EXPECT_EQ(stats["frames"][1]["bytes"]["stored"], 0) << "and holds it for the second one";
  EXPECT_EQ(Json::Parse(MustRun({"info", "f_0000.png", "--json"}).out).value()["levels"], Json::array({1}));
  EXPECT_THAT(MustRun({"info", "f_0000.png"}).out, HasSubstr("drawn from"));

  MakeLarge("large.nrrd");
  MustRun({"render", "large.nrrd", "--local=1", "--memory", "768M",   "--renderer", "mip", "--azimuth", "0",       "--elevation",
           "0",      "--no-fit",   "--zoom",    "8",        "--size", "64",         "-o",  "l.png",     "--stats", "stats.json"});
  const Json in_parts = Json::Parse(ReadFile("stats.json")).value();
  EXPECT_EQ(in_parts["frames"][0]["levels"][0]["level"], 0);
  EXPECT_GT(in_parts["bytes"]["stored"].get<double>(), 0) << "a worker reads it";
  EXPECT_FALSE(Json::Parse(MustRun({"info", "l.png", "--json"}).out).value().contains("levels")) << "level 0 alone";
}

TEST_F(InPartsTest, ConvertWritesALevelOrABoxOfIt) {
  const std::string levels = MakeLevels();
  MustRun({"convert", levels, "part.nrrd", "--level", "1", "--box", "10:20,:5,60:"});
  const Json whole = Json::Parse(MustRun({"info", levels, "--json"}).out).value()["levels"][1];
  const Json part = Json::Parse(MustRun({"info", "part.nrrd", "--json"}).out).value();
  EXPECT_EQ(part["size"], Json::array({10, 5, 5}));
  EXPECT_EQ(part["spacing"], whole["spacing"]);
  MustRun({"convert", levels, "part.ome.zarr", "--level", "1", "--box", "10:20,:5,60:"});
  EXPECT_EQ(Json::Parse(MustRun({"info", "part.ome.zarr", "--json"}).out).value()["histogram"], part["histogram"]);
  ExpectEachRefused({"convert", levels, "no.nrrd"}, {
                                                        {{"--level", "3"}, "has levels 0 to 2"},
                                                        {{"--level", "1", "--box", "0:66,:,:"}, "x from 0 to 66"},
                                                        {{"--box", "5:5,:,:"}, "x from 5 to 5"},
                                                        {{"--box", "5:9"}, "X0:X1,Y0:Y1,Z0:Z1"},
                                                        {{"--box", "a:9,:,:"}, "--box"},
                                                    });
  ExpectEachRefused({"convert", "ball.nrrd", "no.nrrd"}, {{{"--level", "1"}, "has level 0 alone"}});
}

// A rod that begins close to the eye: there a voxel of level 0 is as wide as a pixel, and at the other end fifteen are.
TEST_F(InPartsTest, WhatDoesNotFitNamesTheLevelThatWouldAndDetailAutoDrawsIt) {
  std::ofstream(Path("rod.nrrd"), std::ios::binary)
      << ("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8000 8 8\nencoding: raw\n\n" + std::string(8000 * 8 * 8, char(200)));
  MustRun({"convert", "rod.nrrd", "rod.ome.zarr"});
  const std::vector<std::string> view = {"--local=1", "--memory",     "768M",        "--renderer",  "zbuffer", "--size",
                                         "2000",      "--projection", "perspective", "--fov",       "60",      "--distance",
                                         "4100",      "--azimuth",    "90",          "--elevation", "0",       "--no-fit"};
  std::vector<std::string> command = {"render", "rod.ome.zarr", "-o", "rod.png"};
  command.insert(command.end(), view.begin(), view.end());
  const ProgramResult refused = Slabstream(command);
  EXPECT_EQ(refused.exit_status, 1);
  ASSERT_EQ(refused.err_lines().size(), 1U) << refused.err;
  EXPECT_THAT(refused.err, AllOf(HasSubstr("limit 512 MiB"), HasSubstr("would fit, and --detail auto chooses such a level")));
  command.insert(command.end(), {"--detail", "auto", "--stats", "stats.json"});
  const ProgramResult lowered = MustRun(command);
  EXPECT_THAT(lowered.err, HasSubstr("is drawn instead of level 0: "));
  const Json stats = Json::Parse(ReadFile("stats.json")).value();
  EXPECT_THAT(stats["frames"][0]["lowered"].get<std::string>(), HasSubstr("is drawn instead of level 0"));
  // The volume itself has no other level.
  command[1] = "rod.nrrd";
  const ProgramResult single = Slabstream(command);
  EXPECT_EQ(single.exit_status, 1);
  EXPECT_THAT(single.err, HasSubstr("slabstream convert makes them"));
}

TEST_F(InPartsTest, ADamagedChunkEndsInOneLineThatNamesIt) {
  const std::string levels = MakeLevels();
  int damaged = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(Path(levels) + "/0")) {
    if (!entry.is_regular_file() || entry.path().extension() == ".json" || entry.file_size() < 2000) continue;
    std::fstream file(entry.path(), std::ios::binary | std::ios::in | std::ios::out);
    for (std::uintmax_t at = 0; at < entry.file_size(); at += 7) file.seekp(std::streamoff(at)).put('x');
    ++damaged;
  }
  ASSERT_GT(damaged, 0);
  const ProgramResult result = Slabstream({"render", levels, "--local=1", "--level", "0", "-o", "no.png"});
  EXPECT_NE(result.exit_status, 0);
  ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
  EXPECT_THAT(result.err, HasSubstr("ball.ome.zarr/0/"));
  EXPECT_FALSE(std::filesystem::exists(Path("no.png")));
}

// Its coordinator holds 256 MiB of voxels.
TEST_F(InPartsTest, AServiceReadsInPartsWhatItCannotHold) {
  MakeLarge("large.nrrd");
  const std::string endpoint = "ipc://" + Path("s");
  const std::string up =
      MustRun({"up", "--detach", "--workers", "2", "--memory", "1G", "--listen", endpoint, "--data", "large=large.nrrd"}).out;
  const std::vector<std::vector<std::string>> views = {
      {"--renderer", "splat"},
      {"--renderer", "raycast", "--projection", "perspective"},
      {"--renderer", "mip", "--clip-box", "50%:,:,:"},
      {"--renderer", "zbuffer", "--azimuth", "40"},
  };
  for (std::vector<std::string> view : views) {
    SCOPED_TRACE(view[1]);
    view.insert(view.end(), {"--no-fit", "--zoom", "8"});
    const PictureFile in_parts = Render("large", view);
    view.push_back("--local=1");
    EXPECT_LE(LargestDifference(in_parts, Render("large.nrrd", view)), kSame);
    EXPECT_GT(Opaque(in_parts), 0.05);
  }
  const Json status = Json::Parse(MustRun({"status", "--json"}).out).value();
  EXPECT_EQ(status["datasets"][0]["state"], "ready");
  EXPECT_EQ(status["datasets"][0]["memory_bytes"], 0);
  const std::size_t begin = up.find("logs are in ");
  ASSERT_NE(begin, std::string::npos) << up;
  const std::string logs = up.substr(begin + 12, up.find('\n', begin) - begin - 12);
  int reading = 0;
  for (const auto& entry : std::filesystem::directory_iterator(logs)) {
    if (slabstream::ReadFile(entry.path()).find("reads " + Path("large.nrrd") + " itself") != std::string::npos) ++reading;
  }
  EXPECT_GT(reading, 0) << logs;
}

// Levels are small, so that the coordinator holds them; shards of level 0 are read when its first picture is asked for.
TEST_F(InPartsTest, AServiceGoesOnAfterBadChunksAndReadsThemAgainOnceTheyAreRepaired) {
  const std::string levels = MakeLevels();
  MakeSphere("other.nrrd", 2, 30);
  const std::string endpoint = "ipc://" + Path("s");
  MustRun({"up", "--detach", "--listen", endpoint, "--data", "ball=" + levels, "--data", "other=other.nrrd"});
  const PictureFile expected = Render("ball.nrrd", {"--local=1"});
  MustRun({"render", "ball", "-o", "coarse.png", "--level", "2"});  // so it is open
  const std::string shard = Path(levels + "/0/c/0/0/0"), kept = Path("kept");
  ASSERT_TRUE(std::filesystem::exists(shard));
  std::filesystem::copy_file(shard, kept);
  const auto size = std::filesystem::file_size(shard);
  const std::vector<std::function<void()>> damages = {
      [&] { std::filesystem::resize_file(shard, size / 3); },
      [&] { std::ofstream(shard, std::ios::binary | std::ios::app) << "more"; },
      [&] { std::ofstream(shard, std::ios::binary | std::ios::in | std::ios::out).seekp(std::streamoff(size / 2)) << "damage"; },
  };
  for (const auto& damage : damages) {
    damage();
    const ProgramResult result = Slabstream({"render", "ball", "-o", "no.png", "--level", "0"});
    EXPECT_EQ(result.exit_status, 2);
    ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_THAT(result.err, HasSubstr("ball.ome.zarr/0/c/0/0/0"));
    MustRun({"render", "other", "-o", "other.png"});
    std::filesystem::copy_file(kept, shard, std::filesystem::copy_options::overwrite_existing);
  }
  EXPECT_LE(LargestDifference(Render("ball", {"--level", "0"}), expected), kSame);
}

TEST_F(InPartsTest, AWorkerThatDoesNotSeeTheFilesGetsVoxelsFromTheCoordinator) {
  MakeLarge("large.nrrd");
  const std::string programs = Command({}).front().substr(0, Command({}).front().rfind('/'));
  const std::string endpoint = "ipc://" + Path("s"), workers = "ipc://" + Path("w");
  // A path that means something else in every process.
  RunningProgram coordinator({programs + "/slabstream-coordinator", "--listen", endpoint, "--worker-listen", workers, "--memory", "256M",
                              "--data", "large=/proc/self/cwd/large.nrrd"},
                             directory_);
  ASSERT_TRUE(coordinator.WaitForOutput("ready"));
  RunningProgram worker({programs + "/slabstream-worker", "--coordinator", workers, "--log-level", "info"}, "/");
  const PictureFile picture = Render("large", {"--endpoint", endpoint, "--zoom", "8"});
  EXPECT_LE(LargestDifference(picture, Render("large.nrrd", {"--local=1", "--zoom", "8"})), kSame);
  EXPECT_GT(Opaque(picture), 0.05);
  worker.Signal(SIGTERM);
  EXPECT_THAT(worker.Wait().err, AllOf(HasSubstr("asks the coordinator for voxels"), Not(HasSubstr(" itself"))));
  coordinator.Signal(SIGTERM);
  coordinator.Wait();
}

TEST_F(InPartsTest, AnIndexIsMadeOnceAndToldByInfo) {
  const std::string levels = "dense.ome.zarr";  // there is nothing around the sphere
  MakeSphere("dense.nrrd", 1, 130);
  MustRun({"convert", "dense.nrrd", levels});
  const auto info = [&] { return Json::Parse(MustRun({"info", "--json", levels}).out).value()["index"]; };
  EXPECT_EQ(info(), nullptr);
  EXPECT_THAT(MustRun({"info", levels}).out, HasSubstr("index        none"));
  const PictureFile without = Render(levels, {"--local=1", "--level", "0"});

  const ProgramResult made = MustRun({"index", levels, "--memory", "512M", "--progress"});
  EXPECT_THAT(made.out, AllOf(HasSubstr("wrote " + Path("cache/slabstream/index/")), HasSubstr("ranges of ")));
  EXPECT_THAT(made.err, AllOf(HasSubstr("100 %"), HasSubstr("MiB/s")));
  EXPECT_EQ(info()["usable"], true);
  EXPECT_EQ(info()["read"], 1);
  EXPECT_GT(info()["visible"].get<double>(), 0);
  EXPECT_LT(info()["visible"].get<double>(), 1);
  EXPECT_THAT(MustRun({"info", levels}).out, HasSubstr("bricks of level 0 can be visible under transfer function 'auto'"));
  EXPECT_EQ(LargestDifference(Render(levels, {"--local=1", "--level", "0"}), without), 0);
  const std::string path = info()["path"].text();

  // Damaged.
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
  EXPECT_EQ(info()["usable"], false);
  const ProgramResult damaged = MustRun({"info", levels});
  ASSERT_EQ(damaged.err_lines().size(), 1U) << damaged.err;
  EXPECT_THAT(damaged.err, AllOf(HasSubstr(path), HasSubstr("slabstream index")));
  EXPECT_EQ(LargestDifference(Render(levels, {"--local=1", "--level", "0"}), without), 0);
  MustRun({"index", levels});
  EXPECT_EQ(info()["usable"], true);

  // Of other files.
  std::ofstream(Path(levels) + "/0/new") << "a chunk";
  EXPECT_EQ(info()["usable"], false);
  MustRun({"index", levels});
  EXPECT_EQ(info()["usable"], true);
}

TEST_F(InPartsTest, AnIndexThatCannotBeMadeIsRefused) {
  MakeSphere("ball.nii.gz", 2, 30);
  ExpectEachRefused({"index"}, {
                                   {{"ball.nii.gz"}, "its format cannot be read in parts"},
                                   {{"no.ome.zarr"}, "no.ome.zarr"},
                                   {{"ball.nii.gz", "--memory", "1"}, "--memory"},
                               });
  const std::string levels = MakeLevels();
  std::ofstream(Path("cache")) << "no folder";
  const ProgramResult failed = Slabstream({"index", levels});
  EXPECT_EQ(failed.exit_status, 1);
  ASSERT_EQ(failed.err_lines().size(), 1U) << failed.err;
  EXPECT_THAT(failed.err, HasSubstr("XDG_CACHE_HOME"));
}

}  // namespace
}  // namespace slabstream
