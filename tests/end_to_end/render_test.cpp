// `render --local` and `turntable --local`: pictures of balls, whose look is known without a renderer.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <set>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

using testing::Contains;
using testing::Each;

constexpr int kVoxels = 48;  // a side of the ball's volume
constexpr int kPixels = 96;  // a side of the pictures
// MakeSphere's ball fills 30 % of the cube; at zoom 1 the picture's side is the diagonal of the cube.
const double kBallRadius = std::cbrt(0.3 * 3 / (4 * std::numbers::pi)) * kVoxels;  // voxels
const double kPixelsPerVoxel = kPixels / (kVoxels * std::sqrt(3.0));
const double kBallPixels = kBallRadius * kPixelsPerVoxel;

class RenderTest : public EndToEndTest {
 protected:
  RenderTest() : ball_(MakeSphere("ball.nrrd", 2, kVoxels)) {}

  // Renders the ball, opaque and unshaded. The view is along y unless `more` says something else, and shows the whole volume.
  PictureFile Render(const std::string& output, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"render",     ball_,    "-o",        output, "--size", std::to_string(kPixels),
                                          "--transfer", "opaque", "--shading", "none"};
    if (std::none_of(more.begin(), more.end(), [](const std::string& s) { return s.rfind("--local", 0) == 0; }))
      more.push_back("--local=2");
    for (const char* angle : {"--azimuth", "--elevation"}) {
      if (std::ranges::find(more, angle) == more.end()) arguments.insert(arguments.end(), {angle, "0"});
    }
    arguments.emplace_back("--no-fit");
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path(output));
  }

  std::string ball_;
};

// Distance of a pixel's centre from the picture's.
double FromCentre(int x, int y) { return std::hypot(x + 0.5 - kPixels / 2.0, y + 0.5 - kPixels / 2.0); }

// Alpha is 1 inside the ball's outline and 0 outside, but for `margin` pixels on either side of it.
void ExpectSilhouette(const PictureFile& picture, double margin) {
  ASSERT_EQ(picture.width, kPixels);
  ASSERT_EQ(picture.height, kPixels);
  for (int y = 0; y < kPixels; ++y) {
    for (int x = 0; x < kPixels; ++x) {
      const double distance = FromCentre(x, y);
      if (distance < kBallPixels - margin) {
        ASSERT_GT(picture.At(x, y, 3), 0.98) << x << ", " << y;
      } else if (distance > kBallPixels + margin) {
        ASSERT_EQ(picture.At(x, y, 3), 0) << x << ", " << y;
      }
    }
  }
}

TEST_F(RenderTest, SplattingFillsTheBallsSilhouetteWithItsColours) {
  const PictureFile picture = Render("ball.png");
  ExpectSilhouette(picture, 3 * kPixelsPerVoxel);  // a voxel's footprint reaches as far
  // Values rise along +x, which points to the right, and so does red in this transfer function: 0.55 at 0 to 0.97 at 255.
  const auto red = [&](double voxels_right) { return picture.At(int(kPixels / 2.0 + voxels_right * kPixelsPerVoxel), kPixels / 2, 0); };
  EXPECT_NEAR(red(0), 0.55 + (0.97 - 0.55) * 191.5 / 255, 0.03);
  EXPECT_LT(red(-12) + 0.03, red(0));
  EXPECT_LT(red(0) + 0.03, red(12));
}

TEST_F(RenderTest, ZBufferFindsTheBallsSurfaceAtItsDepth) {
  const PictureFile picture = Render("ball.exr", {"--renderer", "zbuffer"});
  ASSERT_EQ(picture.channels, (std::vector<std::string>{"R", "G", "B", "A", "Z"}));
  ExpectSilhouette(picture, 2 * kPixelsPerVoxel);
  const double bounding_radius = kVoxels * std::sqrt(3.0) / 2;  // the eye plane stands twice that before the centre
  for (const int x : {kPixels / 2, kPixels / 2 - 12, kPixels / 2 + 12}) {
    const double aside = FromCentre(x, kPixels / 2) / kPixelsPerVoxel;
    EXPECT_NEAR(picture.At(x, kPixels / 2, 4), 2 * bounding_radius - std::sqrt(kBallRadius * kBallRadius - aside * aside), 1.5) << x;
  }
  EXPECT_EQ(picture.At(0, 0, 4), std::numeric_limits<float>::infinity());
}

