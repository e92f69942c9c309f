// Movies of `turntable`, and turntables over time. Most tests put a script in place of ffmpeg that keeps what it gets; the last ones take
// the real program where it is installed.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"
#include "tests/support/full_disk.h"

namespace slabstream {
namespace {

using testing::Contains;
using testing::ElementsAre;

constexpr int kPixels = 32;
constexpr std::size_t kFrameBytes = std::size_t{3} * kPixels * kPixels;

std::string PictureName(std::size_t number) { return std::string("p").append(std::to_string(number)).append(".png"); }

// Without the stand-in: where the real ffmpeg is; empty: nowhere.
std::string RealEncoder() {
  ProgramResult found = RunningProgram({"/bin/sh", "-c", "command -v ffmpeg"}, "/").Wait();
  return found.exit_status == 0 ? found.out.substr(0, found.out.find('\n')) : "";
}

class MovieTest : public EndToEndTest {
 protected:
  MovieTest() : ball_(MakeSphere("ball.nrrd", 2, 16)), path_(std::getenv("PATH")) {}
  ~MovieTest() override { ::setenv("PATH", path_.c_str(), 1); }

  // A script that is called in place of ffmpeg. $out is the file that it is to write.
  void StandIn(const std::string& script) {
    std::filesystem::create_directory(Path("bin"));
    const std::string program = Path("bin") + "/ffmpeg";
    std::ofstream(program) << "#!/bin/sh\nfor out; do :; done\nout=${out#file:}\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    ::setenv("PATH", (Path("bin") + ":" + path_).c_str(), 1);
  }
  void KeepFrames() { StandIn("printf '%s\\n' \"$@\" > arguments.txt; exec cat > \"$out\""); }

