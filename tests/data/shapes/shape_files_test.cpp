// Files of shapes, written byte by byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "data/isosurface/mesh_file.h"
#include "data/shapes/shape_file.h"
#include "tests/data/shapes/shape_samples.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using Places = std::vector<std::array<float, 3>>;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;
using Colors = std::vector<std::array<std::uint8_t, 4>>;
using Numbers = std::vector<std::uint32_t>;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Result<Shape> Read(const std::string& name, const std::string& bytes) {
  static const TemporaryDirectory directory;
  WriteFile(directory / name, bytes);
  return ReadShape(directory / name);
}

// Of one of the samples.
Shape Sample(const std::string& name) {
  const Result<Shape> shape = Read(name, BytesOfShapeSample(name));
  EXPECT_TRUE(shape.ok()) << shape.status().message();
  return shape.ok() ? *shape : Shape();
}

Places World(const Shape& shape) {
  Places places;
  for (const auto& [x, y, z] : shape.positions)
    places.push_back({float(shape.origin.x + x), float(shape.origin.y + y), float(shape.origin.z + z)});
  return places;
}

bool Same(const std::vector<float>& a, const std::vector<float>& b) {
  return std::ranges::equal(a, b, [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

// What the message says behind the path.
std::string Refusal(const std::string& name, const std::string& bytes) {
  const Result<Shape> shape = Read(name, bytes);
  if (shape.ok()) return "";
  const std::string message = shape.status().message();
  return message.substr(message.find(name) + name.size());
}

// The sample with another text in the place of one.
std::string Changed(const std::string& name, const std::string& text, const std::string& by) {
  std::string bytes = BytesOfShapeSample(name);
  return bytes.replace(bytes.find(text), text.size(), by);
}

TEST(Ply, TextWithEverything) {
  const Shape shape = Sample("text.ply");
  EXPECT_EQ(shape.kind, ShapeKind::kMesh);
  EXPECT_EQ(shape.origin, Vec3());
  EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {-1, 0, 0}, {-1, -1.5, 0}, {0, -1, 3}}));
  EXPECT_EQ(shape.normals, (Places{{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}, {0, 0, 0}}));
  EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(shape.colors, (Colors{{255, 0, 1, 255}, {0, 128, 0, 7}, {0, 0, 0, 0}, {1, 2, 3, 4}}));
  EXPECT_TRUE(Same(shape.values, {0.5, kNan, -1, 7}));
}

TEST(Ply, BinaryOfBothByteOrdersKeepsTheDigitsOfDoubles) {
  for (const char* name : {"little.ply", "big.ply"}) {
    const Shape shape = Sample(name);
    EXPECT_EQ(shape.origin, (Vec3{1e7, 2, 3}));
    EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {0.125, 0, 0}, {0, 0.5, 0}}));
    EXPECT_EQ(shape.triangles, (Triangles{{2, 1, 0}}));
  }
}

TEST(Ply, RefusesInOneLine) {
  const std::string vertex = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
  EXPECT_EQ(Refusal("a.ply", vertex + "end_header\n0 0 0\n1 1 nan\n"), ": vertex 1 is at (1, 1, nan), must be finite");
  EXPECT_EQ(Refusal("a.ply", vertex + "end_header\n0 0 0\n1 1"), ": truncated: has 1 of 2 vertex");
  EXPECT_EQ(Refusal("a.ply", vertex + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 1 1\n3 0 1 2\n"),
            ": triangle 0 has vertex 2, must be in [0, 2)");
  EXPECT_EQ(Refusal("a.ply",
                    "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
                    "property float z\nend_header\n"),
            ": truncated: has 4000000000 vertices in 0 bytes");
  EXPECT_EQ(Refusal("a.ply", vertex + "element face 4000000000000\nend_header\n0 0 0\n1 1 1\n"), "");  // faces that have no bytes
}

TEST(Stl, BinaryWithAHeaderLikeThatOfATextMergesCorners) {
  const Shape shape = Sample("binary.STL");
  EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {-1, 0, 0}, {0, -2, 0}, {-1, -2, 0}}));
  EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}, {1, 3, 2}}));
  std::string bytes = Changed("binary.STL", "solid", "Solid");
  bytes.pop_back();
  EXPECT_EQ(Refusal("a.stl", bytes), ": truncated: a binary STL file of 2 triangles has 184 bytes, this one 183");
}

TEST(Stl, Text) {
  const Shape shape = Sample("text.stl");
  EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}, {0, 1, 2}}));
  EXPECT_EQ(Refusal("a.stl", Changed("text.stl", "endsolid", "solid")), ": truncated: the last word is not endsolid");
  EXPECT_EQ(Refusal("a.stl", "solid\nfacet normal 0 0 1 outer loop vertex 0 a 0"), ": vertex 0 has 'a', must be a number");
}