TEST_F(RenderTest, WorkersGroupsAxesAndSchemesDoNotChangeThePicture) {
  const std::vector<std::vector<std::string>> policies = {{"--local=2", "--groups", "2"},
                                                          {"--local=3", "--groups", "3", "--axis", "x"},
                                                          {"--local=2", "--groups", "auto"},
                                                          {"--local=5", "--axis", "y", "--combine", "centralized"}};
  for (const std::string renderer : {"splat", "zbuffer"}) {
    const PictureFile one = Render("one.exr", {"--local=1", "--renderer", renderer, "--azimuth", "33", "--elevation", "21"});
    for (std::vector<std::string> policy : policies) {
      policy.insert(policy.end(), {"--renderer", renderer, "--azimuth", "33", "--elevation", "21"});
      const PictureFile other = Render("other.exr", policy);
      EXPECT_LE(LargestDifference(one, other), renderer == "splat" ? 2e-5 + 1.0 / 1024 : 0.0) << renderer << " " << policy[0];
    }
  }
}

TEST_F(RenderTest, ShadowsAndAmbientOcclusionAreTheSameForAnyNumberOfWorkers) {
  for (const std::string renderer : {"splat", "raycast", "zbuffer"}) {
    const std::vector<std::string> look = {"--renderer", renderer, "--azimuth",           "33", "--light", "1,-1,2", "--light", "-1,0,1",
                                           "--shadows",  "0.9",    "--ambient-occlusion", "1"};
    const auto with = [&](const std::string& workers) {
      std::vector<std::string> options = look;
      options.push_back("--local=" + workers);
      return Render("of" + workers + ".exr", options);
    };
    const PictureFile one = with("1");
    for (const std::string workers : {"3", "8"}) {
      EXPECT_LE(LargestDifference(one, with(workers)), renderer == "zbuffer" ? 0.0 : 2e-5 + 1.0 / 1024) << renderer << ' ' << workers;
    }
    const PictureFile plain = Render("plain.exr", {"--renderer", renderer, "--azimuth", "33"});
    EXPECT_GT(LargestDifference(one, plain), 0.1) << renderer;
  }
}

TEST_F(RenderTest, ARendererWithoutShadowsSaysSoInOneLine) {
  ExpectEachRefused({"render", ball_, "-o", "no.png", "--local=1"},
                    {{{"--renderer", "mip", "--shadows", "1"}, "renderer is 'mip', but shadows needs one of: "},
                     {{"--shadows", "2"}, "--shadows 2 is out of range [0, 1]"}});
}

TEST_F(RenderTest, AngleOfViewTurnsThePicture) {
  // From behind, what was on the right is on the left.
  const PictureFile front = Render("front.exr"), back = Render("back.exr", {"--azimuth", "180"});
  const int off = int(12 * kPixelsPerVoxel);
  EXPECT_GT(front.At(kPixels / 2 + off, kPixels / 2, 0), front.At(kPixels / 2 - off, kPixels / 2, 0) + 0.03F);
  EXPECT_LT(back.At(kPixels / 2 + off, kPixels / 2, 0), back.At(kPixels / 2 - off, kPixels / 2, 0) - 0.03F);
  // Negative numbers are values, not options.
  EXPECT_LE(LargestDifference(back, Render("again.exr", {"--azimuth", "-180"})), 1e-5);
}

TEST_F(RenderTest, BackgroundAndSixteenBitsReachTheFile) {
  const PictureFile picture = Render("ball.png", {"--background", "0.25,0.5,0.75", "--depth", "16"});
  EXPECT_NEAR(picture.At(0, 0, 0), 0.25, 1.0 / 65535);
  EXPECT_NEAR(picture.At(0, 0, 2), 0.75, 1.0 / 65535);
  EXPECT_EQ(picture.At(0, 0, 3), 1);
}

TEST_F(RenderTest, AnOptionHasTheSameMeaningInEachOfItsSpellings) {
  Render("a.png", {"--no-record"});  // which names the policy
  const std::string picture = ReadFile("a.png");
  const std::vector<std::vector<std::string>> spellings = {
      {ball_, "--local", "2", "--transfer", "opaque"},
      {"--local", "2", ball_, "--transfer", "opaque"},
      {"--local", ball_, "--transfer", "opaque"},
      {ball_ + ":opaque", "--local"},
      {ball_, "--transfer", "opaque", "--local=2", "--balance-by", "voxels", "--teams", "1"},
  };
  for (std::vector<std::string> arguments : spellings) {
    arguments.insert(arguments.begin(), "render");
    const std::vector<std::string> rest = {"-o",          "b.png",     "--size", std::to_string(kPixels), "--shading", "none",
                                           "--no-record", "--azimuth", "0",      "--elevation",           "0",         "--no-fit"};
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    MustRun(arguments);
    EXPECT_EQ(ReadFile("b.png"), picture) << arguments[1] << " " << arguments[2];
  }
  EXPECT_EQ(Slabstream({"render", ball_ + ":opaque", "--transfer", "auto", "--local", "-o", "c.png"}).exit_status, 2);
}