  std::vector<std::string> Turntable(const std::string& output, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"turntable", ball_, "--local=2", "-o", output, "--size", std::to_string(kPixels)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  // Frame `index` of the raw movie is the picture: the same codes, but for the rounding of one division.
  void ExpectFrame(const std::string& movie, std::size_t index, const PictureFile& picture) const {
    ASSERT_GE(movie.size(), (index + 1) * kFrameBytes);
    for (int y = 0; y < kPixels; ++y) {
      for (int x = 0; x < kPixels; ++x) {
        for (int c = 0; c < 3; ++c) {
          const std::size_t at = index * kFrameBytes + 3 * (std::size_t(y) * kPixels + std::size_t(x)) + std::size_t(c);
          ASSERT_NEAR(int(static_cast<unsigned char>(movie[at])), 255 * picture.At(x, y, std::size_t(c)), 1.01)
              << "frame " << index << ", pixel " << x << " " << y << ", channel " << c;
        }
      }
    }
  }

  // Volumes of 8^3 voxels, one for each value: a cube of 4^3 voxels of that value in the middle of zeros.
  std::string MakeSeries(const std::string& name, const std::vector<int>& values) const {
    constexpr int kSide = 8;
    std::string header = "{'descr': '|u1', 'fortran_order': False, 'shape': (" + std::to_string(values.size()) + ", 8, 8, 8), }";
    header.resize(118, ' ');
    std::string bytes("\x93NUMPY\x01\0\x76\0", 10);  // version 1.0, 118 bytes of header
    bytes += header;
    const auto inside = [](int i) { return i >= 2 && i < 6; };
    for (const int value : values) {
      for (int i = 0; i < kSide * kSide * kSide; ++i) {
        const bool full = inside(i % kSide) && inside(i / kSide % kSide) && inside(i / kSide / kSide);
        bytes += full ? char(value) : '\0';
      }
    }
    std::ofstream(Path(name), std::ios::binary) << bytes;
    return name;
  }

  const std::string ball_;
  const std::string path_;
};

TEST_F(MovieTest, FramesReachTheEncoderInTheirOrder) {
  KeepFrames();
  const std::vector<std::string> look = {"--frames", "7", "--in-flight", "4", "--background", "0.2,0.4,0.6", "--title", "x"};
  const ProgramResult result = MustRun(Turntable("movie.mp4", look));
  EXPECT_THAT(result.out, HasSubstr("rendered 7 frames, into movie.mp4, 32x32 in "));
  const std::string movie = ReadFile("movie.mp4");
  ASSERT_EQ(movie.size(), 7 * kFrameBytes);
  MustRun(Turntable("p%d.png", look));
  for (std::size_t i = 0; i < 7; ++i) ExpectFrame(movie, i, ReadPicture(Path(PictureName(i))));
  EXPECT_NE(movie.substr(0, kFrameBytes), movie.substr(kFrameBytes, kFrameBytes)) << "else the order would not show";

  const std::string arguments = ReadFile("arguments.txt");
  for (const char* part :
       {"-pixel_format\nrgb24\n-video_size\n32x32\n-framerate\n25\n-i\npipe:0\n", "\nlibx264\n", "\n-f\nmp4\n-y\nfile:"}) {
    EXPECT_THAT(arguments, HasSubstr(part));
  }
  EXPECT_EQ(Files(), (std::vector<std::string>{"arguments.txt", "ball.nrrd", "movie.mp4", "p0.png", "p1.png", "p2.png", "p3.png", "p4.png",
                                               "p5.png", "p6.png"}));
}

TEST_F(MovieTest, BehindAMovieLiesBlackUnlessItSaysOtherwise) {
  KeepFrames();
  const auto corner = [&](const std::vector<std::string>& background) {
    std::vector<std::string> more = {"--frames", "1", "--fps", "12.5"};
    more.insert(more.end(), background.begin(), background.end());
    MustRun(Turntable("movie.webm", more));
    const std::string movie = ReadFile("movie.webm");
    return std::vector<int>{static_cast<unsigned char>(movie.at(0)), static_cast<unsigned char>(movie.at(1)),
                            static_cast<unsigned char>(movie.at(2))};
  };
  EXPECT_THAT(corner({}), ElementsAre(0, 0, 0));
  EXPECT_THAT(corner({"--background", "#ff8040"}), ElementsAre(255, 128, 64));
  EXPECT_THAT(corner({"--background", "1,1,1,0.5"}), ElementsAre(128, 128, 128)) << "half of it, over black";
  EXPECT_THAT(ReadFile("arguments.txt"), HasSubstr("-framerate\n12.5\n"));
}

TEST_F(MovieTest, WorkersDoNotChangeAByte) {
  KeepFrames();
  std::string first;
  for (const char* workers : {"--local=1", "--local=3", "--local=5"}) {
    MustRun(
        {"turntable", ball_, workers, "-o", "movie.gif", "--size", "40x30", "--renderer", "zbuffer", "--frames", "6", "--in-flight", "5"});
    const std::string movie = ReadFile("movie.gif");
    if (first.empty()) first = movie;
    EXPECT_EQ(movie.size(), 6U * 3 * 40 * 30);
    EXPECT_EQ(movie, first) << workers;
  }
}

TEST_F(MovieTest, AnEncoderThatDiesIsTheErrorAndTheOlderMovieStays) {
  std::ofstream(Path("movie.mp4")) << "older";
  const std::vector<std::string> before = {"ball.nrrd", "movie.mp4"};
  const auto expect = [&](const std::string& script, const std::string& why, const char* frames = "50") {
    StandIn(script);
    const ProgramResult result = Slabstream(Turntable("movie.mp4", {"--frames", frames}));
    EXPECT_EQ(result.exit_status, 1) << script;
    EXPECT_THAT(result.err_lines(), ElementsAre("slabstream turntable: cannot write 'movie.mp4': ffmpeg " + why)) << script;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(Files(), before) << script;
    EXPECT_EQ(ReadFile("movie.mp4"), "older");
  };
  expect("head -c 5000 > \"$out\"; echo early >&2; echo 'no luck today' >&2; exit 3", "exited with status 3: no luck today");
  expect("kill -9 $$", "was killed by signal 9");
  expect("cat > \"$out\"; echo >&2 'no room for the end'; exit 1", "exited with status 1: no room for the end", "2");
  expect("exit 0", "exited with status 0");
  // One that ends well, but has not read everything: the frames fit the connection's buffer.
  expect("head -c 4000 > \"$out\"; exit 0", "ended before it had read all frames", "2");
}

TEST_F(MovieTest, AFullDiskKeepsTheOlderMovie) {
  KeepFrames();
  MustRun(Turntable("movie.mp4", {"--frames", "1"}));
  const std::string before = ReadFile("movie.mp4");
  const ProgramResult result = OnFullDisk(5000, [&] { return Slabstream(Turntable("movie.mp4", {"--frames", "20"})); });
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.err, HasSubstr("cannot write 'movie.mp4': ffmpeg exited with status 1: cat: "));
  EXPECT_THAT(result.err, HasSubstr("File too large"));
  EXPECT_EQ(ReadFile("movie.mp4"), before);
  EXPECT_EQ(Files(), (std::vector<std::string>{"arguments.txt", "ball.nrrd", "movie.mp4"}));
}

TEST_F(MovieTest, WithoutAnEncoderTheFirstLineSaysWhatToInstall) {
  ::setenv("PATH", Path("nowhere").c_str(), 1);
  const ProgramResult result = Slabstream(Turntable("movie.mp4", {"--frames", "2"}));
  EXPECT_EQ(result.exit_status, 2);
  EXPECT_THAT(result.err_lines(),
              ElementsAre("slabstream turntable: --output 'movie.mp4': the program ffmpeg, which makes movies, is not in "
                          "$PATH (Debian package ffmpeg)"));
  EXPECT_THAT(Files(), ElementsAre("ball.nrrd"));
}

// The encoder reads nothing, so that a frame is stuck on its way to it: Ctrl-C ends both, and pictures have not piled up meanwhile.
TEST_F(MovieTest, CtrlCEndsAMovieThatIsStuck) {
  std::ofstream(Path("movie.mp4")) << "older";
  ASSERT_EQ(::mkfifo(Path("pid").c_str(), 0600), 0);  // whoever reads it waits until the encoder runs
  StandIn("echo $$ > pid; exec tail -f /dev/null");
  RunningProgram program(Command({"turntable", ball_, "--local=2", "-o", "movie.mp4", "--size", "512", "--frames", "100000", "--in-flight",
                                  "2", "--progress"}),
                         directory_);
  ASSERT_TRUE(program.WaitForError("frame 3 of 100000: done"));
  const pid_t encoder = std::stoi(ReadFile("pid"));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_status, 130);
  const std::vector<std::string> lines = result.err_lines();
  EXPECT_EQ(lines.back(), "slabstream turntable: interrupted");
  const auto done = std::ranges::count_if(lines, [](const std::string& line) { return line.ends_with(": done"); });
  EXPECT_LE(done, 2 + 2) << "open frames, and those that wait or are stuck";
  EXPECT_EQ(Files(), (std::vector<std::string>{"ball.nrrd", "movie.mp4"}));
  EXPECT_EQ(ReadFile("movie.mp4"), "older");
  EXPECT_NE(::kill(encoder, 0), 0) << "the encoder still runs";
}

TEST_F(MovieTest, CtrlCEndsAnEncoderThatDoesNotEnd) {
  StandIn("cat > \"$out\"; echo 'all read' > read.txt; exec tail -f /dev/null");
  RunningProgram program(Command(Turntable("movie.mp4", {"--frames", "2", "--progress"})), directory_);
  ASSERT_TRUE(program.WaitForError("frame 2 of 2: done"));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_status, 130) << result.err;
  EXPECT_THAT(Files(), Not(Contains("movie.mp4")));
}

