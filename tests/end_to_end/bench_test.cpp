// `bench`: figures of every case that was asked for, pictures and scenes for comparing. What the figures are is not asserted.
#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

using testing::AnyOf;

class BenchTest : public EndToEndTest {
 protected:
  BenchTest() : ball_(MakeSphere("ball.nrrd", 2, 24)) {}
  std::string ball_;
};

TEST_F(BenchTest, MeasuresEachCaseAndWritesReportAndPictures) {
  const ProgramResult result = MustRun({"bench", ball_ + ":opaque", ball_, "--size", "48", "--frames", "3", "--turns", "2", "--workers",
                                        "2", "--json", "report.json", "--pictures", "made/pictures"});
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("\nball-opaque "));
  EXPECT_THAT(result.out, HasSubstr("\nball-auto "));
  const Json report = Json::Parse(ReadFile("report.json")).value();
  ASSERT_EQ(report["cases"].size(), 2U);
  for (const Json& c : report["cases"]) {
    EXPECT_EQ(c["volume"]["size"], (Json{24, 24, 24}));
    EXPECT_EQ(c["volume"]["raw_bytes"], 24 * 24 * 24);
    EXPECT_GT(c["first_frame_ms"].get<double>(), 0);
    EXPECT_GT(c["peak_rss_bytes"].get<double>(), 1 << 20);
    EXPECT_GT(c["stage_median_ms"]["render"].get<double>(), 0);
    for (const char* projection : {"orthographic", "perspective"}) {
      EXPECT_EQ(c["latency_ms"][projection]["frames"], 6);
      EXPECT_GT(c["latency_ms"][projection]["min"].get<double>(), 0);
      const PictureFile picture = ReadPicture(Path("made/pictures/" + c["case"].get<std::string>() + "." + projection + ".png"));
      EXPECT_EQ(picture.width, 48);
      EXPECT_GT(picture.At(24, 24, 0), 0.1);
      EXPECT_EQ(picture.At(0, 0, 0), 0) << "black where nothing is";
    }
  }
}

TEST_F(BenchTest, MeasuresAService) {
  const std::string endpoint = "ipc://" + Path("bench.ipc");
  MustRun({"up", "--detach", "--workers", "2", "--listen", endpoint, "--data", "ball=" + ball_});
  MustRun({"bench", "ball:opaque", "--endpoint", endpoint, "--size", "32", "--frames", "2", "--turns", "1", "--renderer", "zbuffer",
           "--json", "report.json"});
  const Json report = Json::Parse(ReadFile("report.json")).value();
  EXPECT_EQ(report["endpoint"], endpoint);
  EXPECT_EQ(report["cases"][0]["renderer"], "zbuffer");
  EXPECT_EQ(report["cases"][0]["volume"]["size"], (Json{24, 24, 24}));

  const ProgramResult unknown = Slabstream({"bench", "class1-256", "--endpoint", endpoint});
  EXPECT_EQ(unknown.exit_status, 2);
  EXPECT_THAT(unknown.err, HasSubstr("class1-256"));
  EXPECT_EQ(unknown.err_lines().size(), 1U) << unknown.err;
  EXPECT_EQ(unknown.out, "");
}

TEST_F(BenchTest, ExportsWhatAnotherRendererNeeds) {
  MustRun({"bench", ball_ + ":opaque", "--size", "40", "--export", "scenes"});
  const Json scene = Json::Parse(ReadFile("scenes/ball-opaque.scene.json")).value();
  EXPECT_EQ(scene["size"], 40);
  EXPECT_EQ(scene["views"]["zoom"], 1.732);
  // What was written is what the program itself reads again: the same voxels, and the preset as a curve.
  const std::string volume = "scenes/" + scene["volume"].get<std::string>(), curve = "scenes/" + scene["transfer"].get<std::string>();
  const Json original = Json::Parse(MustRun({"info", ball_, "--json", "--transfer", "opaque"}).out).value();
  const Json exported = Json::Parse(MustRun({"info", volume, "--json", "--transfer", curve}).out).value();
  for (const char* field : {"size", "type", "spacing", "range", "histogram", "occupancy"})
    EXPECT_EQ(exported[field], original[field]) << field;
}

TEST_F(BenchTest, ListNamesTheStandardCases) {
  const std::string list = MustRun({"bench", "--list"}).out;
  for (const char* name : {"class1-256 ", "class2-256-opaque ", "class1-512 ", "zbuffer-class1-256 ", "brain "})
    EXPECT_THAT(list, HasSubstr(name));
}

TEST_F(BenchTest, WithoutTheLaboratoryOneLineSaysWhatHasIt) {
  std::filesystem::copy_file(Command({}).front(), Path("slabstream"));
  const ProgramResult result = RunningProgram({Path("slabstream"), "bench", "--list"}, directory_).Wait();
  EXPECT_EQ(result.exit_status, 2);
  EXPECT_EQ(result.err, "slabstream: the program '" + Path("slabstream-laboratory") +
                            "' is missing; deploy/build makes all programs, and the package slabstream-lab has this one\n");
  const ProgramResult help = RunningProgram({Path("slabstream"), "--help"}, directory_).Wait();
  EXPECT_EQ(help.exit_status, 0);
  EXPECT_THAT(help.out, HasSubstr("Measure how fast this machine or a service renders"));
}

TEST_F(BenchTest, CtrlCEndsItAndKeepsTheRowsThatAreDone) {
  RunningProgram program(Command({"bench", ball_ + ":opaque", ball_ + ":auto", "--workers", "1", "--size", "16", "--frames", "500"}),
                         directory_);
  ASSERT_TRUE(program.WaitForOutput("\nball-opaque "));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_status, 130);
  EXPECT_THAT(result.out, Not(HasSubstr("ball-auto")));
  // While a service starts nothing has to be cleaned up, and the signal ends the process in silence.
  EXPECT_THAT(result.err, AnyOf("", "slabstream bench: interrupted\n"));
}

}  // namespace
}  // namespace slabstream