TEST(Obj, PolygonsNormalsAndColours) {
  const Shape shape = Sample("a.obj");
  EXPECT_EQ(shape.origin, (Vec3{-1, -2, 3}));
  EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {-1, 0, 0}, {-1, -1, 0}, {0, -1, 0}, {0, 0, 0}, {-1, 0, 0}, {-1, -1, 0}}));
  EXPECT_EQ(shape.normals, (Places{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {-1, 0, 0}, {-1, 0, 0}, {-1, 0, 0}}));
  EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(shape.colors[0], (std::array<std::uint8_t, 4>{255, 128, 0, 255}));
  EXPECT_EQ(Refusal("a.obj", "v 0 0 0\nf 1 2 3\n"), ": a polygon has vertex 2, there are 1");
  EXPECT_EQ(Refusal("a.obj", "v 0 0 0\nf 1 1 0\n"), ": line 2: has '0', must be a number of a vertex");
  EXPECT_EQ(Read("a.obj", "v 0 0 0\nv 1 0 0\n").value().kind, ShapeKind::kPoints);
}

TEST(Glb, NodesPlaceMeshes) {
  const Shape shape = Sample("a.glb");
  const Places places = World(shape), expected = {{0, 0, 5}, {-1, 0, 5}, {0, 1, 5}, {-1, 1, 5}, {10, 2, 0}, {10, 4, 0}, {8, 2, 0}};
  const Places normals = {{}, {}, {}, {}, {0, 0, 1}, {0, 0, 1}, {0, 1, 0}};
  ASSERT_EQ(places.size(), expected.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(places[i][axis], expected[i][axis], 1e-6) << i;
      EXPECT_NEAR(shape.normals[i][axis], normals[i][axis], 1e-6) << i;
    }
  }
  EXPECT_EQ(shape.triangles, (Triangles{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(shape.colors[5], (std::array<std::uint8_t, 4>{0, 255, 0, 128}));
  EXPECT_EQ(shape.colors[0], (std::array<std::uint8_t, 4>{255, 255, 255, 255}));
}

TEST(Glb, RefusesInOneLine) {
  EXPECT_EQ(Refusal("a.glb", GlbFile(R"({"extensionsRequired":["KHR_draco_mesh_compression"]})", "")),
            ": requires the extension 'KHR_draco_mesh_compression', which is not supported");
  EXPECT_EQ(Refusal("a.glb", GlbFile(R"({"scenes":[{"nodes":[0]}],"nodes":[{"children":[0]}]})", "")), ": node 0 has more than one parent");
  EXPECT_EQ(Refusal("a.glb", GlbFile(R"({"scenes":[{"nodes":[7]}]})", "")), ": has nodes 7, must be in [0, 0)");
  const std::string mesh =
      R"({"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{}],"bufferViews":[{"buffer":0,"byteLength":12}],)";
  EXPECT_EQ(Refusal("a.glb", GlbFile(mesh + R"("accessors":[{"bufferView":0,"componentType":5126,"count":4000000000,"type":"VEC3"}]})",
                                     "012345678901")),
            ": accessor 0: 4000000000 rows of 12 bytes from byte 0 on do not fit its bufferView of 12 bytes");
  EXPECT_EQ(Refusal("a.glb", GlbFile(mesh + R"("accessors":[{"bufferView":0,"componentType":5126,"count":1,"type":"VEC3","sparse":{}}]})",
                                     "012345678901")),
            ": accessor 0: sparse ones are not supported");
}

TEST(Vtk, LegacyMeshesOfBothLayouts) {
  for (const char* name : {"old_text.vtk", "old.vtk", "new_text.vtk", "new.vtk"}) {
    const Shape shape = Sample(name);
    EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {-1, 0, 0}, {-1, -1, 0}, {0, -1, 0}, {-2, 0, 1}})) << name;
    EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {1, 4, 2}})) << name;
    EXPECT_EQ(shape.values, (std::vector<float>{0.5, 1, 1.5, 2, 2.5})) << name;
    EXPECT_EQ(shape.normals[0], (std::array<float, 3>{0, 0, 1})) << name;
    EXPECT_EQ(shape.normals[4], (std::array<float, 3>{-1, 0, 0})) << name;
    EXPECT_EQ(shape.colors[3], (std::array<std::uint8_t, 4>{1, 2, 3, 255})) << name;
  }
}