TEST_F(MovieTest, WhatAMovieCannotBeIsRefusedBeforeTheWorkBegins) {
  KeepFrames();
  const std::vector<Refusal> cases = {
      {{"-o", "m.mp4", "--size", "301x300"}, "--size 301x300: width and height of .mp4 must be even, as in 302x300"},
      {{"-o", "m.MP4", "--size", "11"}, "--size 11x11: width and height of .mp4 must be even, as in 12x12"},
      {{"-o", "m.gif", "--fps", "60"}, "--fps 60 is out of range [0.1, 50] for .gif"},
      {{"-o", "m.mp4", "--fps", "121"}, "--fps 121 is out of range [0.1, 120]"},
      {{"-o", "m.mp4", "--fps", "0"}, "--fps 0 is out of range [0.1, 120]"},
      {{"-o", "%d.png", "--fps", "10"}, "--fps 10 is for movies (.mp4, .webm or .gif), but --output '0.png' names pictures"},
      {{"-o", "m_%d.mp4"}, "-o 'm_%d.mp4' has a place for a number, but a movie is one file"},
      {{"-o", "m.avi"}, "-o 'm.avi' has no place for the frame's number; it needs one number such as %04d, or the ending of a movie: .mp4"},
      {{"-o", "no/m.mp4"}, "--output 'no/m.mp4': the directory 'no' does not exist"},
      {{"-o", "m.mp4", "--eye", "1,2,3"}, "--eye fixes the viewpoint"},
      {{"-o", "m.mp4", "--stats", "no/s.json"}, "--stats 'no/s.json'"},
  };
  ExpectEachRefused({"turntable", ball_, "--local=1", "--frames", "2"}, cases);
  // What only the frames' own start finds: the encoder was started, and nothing is left of it.
  EXPECT_EQ(Slabstream({"turntable", "no.nrrd", "--local=1", "--frames", "2", "-o", "m.mp4"}).exit_status, 2);
  const std::vector<std::string> files = Files();
  EXPECT_THAT(files, Not(Contains(HasSubstr(".tmp"))));
  EXPECT_THAT(files, Not(Contains("m.mp4")));
}

