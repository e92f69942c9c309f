// `experiment`: what is listed runs and leaves a report; what is interrupted continues; what is wrong is told in a line.
#include <gmock/gmock.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include "common/json/json.h"
#include "tests/end_to_end/program.h"
#include "tests/support/well_formed.h"

namespace slabstream {
namespace {

class ExperimentTest : public EndToEndTest {
 protected:
  std::vector<Json> RowsOf(const std::string& folder) {
    std::vector<Json> rows;
    std::istringstream lines(ReadFile(folder + "/results.jsonl"));
    for (std::string line; std::getline(lines, line);) rows.push_back(Json::Parse(line).value());
    return rows;
  }
  void ExpectResults(const std::string& folder, const std::string& experiment) {
    const Json run = Json::Parse(ReadFile(folder + "/run.json")).value();
    EXPECT_EQ(run["experiment"], experiment);
    EXPECT_NE(run["commit"], "");
    EXPECT_THAT(run["command"].get<std::string>(), HasSubstr("experiment "));
    EXPECT_GE(run["machine"]["cores"].get<double>(), 1);
    for (const char* told : {"cpu", "simd", "flags", "kernel", "governor", "compiler", "load"})
      EXPECT_TRUE(run["machine"].contains(told)) << told;
    const std::vector<Json> rows = RowsOf(folder);
    EXPECT_FALSE(rows.empty());
    for (const Json& row : rows) EXPECT_EQ(row["experiment"], experiment);
    const std::string csv = ReadFile(folder + "/results.csv");
    EXPECT_EQ(std::ranges::count(csv, '\n'), std::ptrdiff_t(rows.size()) + 1);
  }
  // Where Python has what slabstream-lab needs.
  void ExpectPage(const std::string& folder) {
    if (std::string_view(SLABSTREAM_LAB_PYTHON).empty()) return;
    RunningProgram lab({SLABSTREAM_LAB_PYTHON, SLABSTREAM_SOURCE_DIRECTORY "/python/slabstream-lab", folder}, directory_);
    const ProgramResult result = lab.Wait();
    EXPECT_EQ(result.exit_status, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("wrote " + folder + "/report.html"));
    EXPECT_EQ(WhyNotWellFormed(ReadFile(folder + "/report.html")), "");
    EXPECT_FALSE(std::filesystem::is_empty(Path(folder + "/plots")));
  }
};

TEST_F(ExperimentTest, EveryListedExperimentLeavesResultsAndAPage) {
  const std::string list = MustRun({"experiment", "--list"}).out;
  for (const std::string name : {"paper", "partitions", "balance", "combining", "streaming", "scaling"}) {
    EXPECT_THAT(list, HasSubstr(name));
    MustRun({"experiment", name, "-o", name, "--quick", "--repeats", "1", "--scale", "0.15"});
    ExpectResults(name, name);
    ExpectPage(name);
  }
}

TEST_F(ExperimentTest, SweepOfAUsersOwn) {
  const std::string ball = MakeSphere("ball.nrrd", 2, 24);
  std::ofstream(Path("sweep.json")) << R"({"volumes": [{"file": "ball.nrrd", "transfer": "opaque"}], "size": 48,
    "policies": [{}, {"decomposition": "kd-tree", "combine": "radix-k"},
                 {"name": "paper", "decomposition": "slab", "combine": "fan-in"}], "workers": [1, 3]})";
  MustRun({"experiment", "sweep", "sweep.json", "-o", "out", "--repeats", "2"});
  ExpectResults("out", "sweep");
  ExpectPage("out");
  const std::vector<Json> rows = RowsOf("out");
  EXPECT_EQ(std::ranges::count_if(rows, [](const Json& row) { return row["metric"] == "period"; }), 6);

  std::ofstream(Path("bad.json")) << R"({"volumes": [{"file": "ball.nrrd"}], "policies": [{}], "workers": [-1]})";
  const ProgramResult bad = Slabstream({"experiment", "sweep", "bad.json", "-o", "bad"});
  EXPECT_EQ(bad.exit_status, 2);
  EXPECT_THAT(bad.err, HasSubstr("workers[0]: -1"));
  EXPECT_FALSE(std::filesystem::exists(Path("bad"))) << "nothing is made before the file is right";
}

