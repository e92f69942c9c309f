// `isosurface`: from the file to the mesh in the world.
#include <gmock/gmock.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/data/isosurface/surface.h"
#include "tests/end_to_end/program.h"
#include "tests/support/full_disk.h"

namespace slabstream {
namespace {

class IsosurfaceTest : public EndToEndTest {};

TEST_F(IsosurfaceTest, EveryFormatAndEveryWayToReadGiveTheSameSurface) {
  MakeSphere("s.nrrd", 2, 70);
  for (const char* const name : {"s.nii.gz", "s.ome.zarr", "s.npy"}) MustRun({"convert", "s.nrrd", name});
  const ProgramResult made = MustRun({"isosurface", "s.nrrd", "--isovalue", "100", "-o", "a.ply", "--progress"});
  EXPECT_THAT(made.err, HasSubstr("reading s.nrrd: 100 %"));
  const std::string counts = made.out.substr(made.out.find(':'));
  EXPECT_THAT(counts, HasSubstr(" triangles\n"));
  for (const char* const name : {"s.nrrd", "s.nii.gz", "s.ome.zarr", "s.npy"}) {
    for (const char* const mesh : {"b.stl", "b.ply"}) {
      EXPECT_EQ(MustRun({"isosurface", name, "--isovalue", "100", "-o", mesh}).out, std::string("wrote ") + mesh + counts) << name;
    }
    EXPECT_EQ(ReadFile("b.ply").size(), ReadFile("a.ply").size());
  }
  EXPECT_EQ(MustRun({"isosurface", "s.nrrd", "--isovalue", "100", "--part", "2/2", "-o", "b.ply"}).out, "made part 2 of 2; 1 missing: 1\n");
  EXPECT_EQ(MustRun({"isosurface", "s.nrrd", "--isovalue", "100", "--part", "1/2", "-o", "b.ply"}).out, "wrote b.ply" + counts);
  const std::string coarse = MustRun({"isosurface", "s.ome.zarr", "--isovalue", "100", "--level", "1", "-o", "c.ply"}).out;
  EXPECT_LT(ReadFile("c.ply").size(), ReadFile("a.ply").size() / 2) << coarse;
  EXPECT_EQ(Files(), (std::vector<std::string>{"a.ply", "b.ply", "b.stl", "c.ply", "s.nii.gz", "s.npy", "s.nrrd"}));
}

TEST_F(IsosurfaceTest, LiesInThePatientsWorld) {
  // Voxels along 0.6 -0.8 0 and so on of LPS, 2 mm apart. The value is a patient's x (RAS), which rises to the right, so that the surface
  // is a plane and its normal points to the left.
  std::ofstream file(Path("p.nrrd"), std::ios::binary);
  file << "NRRD0004\ntype: float\ndimension: 3\nsizes: 6 5 4\nendian: little\nencoding: raw\nspace: left-posterior-superior\n"
          "space directions: (1.2,-1.6,0) (1.6,1.2,0) (0,0,3)\nspace origin: (10,20,30)\n\n";
  for (int z = 0; z < 4; ++z) {
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 6; ++x) {
        const auto value = float(-(10 + 1.2 * x + 1.6 * y));
        file.write(reinterpret_cast<const char*>(&value), sizeof value);
      }
    }
  }
  file.close();
  MustRun({"isosurface", "p.nrrd", "--isovalue", "-15.1", "-o", "p.ply"});
  const SurfacePart surface = ReadPly(ReadFile("p.ply"));
  ASSERT_GT(surface.vertices.size(), 10U);
  for (const auto& [v, normal] : surface.vertices) {
    EXPECT_NEAR(v[0], -15.1, 1e-3);
    EXPECT_TRUE(v[1] <= -11 && v[1] >= -26 && v[2] >= 30 && v[2] <= 39) << v[1] << " " << v[2];
    EXPECT_NEAR(normal[0], -1, 1e-4);
  }
  EXPECT_THAT(ReadFile("p.ply"), HasSubstr("comment world: patient, RAS: x to the right, y to anterior, z to superior; unit: mm\n"));
}

TEST_F(IsosurfaceTest, BadInputEndsInOneLine) {
  MakeSphere("s.nrrd", 2, 16);
  ExpectEachRefused({"isosurface", "s.nrrd"},
                    {
                        {{"--isovalue", "100"}, "--output"},
                        {{"-o", "x.ply"}, "give one of --isovalue and --label"},
                        {{"-o", "x.ply", "--isovalue", "3", "--label", "3"}, "--label"},
                        {{"-o", "x.ply", "--isovalue", "nan"}, "--isovalue"},
                        {{"-o", "x.ply", "--label", "0"}, "--label: expected a whole number of at least 1, not '0'"},
                        {{"-o", "x.ply", "--label", "200"}, "--label 200: no surface"},
                        {{"-o", "x.ply", "--isovalue", "256"}, "--isovalue 256: no surface; values are 0 to "},
                        {{"-o", "x.ply", "--isovalue", "9", "--level", "1"}, "--level is 1, but 's.nrrd' has level 0"},
                        {{"-o", "x.vtk", "--isovalue", "9"}, "--output 'x.vtk' must end in one of .ply, .stl"},
                        {{"-o", "no/x.ply", "--isovalue", "9"}, "the directory 'no' does not exist"},
                    });
  ExpectRefused({"isosurface", "none.nrrd", "--isovalue", "9", "-o", "x.ply"}, "none.nrrd");
  ExpectRefused({"isosurface", "s.nrrd?ids=yes", "--isovalue", "9", "-o", "x.ply"}, "has labels, which are no values: --label N");
}

TEST_F(IsosurfaceTest, AFullDiskLeavesNothingBehind) {
  MakeSphere("s.nrrd", 2, 40);
  for (const char* const mesh : {"m.ply", "m.stl"}) {
    const ProgramResult full = OnFullDisk(20000, [&] { return Slabstream({"isosurface", "s.nrrd", "--isovalue", "9", "-o", mesh}); });
    EXPECT_EQ(full.exit_status, 1);
    EXPECT_THAT(full.err, HasSubstr("File too large"));
    EXPECT_EQ(full.err_lines().size(), 1U);
  }
  EXPECT_EQ(Files(), (std::vector<std::string>{"s.nrrd"}));
}

}  // namespace
}  // namespace slabstream