TEST_F(MovieTest, OverTimeEachFrameShowsItsVolume) {
  KeepFrames();
  const std::string series = MakeSeries("series.npy", {50, 100, 200});
  const std::vector<std::string> look = {"--local=2",      "--size", std::to_string(kPixels), "--renderer", "mip", "--transfer", "window",
                                         "--scalar-range", "0:200",  "--background",          "black"};
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), look.begin(), look.end());
    MustRun(arguments);
  };
  // The view turns by a third of a turn from time to time.
  run({"turntable", series, "--time", "0:2", "-o", "movie.mp4"});
  const std::string movie = ReadFile("movie.mp4");
  ASSERT_EQ(movie.size(), 3 * kFrameBytes);
  for (int i = 0; i < 3; ++i) {
    run({"render", series, "--time", std::to_string(i), "--azimuth", std::to_string(30 + 120 * i), "-o", "single.png"});
    ExpectFrame(movie, std::size_t(i), ReadPicture(Path("single.png")));
  }
  // It stands still, and five frames show two times.
  run({"turntable", series, "--time", "1:2", "--turns", "0", "--frames", "5", "--in-flight", "3", "-o", "still.mp4"});
  const std::string still = ReadFile("still.mp4");
  ASSERT_EQ(still.size(), 5 * kFrameBytes);
  std::vector<int> times;
  for (std::size_t i = 0; i < 5; ++i) {
    const std::string frame = still.substr(i * kFrameBytes, kFrameBytes);
    const auto brightest = std::ranges::max_element(frame, {}, [](char c) { return static_cast<unsigned char>(c); });
    times.push_back(static_cast<unsigned char>(*brightest) < 192 ? 1 : 2);
  }
  EXPECT_THAT(times, ElementsAre(1, 1, 1, 2, 2));
  // Pictures over time say which volume they show.
  run({"turntable", series, "--time", "0:2", "--turns", "0", "--eye", "0,-40,0", "-o", "p%d.png"});
  EXPECT_THAT(MustRun({"info", "p2.png"}).out, HasSubstr(" --time 2 "));
  // SOURCE may name the times itself.
  run({"turntable", series + "?time=0:2", "--turns", "0", "--eye", "0,-40,0", "-o", "s%d.png"});
  for (const std::string file : {"0.png", "1.png", "2.png"}) EXPECT_TRUE(ReadFile("p" + file) == ReadFile("s" + file)) << file;
  run({"turntable", series + "?time=1", "--frames", "1", "-o", "q%d.png"});
  run({"turntable", series, "--time", "1", "--frames", "1", "-o", "r%d.png"});
  EXPECT_EQ(LargestDifference(ReadPicture(Path("q0.png")), ReadPicture(Path("r0.png"))), 0);
  run({"turntable", series, "--time", "0:2:2", "--turns", "0", "--eye", "0,-40,0", "-o", "t%d.png"});
  EXPECT_TRUE(ReadFile("t0.png") == ReadFile("p0.png") && ReadFile("t1.png") == ReadFile("p2.png"));
  run({"turntable", series, "--time", "last", "--turns", "0", "--frames", "1", "--eye", "0,-40,0", "-o", "u%d.png"});
  EXPECT_EQ(LargestDifference(ReadPicture(Path("u0.png")), ReadPicture(Path("p2.png"))), 0);
}