TEST_F(ExperimentTest, VolumesOfSourcesAreMeasuredAtTheirFinestLevel) {
  MakeSphere("ball.nrrd", 2, 24);
  MustRun({"convert", "ball.nrrd", "ball.ome.zarr"});
  std::ofstream(Path("sweep.json")) << R"({"volumes": [{"file": "ball.ome.zarr", "transfer": "opaque"}], "size": 48,
    "policies": [{}], "workers": [2]})";
  MustRun({"experiment", "sweep", "sweep.json", "-o", "out", "--quick", "--repeats", "1"});
  ExpectResults("out", "sweep");
  for (const Json& row : RowsOf("out")) EXPECT_EQ(row.value("volume", "ball-opaque"), "ball-opaque");

  std::filesystem::create_directory(Path("none.ome.zarr"));
  std::ofstream(Path("bad.json")) << R"({"volumes": [{"file": "none.ome.zarr"}], "policies": [{}], "workers": [1]})";
  const ProgramResult bad = Slabstream({"experiment", "sweep", "bad.json", "-o", "bad"});
  EXPECT_EQ(bad.exit_status, 2);
  EXPECT_THAT(bad.err, HasSubstr("none.ome.zarr"));
}

TEST_F(ExperimentTest, SweepAtARunningService) {
  MakeSphere("ball.nrrd", 2, 24);
  const std::string out = MustRun({"up", "--workers", "2", "--threads", "1", "--listen", "tcp://127.0.0.1:*", "--data",
                                   "ball=" + Path("ball.nrrd"), "--detach"})
                              .out;
  const std::string endpoint = out.substr(out.find("tcp://"), out.find(" (") - out.find("tcp://"));
  std::ofstream(Path("sweep.json"))
      << R"({"volumes": [{"dataset": "ball", "transfer": "opaque"}], "size": 48, "renderers": ["splat", "mip"],
    "policies": [{}, {"decomposition": "kd-tree", "balance": "dynamic"}]})";
  MustRun({"experiment", "sweep", "sweep.json", "-o", "out", "--quick", "--repeats", "1", "--endpoint", endpoint});
  ExpectResults("out", "sweep");
  ExpectPage("out");
  int periods = 0;
  for (const Json& row : RowsOf("out")) {
    if (row.value("part", "") == "conduct") continue;
    EXPECT_EQ(row["origin"], "measured");
    EXPECT_EQ(row["workers"], 2);
    if (row["metric"] != "period") continue;
    ++periods;
    EXPECT_GT(row["value"].get<double>(), 0);
  }
  EXPECT_EQ(periods, 4);
  const std::string roster = ReadFile("out/roster.csv");
  EXPECT_THAT(roster, testing::StartsWith("worker,host,threads\n1,"));
  EXPECT_EQ(std::ranges::count(roster, '\n'), 3);
  EXPECT_THAT(Json::Parse(ReadFile("out/experiment.json")).value()["parameters"]["service"]["roster"], testing::SizeIs(2));

  std::ofstream(Path("other.json")) << R"({"volumes": [{"dataset": "cake"}], "policies": [{}]})";
  std::ofstream(Path("here.json")) << R"({"volumes": [{"file": "ball.nrrd"}], "policies": [{}]})";
  const std::pair<std::string, std::string> wrong[] = {{"other.json", "the service has no dataset 'cake'"},
                                                       {"here.json", "must have either 'sphere' or 'dataset'"}};
  for (const auto& [file, says] : wrong) {
    const ProgramResult result = Slabstream({"experiment", "sweep", file, "-o", "x", "--endpoint", endpoint});
    EXPECT_EQ(result.exit_status, 2);
    EXPECT_THAT(result.err, HasSubstr(says));
    EXPECT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_FALSE(std::filesystem::exists(Path("x")));
  }
}

TEST_F(ExperimentTest, ContinuesWhereCtrlCStoppedIt) {
  const std::vector<std::string> arguments = {"experiment", "streaming", "-o", "out", "--quick", "--scale", "0.15", "--repeats", "4"};
  {
    RunningProgram program(Command(arguments), directory_);
    ASSERT_TRUE(program.WaitForOutput("kinds of trials"));
    program.Signal(SIGINT);
    const ProgramResult result = program.Wait();
    EXPECT_EQ(result.exit_status, 130) << result.err;
    EXPECT_THAT(result.err, HasSubstr("the same command continues"));
  }
  const std::string before = ReadFile("out/trials.jsonl");
  const ProgramResult other = Slabstream({"experiment", "streaming", "-o", "out", "--quick", "--scale", "0.15", "--repeats", "5"});
  EXPECT_EQ(other.exit_status, 2);
  EXPECT_THAT(other.err, HasSubstr("holds a run with repeats 4, not 5"));
  MustRun(arguments);
  EXPECT_EQ(ReadFile("out/trials.jsonl").substr(0, before.size()), before);
  ExpectResults("out", "streaming");
}

