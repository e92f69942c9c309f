// Rectilinear grids: from the file to values, slices and pictures.
#include <gmock/gmock.h>

#include <array>
#include <fstream>
#include <string>
#include <vector>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

const std::vector<double> kX = {0, 1, 3, 7}, kY = {0, 2, 2.5, 6, 6.25}, kZ = {-1, 0, 4};

// Linear along each axis, so it is what lies between any points that have its values.
double Value(double x, double y, double z) { return x + 2 * y + 3 * z + 0.5 * x * y; }

class RectilinearTest : public EndToEndTest {
 protected:
  RectilinearTest() {
    std::ofstream file(Path("grid.vtk"));
    file << "# vtk DataFile Version 3.0\ngrid\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 4 5 3\n";
    const auto write = [&](const char* axis, const std::vector<double>& coordinates) {
      file << axis << "_COORDINATES " << coordinates.size() << " double\n";
      for (const double at : coordinates) file << at << ' ';
      file << '\n';
    };
    write("X", kX);
    write("Y", kY);
    write("Z", kZ);
    file << "POINT_DATA 60\nSCALARS f float\nLOOKUP_TABLE default\n";
    for (const double z : kZ) {
      for (const double y : kY) {
        for (const double x : kX) file << Value(x, y, z) << '\n';
      }
    }
  }
};

TEST_F(RectilinearTest, ValuesLieBetweenTheGridsOwnPoints) {
  EXPECT_THAT(MustRun({"info", "grid.vtk"}).out, HasSubstr("the 5 voxels along y, 0.25 to 3.5 apart, lie at their own places"));
  std::vector<std::string> arguments = {"value", "grid.vtk", "--local", "--json"};
  const std::vector<std::array<double, 3>> points = {{0.5, 1, -0.5}, {5, 6.1, 3}, {2.25, 2.25, 0.125}, {7, 6.25, 4}};
  for (const auto& [x, y, z] : points) {
    arguments.emplace_back("--at");
    arguments.push_back(std::to_string(x) + "," + std::to_string(y) + "," + std::to_string(z));
  }
  const Json values = Json::Parse(MustRun(arguments).out).value();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [x, y, z] = points[i];
    EXPECT_NEAR(values[i]["interpolated"].get<double>(), Value(x, y, z), 1e-5) << i;
  }
}

TEST_F(RectilinearTest, AnyNumberOfWorkersDrawsTheSame) {
  for (const char* renderer : {"raycast", "mip"}) {
    const std::vector<std::string> render = {"render", "grid.vtk", "--size", "48", "--renderer", renderer, "--termination", "0"};
    std::vector<std::string> alone = render, shared = render;
    alone.insert(alone.end(), {"--local=1", "-o", "alone.exr"});
    shared.insert(shared.end(), {"--local=3", "-o", "shared.exr"});
    MustRun(alone);
    MustRun(shared);
    const PictureFile picture = ReadPicture(Path("alone.exr"));
    EXPECT_GT(picture.At(24, 24, 3), 0.01) << renderer;
    EXPECT_LE(LargestDifference(picture, ReadPicture(Path("shared.exr"))), 2e-5) << renderer;
  }
  MustRun({"slice", "grid.vtk", "--local", "--size", "48", "--plane", "z", "-o", "slice.png"});
}

TEST_F(RectilinearTest, EvenCoordinatesMakeAnImage) {
  const std::string head = "# vtk DataFile Version 3.0\ngrid\nASCII\nDATASET ", coordinates = " float\n0 0.5 1 1.5\n";
  std::string values = "POINT_DATA 64\nSCALARS f float\nLOOKUP_TABLE default\n";
  for (int i = 0; i < 64; ++i) values += std::to_string(i * 7 % 31) + "\n";
  std::ofstream(Path("even.vtk")) << head << "RECTILINEAR_GRID\nDIMENSIONS 4 4 4\nX_COORDINATES 4" << coordinates << "Y_COORDINATES 4"
                                  << coordinates << "Z_COORDINATES 4" << coordinates << values;
  std::ofstream(Path("image.vtk")) << head << "STRUCTURED_POINTS\nDIMENSIONS 4 4 4\nORIGIN 0 0 0\nSPACING 0.5 0.5 0.5\n" << values;
  for (const char* name : {"even", "image"}) {
    MustRun({"render", std::string(name) + ".vtk", "--local=1", "--renderer", "raycast", "--size", "48", "-o", std::string(name) + ".exr"});
  }
  EXPECT_EQ(LargestDifference(ReadPicture(Path("even.exr")), ReadPicture(Path("image.exr"))), 0);
}

TEST_F(RectilinearTest, WhatCannotDrawItSaysWhatHelps) {
  for (const char* renderer : {"splat", "zbuffer", "shear", "xray"}) {
    ExpectRefused({"render", "grid.vtk", "--local", "--renderer", renderer, "-o", "a.png"},
                  "a rectilinear grid that --resample even does not resample needs one of: raycast, mip");
  }
  ExpectRefused({"render", "grid.vtk", "--local", "--shadows", "1", "-o", "a.png"},
                "shadows and ambient occlusion are not shown on a rectilinear");
  ExpectRefused({"render", "grid.vtk", "--local", "--jitter", "1", "-o", "a.png"}, "jitter");
  ExpectRefused({"convert", "grid.vtk", "a.nrrd"}, "--resample even");
  ExpectRefused({"convert", "grid.vtk", "a.zarr"}, "--resample even");
  MustRun({"render", "grid.vtk", "--local", "--resample", "even", "--renderer", "splat", "--size", "32", "-o", "splat.png"});
}

}  // namespace
}  // namespace slabstream