// A cube that grows: no frame cuts it off, and it does not jump.
TEST_F(MovieTest, FramesFrameWhatShowsInAnyOfThem) {
  constexpr int kSide = 64;
  std::string header = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 64, 64, 64), }";
  header.resize(118, ' ');
  std::ofstream file(Path("growing.npy"), std::ios::binary);
  file << std::string("\x93NUMPY\x01\0\x76\0", 10) << header;
  for (const int end : {16, 48}) {
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      file.put(i % kSide < end && i / kSide % kSide < end && i / kSide / kSide < end ? char(200) : '\0');
    }
  }
  file.close();
  const auto camera = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(),
                     {"--local=1", "--size", "32", "--renderer", "raycast", "--transfer", "opaque", "--save-camera", "camera.json"});
    MustRun(arguments);
    return Json::Parse(ReadFile("camera.json")).value();
  };
  const auto first = camera({"render", "growing.npy", "--time", "0", "-o", "a.png"});
  const auto second = camera({"render", "growing.npy", "--time", "1", "-o", "b.png"});
  const auto both = camera({"turntable", "growing.npy", "--time", "0:1", "--turns", "0", "-o", "t%d.png"});
  EXPECT_GT(first["zoom"].get<double>(), 2 * second["zoom"].get<double>());
  EXPECT_EQ(both, second) << "the larger cube holds the smaller one";
  EXPECT_EQ(LargestDifference(ReadPicture(Path("t1.png")), ReadPicture(Path("b.png"))), 0);
}