TEST_F(RenderTest, AnnotationsChangeNoPixelBesideThem) {
  const std::vector<std::string> annotated = {"--scale-bar", "--orientation-marker", "--title", "B\xC3\xA4ll"};
  for (const std::string name : {"a.png", "a.exr"}) {
    const PictureFile plain = Render("plain" + name.substr(1)), with = Render(name, annotated);
    ASSERT_EQ(plain.samples.size(), with.samples.size());
    int changed = 0;
    for (int y = 0; y < kPixels; ++y) {
      for (int x = 0; x < kPixels; ++x) {
        bool same = true;
        for (std::size_t c = 0; c < plain.channels.size(); ++c) same = same && plain.At(x, y, c) == with.At(x, y, c);
        changed += same ? 0 : 1;
        const bool free = x > 3 * kPixels / 4 && y > kPixels / 4 && y < 2 * kPixels / 3;  // below the title, beside the axes, above the bar
        EXPECT_TRUE(same || !free) << x << " " << y;
      }
    }
    EXPECT_GT(changed, 200) << name;
  }
}

TEST_F(RenderTest, APictureTellsTheCommandLineThatMakesItAgain) {
  const std::vector<std::string> more = {"--azimuth", "-33.3", "--projection", "perspective", "--scale-bar", "--title", "It's a ball",
                                         "--depth",   "16",    "--background", "0.1,0.2,0.3", "--renderer",  "zbuffer"};
  Render("a.png", more);
  const std::string text = MustRun({"info", "a.png"}).out;
  for (const char* line : {"format       PNG\n", "size         96 x 96 pixels\n", "samples      uint16: R, G, B, A\n", "source       ",
                           "view.azimuth_degrees         -33.3\n", "'It'\\''s a ball'"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
  const Json info = Json::Parse(MustRun({"info", "a.png", "--json"}).out).value();
  EXPECT_EQ(info["size"], (std::vector<int>{96, 96}));
  EXPECT_EQ(info["source"], ball_);
  EXPECT_EQ(info["geometry"]["unit"], "voxel");
  MustRun(info["command"].get<std::vector<std::string>>());
  EXPECT_EQ(ReadFile("again.png"), ReadFile("a.png")) << "down to the last byte";

  // The same as the shell reads it.
  const std::string command = text.substr(text.find("  slabstream render"), text.rfind('\n') - text.find("  slabstream render"));
  std::filesystem::remove(Path("again.png"));
  const std::string program = Command({}).front();
  const std::string folder = program.substr(0, program.rfind('/'));
  ASSERT_EQ(std::system(("cd '" + directory_ + "' && PATH='" + folder + "':$PATH && " + command + " > /dev/null").c_str()), 0);
  EXPECT_EQ(ReadFile("again.png"), ReadFile("a.png"));

  Render("none.png", {"--no-record"});
  EXPECT_THAT(MustRun({"info", "none.png"}).out, HasSubstr("not known: the file holds no record"));
  EXPECT_FALSE(Json::Parse(MustRun({"info", "none.png", "--json"}).out).value().contains("source"));
}

TEST_F(RenderTest, AFontThatIsNotThereIsToldBeforeTheWorkBegins) {
  ::setenv("SLABSTREAM_FONT", "no.ttf", 1);
  const ProgramResult result = Slabstream({"render", ball_, "--local=1", "--scale-bar", "-o", "x.png"});
  ::unsetenv("SLABSTREAM_FONT");
  EXPECT_EQ(result.exit_status, 2);
  EXPECT_EQ(result.err, "slabstream render: $SLABSTREAM_FONT names 'no.ttf', which is no file\n");
  EXPECT_THAT(Files(), Not(Contains("x.png")));
}

TEST_F(RenderTest, AFontBesideTheProgramComesFirst) {
  std::filesystem::copy_file(Command({}).front(), Path("slabstream"));
  std::ofstream(Path("DejaVuSans-Bold.ttf")) << "this is no font";
  const std::string order = R"({"size": [64, 64], "panes": [{}], "title": "x"})";
  const ProgramResult result = RunningProgram({"/bin/sh", "-c", "echo '" + order + "' | ./slabstream annotate"}, directory_).Wait();
  EXPECT_EQ(result.exit_status, 2);
  EXPECT_EQ(result.err, "slabstream annotate: the font '" + Path("DejaVuSans-Bold.ttf") + "' cannot be read\n");
}

// Copied without libslabstream-pictures.so, the program writes what it encodes itself. Of other files it says so before it makes a picture,
// but after it has looked at its arguments and files.
TEST_F(RenderTest, AnEncoderThatIsNotThereIsToldBeforeTheWorkBegins) {
  std::filesystem::copy_file(Command({}).front(), Path("slabstream"));
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), Path("slabstream"));
    arguments.insert(arguments.end(), {"--local=1", "--size", "16"});
    return RunningProgram(arguments, directory_).Wait();
  };
  for (const std::string name : {"a.png", "a.jpg", "a.webp"}) EXPECT_EQ(run({"render", ball_, "-o", name}).exit_status, 0) << name;
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"render", ball_, "-o", "a.exr"},
                                                    {"turntable", ball_, "--frames", "2", "-o", "a%d.tif"},
                                                    {"slice", ball_, "-o", "a.pdf"}}) {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.exit_status, 1) << arguments[0];
    ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_THAT(result.err, HasSubstr("only .png, .jpg and .webp can be written: libslabstream-pictures.so: ")) << arguments[0];
  }
  const ProgramResult missing = run({"render", "missing.nrrd", "-o", "a.exr"});
  EXPECT_EQ(missing.exit_status, 2);
  EXPECT_THAT(missing.err, HasSubstr("missing.nrrd"));
}

