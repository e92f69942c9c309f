// Unstructured grids: from the file to the picture, alone and by a service.
#include <gmock/gmock.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/json/json.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

constexpr int kPixels = 64;

class GridTest : public EndToEndTest {
 protected:
  GridTest() {
    Write("grid.vtu", VtuFile(SmallGrid()));
    Write("grid.vtk", LegacyGridFile(SmallGrid()));
  }

  void Write(const std::string& name, const FileBytes& bytes) const {
    std::ofstream(Path(name), std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  }

  PictureFile Render(const std::string& source, const std::string& output, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"render", source, "-o", output, "--size", std::to_string(kPixels), "--renderer", "slice"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path(output));
  }
};

double MeanAlpha(const PictureFile& picture) {
  double sum = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) sum += double(picture.At(x, y, 3));
  }
  return sum / (kPixels * kPixels);
}

TEST_F(GridTest, InfoTellsCellsBoundsAndArrays) {
  for (const char* file : {"grid.vtu", "grid.vtk"}) {
    const Json info = Json::Parse(MustRun({"info", file, "--json"}).out).value();
    EXPECT_EQ(info["cells"], 4);
    EXPECT_EQ(info["kinds"]["wedge"], 2);
    EXPECT_EQ(info["bounds"]["high"], (Json{2.0, 1.0, 2.0}));
    EXPECT_GE(info["arrays"].size(), 1U);
    EXPECT_THAT(MustRun({"info", file, "--lattice", "40"}).out, HasSubstr("40 x 20 x 40 voxels"));
  }
}

TEST_F(GridTest, BenchMeasuresAndExportsIt) {
  MustRun({"bench", "grid.vtu", "--renderer", "slice", "--sampling-rate", "2", "--size", "24", "--frames", "1", "--turns", "1", "--json",
           "report.json"});
  const Json measured = Json::Parse(ReadFile("report.json")).value()["cases"][0];
  EXPECT_EQ(measured["renderer"], "slice");
  EXPECT_EQ(measured["parameters"], (Json{{"sampling-rate", "2"}}));

  MustRun({"bench", "grid.vtu", "--renderer", "slice", "--export", "scenes"});
  const Json scene = Json::Parse(ReadFile("scenes/grid-auto.scene.json")).value();
  EXPECT_EQ(scene["grid"]["file"], Path("grid.vtu"));
  EXPECT_EQ(scene["grid"]["array"], "");

  const ProgramResult refused = Slabstream({"bench", "grid.vtu", "--renderer", "splat", "--sampling-rate", "2"});
  EXPECT_EQ(refused.exit_status, 2);
  EXPECT_EQ(refused.err_lines().size(), 1U) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("sampling-rate"));
}

TEST_F(GridTest, AnyNumberOfWorkersDrawsTheSameCells) {
  const PictureFile alone = Render("grid.vtu", "alone.exr", {"--local=1", "--elevation", "20", "--azimuth", "30"});
  EXPECT_GT(MeanAlpha(alone), 0.05);
  const PictureFile legacy = Render("grid.vtk", "legacy.exr", {"--local=2", "--elevation", "20", "--azimuth", "30"});
  EXPECT_LE(LargestDifference(alone, legacy), 2e-5 + 1.0 / 1024);
  MustRun({"up", "--workers", "3", "--listen", "ipc://" + Path("s"), "--data", "g=" + Path("grid.vtu"), "--detach"});
  const PictureFile served = Render("g", "served.exr", {"--elevation", "20", "--azimuth", "30", "--decomposition", "kd-tree"});
  EXPECT_LE(LargestDifference(alone, served), 2e-5 + 1.0 / 1024);
  // One worker less: the others fetch its cells.
  const Json status = Json::Parse(MustRun({"status", "--json"}).out).value();
  ASSERT_EQ(::kill(status["workers"][0]["pid"].get<pid_t>(), SIGKILL), 0);
  const PictureFile after = Render("g", "after.exr", {"--elevation", "20", "--azimuth", "30", "--decomposition", "kd-tree"});
  EXPECT_LE(LargestDifference(alone, after), 2e-5 + 1.0 / 1024);
  // The same service shows it on the lattice.
  MustRun({"render", "g", "-o", "lattice.png", "--renderer", "raycast", "--size", "32"});
  EXPECT_EQ(Json::Parse(MustRun({"value", "g", "--at", "0.5,0.5,0.5", "--json"}).out).value()[0]["inside"], true);
  MustRun({"down"});
}

TEST_F(GridTest, CellsThatAreKeptOnDiskAreTheSame) {
  const std::vector<std::string> view = {"--local=2", "--elevation", "20", "--azimuth", "30", "--array", "height"};
  const std::string info = MustRun({"info", "grid.vtu", "--array", "height", "--json"}).out;
  const PictureFile held = Render("grid.vtu", "held.exr", view);
  const ProgramResult kept = MustRun({"index", "grid.vtu", "--array", "height", "--progress"});
  EXPECT_THAT(kept.out, HasSubstr("keeps the cells of grid.vtu"));
  EXPECT_THAT(kept.err, HasSubstr("sorting the cells of grid.vtu: "));
  EXPECT_EQ(MustRun({"info", "grid.vtu", "--array", "height", "--json"}).out, info);
  EXPECT_THAT(MustRun({"info", "grid.vtu", "--array", "height"}).out, HasSubstr("kept on disk"));
  EXPECT_EQ(LargestDifference(held, Render("grid.vtu", "kept.exr", view)), 0);
}