TEST_F(MovieTest, APathMovesThroughItsCameras) {
  const std::vector<std::string> look = {"--local=1", "--size", "32", "--renderer", "zbuffer"};
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), look.begin(), look.end());
    return MustRun(arguments);
  };
  run({"render", ball_, "--azimuth", "10", "--save-camera", "a.json", "-o", "a.png"});
  run({"render", ball_, "--azimuth", "70", "--elevation", "40", "--zoom", "2", "--save-camera", "b.json", "-o", "b.png"});
  run({"render", ball_, "-o", "c.png"});
  const std::string a = ReadFile("a.json"), b = ReadFile("b.json");
  std::ofstream(Path("path.json")) << "[" << a << "," << b << ", {}]";
  run({"turntable", ball_, "--path", "path.json", "--frames", "5", "-o", "p%d.png"});
  EXPECT_EQ(LargestDifference(ReadPicture(Path("p0.png")), ReadPicture(Path("a.png"))), 0);
  EXPECT_EQ(LargestDifference(ReadPicture(Path("p2.png")), ReadPicture(Path("b.png"))), 0);
  EXPECT_EQ(LargestDifference(ReadPicture(Path("p4.png")), ReadPicture(Path("c.png"))), 0)
      << "what a camera leaves out is the default view's";
  EXPECT_GT(LargestDifference(ReadPicture(Path("p1.png")), ReadPicture(Path("a.png"))), 0.1);
  // Times say how many frames there are.
  std::ofstream(Path("timed.json")) << R"([{"time": 1, "azimuth": 10}, {"time": 1.5, "azimuth": 50}])";
  KeepFrames();
  EXPECT_THAT(run({"turntable", ball_, "--path", "timed.json", "--fps", "10", "-o", "m.mp4"}).out, HasSubstr("rendered 6 frames"));

  std::ofstream(Path("one.json")) << "[{}]";
  std::ofstream(Path("mixed.json")) << R"([{"projection": "perspective"}, {}])";
  std::ofstream(Path("wrong.json")) << R"([{}, {"zoom": -1}])";
  const std::vector<Refusal> cases = {
      {{"--path", "path.json"}, "--frames is required: the cameras of --path have no times"},
      {{"--path", "none.json", "--frames", "2"}, "--path"},
      {{"--path", "one.json", "--frames", "2"}, "--path one.json: a path is a list of 2 to 1000 cameras"},
      {{"--path", "wrong.json", "--frames", "2"}, "--path wrong.json: camera 2 of the path: zoom"},
      {{"--path", "mixed.json", "--frames", "2"}, "camera 2 of the path is orthographic, but the first one is perspective"},
      {{"--path", "path.json", "--frames", "2", "--turns", "2"}, "--turns"},
      {{"--path", "path.json", "--frames", "2", "--azimuth", "2"}, "--azimuth"},
      {{"--path", "path.json", "--frames", "2", "--no-fit"}, "--fit"},
  };
  ExpectEachRefused({"turntable", ball_, "--local=1", "-o", "p%d.png"}, cases);
}

TEST_F(MovieTest, AFrameThatFailsIsToldAndTheOthersAreRendered) {
  KeepFrames();
  const std::string endpoint = "ipc://" + Path("s");
  const std::string series = Path(MakeSeries("series.npy", {50, 100, 150, 200}));
  MustRun({"up", "--detach", "--workers", "1", "--listen", endpoint, "--data", "series=" + series + "?time=0:3"});
  MustRun({"data", "remove", "series@2"});
  const std::vector<std::string> frames = {"turntable",  "series", "--time",         "0:3",   "--turns", "0",  "--renderer",  "mip",
                                           "--transfer", "window", "--scalar-range", "0:200", "--size",  "32", "--in-flight", "1"};
  const auto run = [&](const std::string& output) {
    std::vector<std::string> arguments = frames;
    arguments.insert(arguments.end(), {"-o", output});
    return Slabstream(arguments);
  };
  ProgramResult result = run("p%d.png");
  EXPECT_NE(result.exit_status, 0);
  EXPECT_THAT(result.out, HasSubstr("rendered 3 frames"));
  ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
  EXPECT_THAT(result.err, HasSubstr("slabstream turntable: frame 3 of 4 (p2.png): no dataset \"series@2\""));
  EXPECT_THAT(Files(), testing::IsSupersetOf({"p0.png", "p1.png", "p3.png"}));
  EXPECT_THAT(Files(), Not(Contains("p2.png")));
  // In a movie, the frame before it stays for as long.
  result = run("movie.mp4");
  EXPECT_NE(result.exit_status, 0);
  const std::string movie = ReadFile("movie.mp4");
  ASSERT_EQ(movie.size(), 4 * kFrameBytes);
  EXPECT_EQ(movie.substr(2 * kFrameBytes, kFrameBytes), movie.substr(kFrameBytes, kFrameBytes));
  EXPECT_NE(movie.substr(3 * kFrameBytes, kFrameBytes), movie.substr(kFrameBytes, kFrameBytes));
  // What fails again and again ends it: it will not get better.
  MustRun({"data", "remove", "series@1"});
  MustRun({"data", "remove", "series@3"});
  result = run("q%d.png");
  EXPECT_EQ(result.err_lines().size(), 3U) << result.err;
  EXPECT_EQ(result.out, "");
}

