// Unstructured and curvilinear grids as volumes: their values on a lattice, and their cells beside them.
#include <optional>
#include <utility>

#include "common/mesh/lattice.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {
namespace {

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const std::optional<int> channel = options.channel || !options.describe ? options.channel : std::optional(0);
  Result<LoadedMesh> loaded =
      ReadMesh(path, {.array = options.array, .time = options.time, .channel = channel, .headers_only = options.headers_only});
  if (!loaded.ok()) return loaded.status();
  RawVolume raw = {.other_files = loaded->info.other_files};
  raw.header.type = SampleType::kFloat32;
  raw.header.notes = loaded->info.notes;
  raw.size_unknown = options.headers_only;
  raw.header.size = {1, 1, 1};
  if (options.headers_only) return raw;
  const VolumeGeometry lattice = LatticeOf(loaded->bounds, std::int64_t(loaded->mesh.tetrahedra.size()), options.lattice);
  raw.header.size = lattice.size;
  raw.header.world = lattice.orientation.world;
  raw.header.steps = StepsOf(lattice.spacing);
  raw.header.origin = lattice.orientation.origin;
  const auto bytes = std::int64_t(loaded->mesh.bytes()) + raw.header.sample_bytes();
  if (Status status = CheckFitsMemory(bytes, path + ": its cells in order, and their lattice"); !status.ok()) return status;
  MoveToLattice(lattice, loaded->mesh);
  SortByPlace(lattice, loaded->mesh);
  raw.bytes = std::move(Resample(loaded->mesh, lattice).block.bytes);
  raw.cells = std::make_shared<const Mesh>(std::move(loaded->mesh));
  return raw;
}

}  // namespace

VolumeFormat UnstructuredGrid() {
  std::vector<std::string_view> endings(kXmlGridEndings.begin(), kXmlGridEndings.end());
  endings.emplace_back(".vtk");
  return {.name = "VTK unstructured grid",
          .endings = std::move(endings),
          .claims = LooksLikeMesh,
          .options = {"time", "channel", "array", "lattice"},
          .read = Read};
}

}  // namespace slabstream