// Two pieces, each with a layer of ghost cells of the other one, which must not be drawn.
TEST_F(GridTest, PiecesAreDrawnAsOneGrid) {
  const auto place = [](const Vec3& number) { return number; };
  Write("whole.vtu", VtuFile(BoxOfHexahedra({}, {4, 2, 2}, place)));
  for (const int low : {0, 1}) {
    VtuSpec piece = BoxOfHexahedra({low, 0, 0}, {low + 3, 2, 2}, place);
    std::vector<double> ghosts;
    for (int cell = 0; cell < piece.cells; ++cell) ghosts.push_back(cell % 3 == (low == 0 ? 2 : 0) ? 1 : 0);
    piece.arrays.insert(piece.arrays.begin() + 1, {"CellData", "vtkGhostType", SampleType::kUint8, 1, ghosts});
    Write(low == 0 ? "a.vtu" : "b.vtu", VtuFile(piece));
  }
  Write("pieces.pvtu", VtkListFile("PUnstructuredGrid", {"a.vtu", "b.vtu"}));
  VtuSpec curvilinear = BoxOfHexahedra({}, {4, 2, 2}, place);
  curvilinear.extent = "0 4 0 2 0 2";
  Write("whole.vts", VtuFile(curvilinear));
  const std::vector<std::string> view = {"--local=2", "--elevation", "20", "--azimuth", "30"};
  const PictureFile whole = Render("whole.vtu", "whole.exr", view);
  EXPECT_GT(MeanAlpha(whole), 0.05);
  EXPECT_LE(LargestDifference(whole, Render("pieces.pvtu", "pieces.exr", view)), 2e-5 + 1.0 / 1024);
  EXPECT_EQ(LargestDifference(whole, Render("whole.vts", "curvilinear.exr", view)), 0);
  const Json info = Json::Parse(MustRun({"info", "pieces.pvtu", "--json"}).out).value();
  EXPECT_EQ(info["cells"], 16);
  EXPECT_EQ(info["points"], 5 * 3 * 3);
  EXPECT_THAT(MustRun({"info", "pieces.pvtu"}).out, HasSubstr("8 cells are left out"));
  std::filesystem::remove(Path("b.vtu"));
  ExpectEachRefused({"render", "-o", "x.png", "--local=1"}, {{{"pieces.pvtu"}, "b.vtu: cannot be opened for reading"}});
}

TEST_F(GridTest, ItsCellsAreDrawnUnlessARequestNamesARenderer) {
  MakeSphere("ball.nrrd", 2, 16);
  const auto render = [&](const std::string& source, const std::string& output, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"render", source, "-o", output, "--local=2", "--size", "64", "--azimuth", "30"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadFile(output);
  };
  const std::string cells = render("grid.vtu", "cells.png", {"--stats", "cells.json"});
  EXPECT_EQ(cells, render("grid.vtu", "sliced.png", {"--renderer", "slice"})) << "with their records";
  const std::string pixels = render("grid.vtu", "pixels.png", {"--no-record"});
  EXPECT_EQ(pixels, render("grid.vtu", "eight.png", {"--no-record", "--sampling-rate", "8"}));
  EXPECT_NE(pixels, render("grid.vtu", "one.png", {"--no-record", "--sampling-rate", "1"}));
  EXPECT_EQ(Json::Parse(ReadFile("cells.json")).value()["renderer"], "slice");
  EXPECT_THAT(MustRun({"info", "cells.png"}).out, HasSubstr("--renderer slice"));
  EXPECT_EQ(render("ball.nrrd", "surface.png", {"--isovalue", "128"}),
            render("ball.nrrd", "raycast.png", {"--isovalue", "128", "--renderer", "raycast"}));
  EXPECT_EQ(render("grid.vtu", "lattice.png", {"--kernel", "linear"}),
            render("grid.vtu", "shear.png", {"--kernel", "linear", "--renderer", "shear"}));
  EXPECT_EQ(render("ball.nrrd", "ball.png", {"--renderer", "auto"}), render("ball.nrrd", "splat.png", {"--renderer", "splat"}));
  ExpectEachRefused({"render", "-o", "x.png", "--local=1"},
                    {{{"grid.vtu", "--sampling-rate", "17"}, "sampling-rate"},
                     {{"grid.vtu", "--kernel", "linear", "--isovalue", "1"},
                      "no renderer does all that is asked: isovalue needs one of: raycast, zbuffer; kernel needs one of: shear"}});
}

TEST_F(GridTest, WhatCannotBeDrawnIsRefused) {
  MakeSphere("ball.nrrd", 2, 16);
  ExpectEachRefused({"render", "-o", "x.png", "--local=1", "--renderer", "slice"},
                    {{{"ball.nrrd"}, "draws the cells of unstructured grids"},
                     {{"grid.vtu", "--array", "none"}, "has no array 'none'"},
                     {{"grid.vtu", "--lattice", "2000"}, "[1, 1024]"},
                     {{"grid.vtu", "--channel", "1"}, "has no field '1': it has 0"},
                     {{"grid.vtu", "--isovalue", "1"}, "isovalue"},
                     {{"grid.vtu", "--sampling-rate", "0"}, "sampling-rate"}});
}

TEST_F(GridTest, ConvertWritesTheLattice) {
  MustRun({"convert", "grid.vtu?lattice=30", "lattice.nrrd"});
  const Json info = Json::Parse(MustRun({"info", "lattice.nrrd", "--json"}).out).value();
  EXPECT_EQ(info["size"], (Json{30, 15, 30}));
  EXPECT_GT(info["non_finite"].get<double>(), 0) << "outside the cells there is nothing";
}

}  // namespace
}  // namespace slabstream