TEST_F(MovieTest, AColourMeansTheSameValueAtAllTimes) {
  KeepFrames();
  const std::string series = MakeSeries("series.npy", {200, 50});
  MustRun({"turntable", series, "--time", "0:1", "--turns", "0", "--local=1", "--size", std::to_string(kPixels), "--renderer", "mip",
           "--transfer", "window", "-o", "movie.mp4"});
  const std::string movie = ReadFile("movie.mp4");
  ASSERT_EQ(movie.size(), 2 * kFrameBytes);
  const auto brightest = [&](std::size_t frame) {
    int most = 0;
    for (std::size_t i = 0; i < kFrameBytes; ++i) most = std::max(most, int(static_cast<unsigned char>(movie[frame * kFrameBytes + i])));
    return most;
  };
  EXPECT_NEAR(brightest(0), 255, 2);
  EXPECT_NEAR(brightest(1), 255 * 50 / 200, 2) << "the preset of the first volume, not one of its own";
}

TEST_F(MovieTest, AServiceShowsTheTimesOfAFileAsFilesDo) {
  KeepFrames();
  const std::string series = MakeSeries("series.npy", {200, 50, 100});
  MustRun({"up", "--detach", "--workers", "1", "--listen", "ipc://" + Path("s"), "--data", "beat=" + series + "?time=0:2"});
  const std::vector<std::string> look = {"--turns",    "0",   "--time",     "0:2",    "--size", std::to_string(kPixels),
                                         "--renderer", "mip", "--transfer", "window", "-o"};
  const auto movie = [&](std::vector<std::string> arguments, const std::string& file) {
    arguments.insert(arguments.begin(), "turntable");
    arguments.insert(arguments.end(), look.begin(), look.end());
    arguments.push_back(file);
    MustRun(arguments);
    return ReadFile(file);
  };
  // A time of the service has a range of its own, by which its values are scaled, so some round to the next code.
  const std::string service = movie({"beat"}, "service.mp4"), local = movie({series, "--local=1"}, "local.mp4");
  ASSERT_EQ(service.size(), local.size());
  int difference = 0;
  for (std::size_t i = 0; i < local.size(); ++i) {
    difference = std::max(difference, std::abs(int(static_cast<unsigned char>(service[i])) - int(static_cast<unsigned char>(local[i]))));
  }
  EXPECT_LE(difference, 1);
  const ProgramResult beyond = Slabstream({"turntable", "beat", "--time", "1:3", "-o", "f%d.png"});
  EXPECT_EQ(beyond.exit_status, 2) << beyond.err;
  EXPECT_THAT(beyond.err, HasSubstr("no dataset \"beat@3\": the catalogue has beat@0, beat@1, beat@2"));
  MustRun({"data", "remove", "beat"});
  EXPECT_THAT(MustRun({"data", "list"}).out, Not(HasSubstr("beat")));
}