TEST_F(ExperimentTest, BalanceOfAUsersOwnVolume) {
  MakeSphere("ball.nrrd", 2, 24);
  MustRun({"experiment",
           "balance",
           "ball.nrrd:auto",
           "-o",
           "out",
           "--quick",
           "--repeats",
           "1",
           "--scale",
           "0.1",
           "--workers",
           "3",
           "--renderer",
           "mip,raycast",
           "--paths",
           "fly-through,transfer",
           "--methods",
           "rebuilt,dynamic",
           "--transfer",
           "opaque,gray-ramp"});
  ExpectResults("out", "balance");
  const std::string results = ReadFile("out/results.csv");
  for (const char* word : {"ball", "mip", "raycast", "fly-through"}) EXPECT_THAT(results, HasSubstr(word));
  EXPECT_THAT(results, Not(HasSubstr("class1")));
  EXPECT_EQ(Slabstream({"experiment", "balance", "ball.nrrd:auto", "-o", "out", "--quick", "--scale", "0.1"}).exit_status, 2)
      << "other options are another run";
}

TEST_F(ExperimentTest, OptionsBelongToTheirExperiment) {
  EXPECT_THAT(MustRun({"experiment", "balance", "--help"}).out, HasSubstr("--paths"));
  EXPECT_THAT(MustRun({"experiment", "paper", "--help"}).out, Not(HasSubstr("--paths")));
  MustRun({"experiment", "--quick", "--repeats", "1", "--scale", "0.15", "-o", "out", "streaming"});  // options may stand before the name
}

TEST_F(ExperimentTest, WhatIsWrongIsToldInALine) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"experiment"}, "NAME is missing"},
      {{"experiment", "paper"}, "--output"},
      {{"experiment", "cake", "-o", "x"}, "'cake' is no experiment"},
      {{"experiment", "sweep", "-o", "x"}, "needs a FILE"},
      {{"experiment", "sweep", "none.json", "-o", "x"}, "'none.json' does not exist"},
      {{"experiment", "paper", "some.json", "-o", "x"}, "some.json"},
      {{"experiment", "balance", "-o", "x", "--paths", "sideways"}, "--paths 'sideways'"},
      {{"experiment", "balance", "-o", "x", "--workers", "2,0"}, "--workers 0"},
      {{"experiment", "balance", "-o", "x", "--renderer", "crayon"}, "--renderer 'crayon'"},
      {{"experiment", "balance", "-o", "x", "--transfer", "opaque"}, "--transfer"},
      {{"experiment", "balance", "none.nrrd", "-o", "x"}, "none.nrrd"},
      {{"experiment", "balance", "-o", "x", "--renderer", "shear", "--paths", "fly-through"}, "renderer is 'shear', but projection"},
      {{"experiment", "paper", "-o", "x", "--paths", "turntable"}, "--paths"},
      {{"experiment", "paper", "-o", "x", "--scale", "2"}, "--scale"},
      {{"experiment", "paper", "-o", "x", "--repeats", "0"}, "--repeats"},
      {{"experiment", "paper", "-o", "x", "--footprints", "3,99"}, "--footprints 99"},
      {{"experiment", "paper", "-o", "x", "--footprints", "3,,5"}, "--footprints ''"},
      {{"experiment", "streaming", "-o", "x", "--footprints", "3"}, "--footprints"},
      {{"experiment", "paper", "-o", "x", "--volume", "none.nrrd"}, "none.nrrd"},
      {{"experiment", "paper", "-o", "/proc/x"}, "/proc/x"},
  };
  for (const auto& [arguments, says] : cases) {
    const ProgramResult result = Slabstream(arguments);
    EXPECT_EQ(result.exit_status, 2) << says;
    EXPECT_THAT(result.err, HasSubstr(says));
    EXPECT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_FALSE(std::filesystem::exists(Path("x")));
  }
}

}  // namespace
}  // namespace slabstream