TEST_F(RenderTest, SeveralSourcesMakeAPictureEach) {
  std::filesystem::copy_file(ball_, Path("other.nrrd"));
  std::filesystem::copy_file(ball_, Path("ball two.nrrd"));
  MustRun({"render", ball_, "other.nrrd:opaque", "ball two.nrrd", "--local=1", "--size", "20", "-o", "{name}.png", "--stats", "{name}.json",
           "--no-record"});
  for (const std::string name : {"ball", "other", "ball_two"}) {
    EXPECT_THAT(Files(), Contains(name + ".png"));
    EXPECT_THAT(Files(), Contains(name + ".json"));
  }
  EXPECT_EQ(ReadFile("ball.png"), ReadFile("ball_two.png"));
  EXPECT_NE(ReadFile("ball.png"), ReadFile("other.png")) << "another transfer function";

  // One that fails does not stop the others, and is named.
  std::filesystem::remove(Path("other.png"));
  std::ofstream(Path("broken.nrrd")) << "NRRD0004\nno header\n";
  const ProgramResult some =
      Slabstream({"render", "missing.nrrd", "broken.nrrd", "other.nrrd", "--local=1", "--size", "20", "-o", "{name}.png", "--progress"});
  EXPECT_EQ(some.exit_status, 2);
  EXPECT_THAT(some.out, HasSubstr("rendered other.png"));
  EXPECT_THAT(some.err_lines(), Contains(HasSubstr("slabstream render: SOURCE missing.nrrd: no such file")));
  EXPECT_THAT(some.err_lines(), Contains(HasSubstr("broken.nrrd")));
  EXPECT_THAT(some.err_lines(), Contains(HasSubstr("other.nrrd: frame 1 of 1: done")));
}

TEST_F(RenderTest, FilesOfSeveralSourcesNeedDifferentNames) {
  std::filesystem::create_directory(Path("more"));
  std::filesystem::copy_file(ball_, Path("more/ball.nrrd"));
  std::filesystem::copy_file(ball_, Path("other.nrrd"));
  const auto expect = [&](std::vector<std::string> arguments, const std::string& complaint) {
    arguments.insert(arguments.begin(), "render");
    arguments.insert(arguments.end(), {"--local=1", "--size", "20"});
    const ProgramResult result = Slabstream(arguments);
    EXPECT_EQ(result.exit_status, 2);
    EXPECT_THAT(result.err, HasSubstr(complaint));
    EXPECT_EQ(result.err_lines().size(), 1U);
  };
  const std::vector<std::string> before = Files();
  expect({ball_, "other.nrrd", "-o", "a.png"}, "--output 'a.png' has no place for {name}, which 2 SOURCEs need");
  expect({ball_, "other.nrrd", "-o", "{name}.png", "--trace", "t.json"}, "--trace 't.json' has no place for {name}");
  expect({ball_, "more/ball.nrrd", "-o", "{name}.png"}, "have the same name, ball, so their pictures would be one file");
  EXPECT_EQ(Files(), before) << "nothing was done";
  MustRun({"render", ball_, "--local=1", "--size", "20", "-o", "one-{name}.png"});
  EXPECT_THAT(Files(), Contains("one-ball.png"));
}