TEST_F(MovieTest, TimesThatAreNotThereAreRefused) {
  const std::string series = MakeSeries("series.npy", {50, 100, 200});
  const std::vector<Refusal> cases = {
      {{series, "--local=1", "--time", "0:3"}, "series.npy: time is 3, must be in [0, 2]"},
      {{series, "--local=1", "--time", "2:1"}, "--time '2:1': FIRST must not be above LAST"},
      {{series, "--local=1", "--time", "0:1:0"}, "--time 0 is out of range [1, 1048576]"},
      {{series, "--local=1", "--time", "0:x"}, "--time '0:x'"},
      {{series, "--local=1", "--time", ":2"}, "--time ':2'"},
      {{series, "--local=1", "--time", "0:100000"}, "--time 0:100000 shows 100001 times, but at most 100000 --frames are possible"},
      {{series + "?time=1", "--local=1", "--time", "0:2"}, "time is given twice"},
      {{ball_, "--local=1", "--time", "0:2"}, "ball.nrrd: time is 2, must be in [0, 0]"},
      {{ball_, "--local=1"}, "--frames is required"},
  };
  ExpectEachRefused({"turntable", "-o", "p%d.png"}, cases);
}

// ---- the real program

class RealMovieTest : public MovieTest {
 protected:
  void SetUp() override {
    if (RealEncoder().empty()) GTEST_SKIP() << "install ffmpeg";
  }

  // What a player shows: all frames of the movie, as bytes of red, green and blue.
  std::string Decode(const std::string& movie) const {
    const ProgramResult result =
        RunningProgram({RealEncoder(), "-loglevel", "error", "-i", movie, "-pix_fmt", "rgb24", "-f", "rawvideo", "-y", "decoded.rgb"},
                       directory_)
            .Wait();
    EXPECT_EQ(result.exit_status, 0) << result.err;
    return ReadFile("decoded.rgb");
  }
};

TEST_F(RealMovieTest, EveryFormatShowsTheFrames) {
  const std::vector<std::string> look = {"--frames", "9", "--background", "0.1,0.3,0.5"};
  MustRun(Turntable("p%d.png", look));
  for (const std::string name : {"movie.mp4", "movie.webm", "movie.gif"}) {
    MustRun(Turntable(name, look));
    const std::string bytes = ReadFile(name);
    const std::string frames = Decode(name);
    ASSERT_EQ(frames.size(), 9 * kFrameBytes) << name;
    for (std::size_t i = 0; i < 9; ++i) {
      const PictureFile picture = ReadPicture(Path(PictureName(i)));
      double sum = 0;
      for (std::size_t at = 0; at < kFrameBytes; ++at) {
        const std::size_t pixel = at / 3;
        const double difference = double(static_cast<unsigned char>(frames[i * kFrameBytes + at])) -
                                  255 * picture.At(int(pixel % kPixels), int(pixel / kPixels), at % 3);
        sum += difference * difference;
      }
      EXPECT_LT(std::sqrt(sum / kFrameBytes), 12) << name << ", frame " << i << ": root of the mean square of the difference, of 255";
    }
    MustRun(Turntable(name, look));
    EXPECT_TRUE(ReadFile(name) == bytes) << name << " is not the same the second time";
  }
}

TEST_F(RealMovieTest, OddSidesAreFineWhereTheFormatHasThem) {
  for (const std::string name : {"movie.webm", "movie.gif"}) {
    MustRun({"turntable", ball_, "--local=1", "-o", name, "--size", "33x27", "--frames", "3"});
    EXPECT_EQ(Decode(name).size(), 3U * 3 * 33 * 27) << name;
  }
}

TEST_F(RealMovieTest, ItsLastLineTellsThatTheDiskIsFull) {
  const ProgramResult result = OnFullDisk(2000, [&] { return Slabstream(Turntable("movie.mp4", {"--frames", "30"})); });
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.err_lines().back(),
              testing::MatchesRegex("slabstream turntable: cannot write 'movie.mp4': ffmpeg exited with status .*: File too large"));
  EXPECT_THAT(Files(), ElementsAre("ball.nrrd"));
}

}  // namespace
}  // namespace slabstream
