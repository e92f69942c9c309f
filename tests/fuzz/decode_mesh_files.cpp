// Files of unstructured grids, read from a file, since that is what the reader takes.
//
// input: the file
#include <algorithm>
#include <string>

#include "data/volume_io/mesh_reader.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {

bool DecodeMeshFile(std::span<const std::byte> bytes) {
  static const TemporaryDirectory directory{PlaceOfFuzzFiles()};
  const std::string path = directory / "grid";
  WriteFile(path, FileBytes(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  const Result<LoadedMesh> loaded = ReadMesh(path);
  if (!loaded.ok()) {
    CheckRefusal(loaded.status());
    return false;
  }
  const Mesh& mesh = loaded->mesh;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    CHECK(std::ranges::all_of(t, [&](PointNumber n) { return n < mesh.points.size(); }));
  }
  CHECK_EQ(mesh.values.size(), mesh.at == ValuesAt::kPoints ? mesh.points.size() : mesh.tetrahedra.size());
  return true;
}

std::vector<FuzzBytes> MeshFileSeeds() {
  std::vector<FuzzBytes> seeds;
  for (const VtiOptions& encoding : {VtiOptions{}, VtiOptions{.wide_header = true, .block = 40}, VtiOptions{.encoding = "base64"},
                                     VtiOptions{.format = "binary"}, VtiOptions{.format = "ascii"}}) {
    for (const bool big_endian : {false, true}) {
      VtuSpec spec = SmallGrid();
      spec.big_endian = big_endian;
      seeds.push_back(FuzzSeed().Put(std::string_view(VtuFile(spec, encoding))).bytes());
    }
  }
  for (const bool binary : {false, true}) {
    for (const bool offsets : {false, true}) {
      seeds.push_back(FuzzSeed().Put(std::string_view(LegacyGridFile(SmallGrid(), {.binary = binary, .offsets = offsets}))).bytes());
    }
  }
  VtuSpec curvilinear = BoxOfHexahedra({}, {2, 1, 1}, [](const Vec3& number) { return number; });
  curvilinear.extent = "0 2 0 1 0 1";
  curvilinear.arrays.insert(curvilinear.arrays.begin() + 1, {"CellData", "vtkGhostType", SampleType::kUint8, 1, {0, 32}});
  seeds.push_back(FuzzSeed().Put(std::string_view(VtuFile(curvilinear))).bytes());
  seeds.push_back(FuzzSeed().Put(std::string_view(LegacyGridFile(curvilinear, {.dimensions = "3 2 2"}))).bytes());
  return seeds;
}

}  // namespace slabstream