TEST_F(RenderTest, APictureWithoutAnythingToSeeIsEmpty) {
  const PictureFile picture = Render("ball.png", {"--zoom", "0.001"});
  EXPECT_EQ(picture.width, kPixels);
  EXPECT_LT(picture.At(0, 0, 3), 0.01);
}

TEST_F(RenderTest, SaysWhatItDidAndHowFarItIs) {
  const ProgramResult result = MustRun({"render", ball_, "--local=2", "--groups", "2", "-o", "ball.png", "--size", "40x30", "--progress"});
  EXPECT_THAT(result.out, HasSubstr("rendered ball.png 40x30 in "));
  EXPECT_THAT(result.out, HasSubstr(" ms (splat, frame ")) << "which renderer was chosen";
  EXPECT_THAT(result.err_lines(), Contains(HasSubstr("frame 1 of 1: done")));
  EXPECT_EQ(result.err.find('\r'), std::string::npos);  // no terminal, no bar
}

TEST_F(RenderTest, TurntableFramesAreTheRendersOfTheirAngles) {
  MustRun({"turntable", ball_, "--local=2", "-o", "t_%02d.exr", "--frames", "3", "--azimuth", "10", "--elevation", "0", "--no-fit",
           "--size", std::to_string(kPixels), "--transfer", "opaque", "--shading", "none"});
  const std::vector<std::string> angles = {"10", "130", "250"};
  for (std::size_t i = 0; i < 3; ++i) {
    const PictureFile frame = ReadPicture(Path("t_0" + std::to_string(i) + ".exr"));
    EXPECT_LE(LargestDifference(frame, Render("single.exr", {"--azimuth", angles[i]})), 1e-5) << angles[i];
  }
}

TEST_F(RenderTest, StatisticsShowThatVoxelsTravelOnce) {
  MustRun({"turntable", ball_, "--local=2", "--groups", "2", "-o", "t_%d.png", "--frames", "4", "--in-flight", "1", "--size", "64",
           "--stats", "stats.json", "--trace", "trace.json"});
  const Json stats = Json::Parse(ReadFile("stats.json")).value();
  EXPECT_EQ(stats["plan"]["workers"], 2);
  EXPECT_EQ(stats["plan"]["groups"], 2);
  EXPECT_EQ(stats["plan"]["decomposition"], "kd-tree");
  EXPECT_EQ(stats["plan"]["balance_by"], "bricks");
  EXPECT_EQ(stats["plan"]["assignment"], "cyclic");
  EXPECT_EQ(stats["plan"]["balance"], "static");
  EXPECT_EQ(stats["plan"]["combine"], "fan-in");
  ASSERT_EQ(stats["frames"].size(), 4U);
  EXPECT_GE(stats["bytes"]["voxels"].get<double>(), kVoxels * kVoxels * kVoxels / 4);  // those with something to see, at least
  EXPECT_EQ(stats["frames"][0]["bytes"]["voxels"], stats["bytes"]["voxels"]);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(stats["frames"][i]["bytes"]["voxels"], 0) << i;
  for (const Json& frame : stats["frames"]) {
    EXPECT_GT(frame["latency_ms"].get<double>(), 0.0);
    EXPECT_GT(frame["stages_ms"]["render"].get<double>(), 0.0);
    EXPECT_GE(frame["imbalance"].get<double>(), 1.0);
    EXPECT_GE(frame["idle_share"].get<double>(), 0.0);
    EXPECT_LE(frame["idle_share"].get<double>(), 1.0);
  }

  const Json trace = Json::Parse(ReadFile("trace.json")).value();
  std::set<int> processes;
  std::set<std::string> names;
  for (const Json& event : trace["traceEvents"]) {
    if (event["ph"] != "X") continue;
    processes.insert(event["pid"].get<int>());
    names.insert(event["name"].get<std::string>());
  }
  EXPECT_EQ(processes.size(), 3U);  // the frames, and two workers
  EXPECT_THAT(names, Contains("render"));
  EXPECT_THAT(names, Contains("combine"));
}

TEST_F(RenderTest, CtrlCEndsATurntableAndLeavesOnlyWholePictures) {
  RunningProgram program(Command({"turntable", ball_, "--local=2", "-o", "t_%05d.png", "--frames", "100000", "--size", "64", "--progress"}),
                         directory_);
  ASSERT_TRUE(program.WaitForError("frame 3 of 100000: done"));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_status, 130);
  EXPECT_EQ(result.err_lines().back(), "slabstream turntable: interrupted");
  EXPECT_THAT(Files(), Each(Not(HasSubstr(".tmp"))));
  EXPECT_EQ(ReadPicture(Path("t_00000.png")).width, 64);
}

}  // namespace
}  // namespace slabstream