TEST(Vtk, LinesAndPoints) {
  const Shape lines = Sample("lines.vtk");
  EXPECT_EQ(lines.kind, ShapeKind::kLines);
  EXPECT_EQ(World(lines), (Places{{1, 1, 0}, {1, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1, 1, 0}}));
  EXPECT_EQ(lines.line_begins, (Numbers{0, 3, 5}));
  EXPECT_EQ(lines.radii, (std::vector<float>{1.5, 1, 0.5, 0.5, 1.5}));
  const Shape points = Sample("points.vtp");
  EXPECT_EQ(points.kind, ShapeKind::kPoints);
  EXPECT_EQ(points.positions, (Places{{-4, -5, 6}, {0, 0, 0}}));
  EXPECT_EQ(points.values, (std::vector<float>{9, 7}));
  EXPECT_EQ(Refusal("a.vtk", Changed("lines.vtk", "2 0 2", "2 0 4")), ": a cell of LINES has point 4, must be in [0, 4)");
  EXPECT_EQ(Refusal("a.vtp", Changed("points.vtp", ">1 2<", ">1 3<")),
            ": truncated: array connectivity has 3 bytes, its 3 samples need at least 5");
}

TEST(FreeSurfer, LiesInTheScannersSpace) {
  const Shape shape = Sample("lh.pial");
  EXPECT_EQ(shape.positions, (Places{{1.5, -2.5, 3}, {2.5, -2.5, 3}, {1.5, -0.5, 3}}));
  EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}}));
  EXPECT_EQ(Read("rh.white", Changed("lh.pial", "valid = 1", "valid = 0")).value().positions, (Places{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}));
  EXPECT_EQ(Refusal("lh.white", BytesOfShapeSample("lh.pial").substr(0, 60)),
            ": truncated: 3 vertices and 1 triangles need 56 bytes, has 40");
}

TEST(Gifti, LiesInTheScannersSpace) {
  for (const char* name : {"text.gii", "base64.gii", "packed.surf.gii"}) {
    const Shape shape = Sample(name);
    EXPECT_EQ(shape.positions, (Places{{1.5, -2.5, 3}, {2.5, -2.5, 3}, {1.5, -0.5, 3}})) << name;
    EXPECT_EQ(shape.triangles, (Triangles{{0, 1, 2}})) << name;
    EXPECT_EQ(shape.values, (std::vector<float>{7, 8, 9})) << name;
  }
  EXPECT_EQ(Refusal("a.gii", Changed("base64.gii", "Dim0=\"3\"", "Dim0=\"4000000000\"")),
            ": array NIFTI_INTENT_POINTSET: truncated: 12000000000 numbers cannot be in 48 letters");
  EXPECT_EQ(Refusal("a.gii", Changed("base64.gii", "Base64Binary", "Base&#10;64")),
            ": array NIFTI_INTENT_POINTSET: Encoding is 'Base?64', must be ASCII, Base64Binary or GZipBase64Binary");
}

TEST(Tractograms, OfTrackVis) {
  for (const char* name : {"little.trk", "big.trk", "first.trk"}) {
    const Shape shape = Sample(name);
    EXPECT_EQ(shape.kind, ShapeKind::kLines) << name;
    EXPECT_EQ(shape.line_begins, (Numbers{0, 2, 5})) << name;
    EXPECT_EQ(World(shape), name == std::string("first.trk") ? (Places{{9, 19, 0}, {8, 19, 0}, {9, 19, 0}, {9, 18, 0}, {9, 18, 2}})
                                                             : (Places{{9, 1, 3}, {7, 1, 3}, {9, 1, 3}, {9, 3, 3}, {9, 3, 7}}))
        << name;
    EXPECT_EQ(shape.values, (std::vector<float>{7, 8, 7, 8, 9})) << name;
  }
  EXPECT_EQ(Refusal("a.trk", BytesOfShapeSample("little.trk").substr(0, 1100)), ": truncated: ends in line 2");
}

TEST(Tractograms, OfMrtrix) {
  for (const char* name : {"little.tck", "big.tck"}) {
    const Shape shape = Sample(name);
    EXPECT_EQ(shape.positions, (Places{{0, 0, 0}, {1, 0, 0}, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}})) << name;
    EXPECT_EQ(shape.line_begins, (Numbers{0, 2, 5})) << name;
  }
  EXPECT_EQ(Refusal("a.tck", BytesOfShapeSample("little.tck").substr(0, 64 + 48)), ": truncated: no infinite place ends the lines");
}

TEST(Tables, ColumnsByName) {
  const Shape shape = Sample("a.csv");
  EXPECT_EQ(shape.kind, ShapeKind::kPoints);
  EXPECT_EQ(World(shape), (Places{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(shape.colors, (Colors{{255, 0, 1, 255}, {0, 0, 0, 255}}));
  EXPECT_TRUE(Same(shape.values, {0.5, kNan}));
  EXPECT_EQ(shape.radii, (std::vector<float>{4, 0}));
  EXPECT_EQ(World(Sample("plain.csv")), (Places{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(Sample("tab.tsv").colors, (Colors{{255, 128, 0, 255}}));
  EXPECT_EQ(Sample("tab.tsv").radii, std::vector<float>());
  EXPECT_EQ(World(Sample("slicer.fcsv")), (Places{{-1, -2, 3}, {-4, -5, 6}}));
  EXPECT_EQ(Refusal("a.csv", "a,b,c\n1,2,3\n4,5\n"), ": line 3: column 3 is '', must be a number");
  EXPECT_EQ(Refusal("a.csv", "x,y,z,r\n1,2,3,-1\n"), ": vertex 0 has the radius -1, must be at least 0");
}

TEST(Tables, OfNumPy) {
  EXPECT_EQ(Sample("c.npy").positions, (Places{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(World(Sample("fortran.npy")), (Places{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(Sample("fortran.npy").radii, (std::vector<float>{7, 8}));
}

// What slabstream isosurface writes.
TEST(ShapeFiles, KeepIsosurfaces) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  SurfacePart part;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 normal = Normalized({random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)});
    part.vertices.push_back(
        {{float(random.Real(-100, 100)), float(random.Real(-100, 100)), float(i)}, {float(normal.x), float(normal.y), float(normal.z)}});
    part.triangles.push_back({i, random.Integer(0, 999), random.Integer(0, 999)});
  }
  const TemporaryDirectory directory;
  for (const char* name : {"a.ply", "a.stl"}) {
    Result<MeshFile> file = MeshFile::Create(directory / name);
    ASSERT_TRUE(file.ok());
    file->Add(part);
    ASSERT_TRUE(file->Finish({"isovalue 3", "world", "level"}, [] { return true; }).ok());
    const Result<Shape> shape = ReadShape(directory / name);
    ASSERT_TRUE(shape.ok()) << shape.status().message();
    ASSERT_EQ(shape->triangles.size(), part.triangles.size());
    for (std::size_t i = 0; i < part.triangles.size(); ++i) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const SurfaceVertex& vertex = part.vertices[std::size_t(part.triangles[i][corner])];
        const std::uint32_t number = shape->triangles[i][corner];
        ASSERT_EQ(shape->positions[number], vertex.position);
        for (std::size_t axis = 0; axis < 3 && !shape->normals.empty(); ++axis)
          ASSERT_NEAR(shape->normals[number][axis], vertex.normal[axis], 1e-6);
      }
    }
    EXPECT_EQ(shape->normals.empty(), std::string(name) == "a.stl");
  }
}

TEST(ShapeFiles, AreKnownByTheirEndingsOrFirstBytes) {
  const TemporaryDirectory directory;
  for (const ShapeSample& sample : ShapeSamples()) {
    WriteFile(directory / sample.name, sample.bytes);
    EXPECT_TRUE(HoldsShape(directory / sample.name)) << sample.name;
  }
  WriteFile(directory / "volume.npy", Changed("c.npy", "(2, 3)", "(2, 9)"));
  WriteFile(directory / "volume.vtk", Changed("lines.vtk", "POLYDATA", "STRUCTURED_POINTS"));
  WriteFile(directory / "other", "other");
  for (const char* name : {"volume.npy", "volume.vtk", "other", "missing.vtk"}) EXPECT_FALSE(HoldsShape(directory / name)) << name;
  EXPECT_EQ(ReadShape(directory / "missing.ply").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(ReadShape(directory / "other").status().message(),
            directory / "other" + ": holds no shape that is known; must end in " + ShapeEndings());
}

// Whatever the bytes are: a shape that holds, or one line.
void CheckHolds(const std::string& name, const std::string& bytes) {
  const Result<Shape> shape = Read(name, bytes);
  if (!shape.ok()) {
    EXPECT_FALSE(shape.status().message().empty());
    EXPECT_EQ(shape.status().message().find('\n'), std::string::npos) << shape.status().message();
    return;
  }
  EXPECT_EQ(WhatIsWrong(*shape), "");
}

TEST(ShapeFiles, TruncatedAtAnyByteHoldOrSaySo) {
  for (const ShapeSample& sample : ShapeSamples()) {
    SCOPED_TRACE(sample.name);
    for (std::size_t size = 0; size < sample.bytes.size(); ++size) CheckHolds(sample.name, sample.bytes.substr(0, size));
  }
}

TEST(ShapeFiles, WithOtherBytesHoldOrSaySo) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (const ShapeSample& sample : ShapeSamples()) {
    SCOPED_TRACE(sample.name);
    for (int i = 0; i < 500; ++i) {
      std::string bytes = sample.bytes;
      for (int changes = random.Integer(1, 3); changes > 0; --changes)
        bytes[random.Integer<std::size_t>(0, bytes.size() - 1)] = char(random.Integer(0, 255));
      CheckHolds(sample.name, bytes);
    }
  }
}

}  // namespace
}  // namespace slabstream
