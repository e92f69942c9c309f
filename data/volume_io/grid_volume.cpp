#include "data/volume_io/grid_volume.h"

#include <filesystem>
#include <utility>
#include <vector>

#include "common/mesh/lattice.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

RawVolume Described(const std::vector<std::string>& notes, const std::vector<std::filesystem::path>& other_files,
                    const VolumeGeometry& lattice) {
  RawVolume raw = {.other_files = other_files};
  raw.header.type = SampleType::kFloat32;
  raw.header.notes = notes;
  raw.header.size = lattice.size;
  raw.header.world = lattice.orientation.world;
  raw.header.steps = StepsOf(lattice.spacing);
  raw.header.origin = lattice.orientation.origin;
  return raw;
}

Result<RawVolume> FromMemory(LoadedMesh loaded, const std::string& path, const ReadOptions& options) {
  const VolumeGeometry lattice = LatticeOf(loaded.bounds, std::int64_t(loaded.mesh.tetrahedra.size()), options.lattice);
  RawVolume raw = Described(loaded.info.notes, loaded.info.other_files, lattice);
  const auto bytes = std::int64_t(loaded.mesh.bytes()) + raw.header.sample_bytes();
  if (Status status = CheckFitsMemory(bytes, path + ": its cells in order, and their lattice"); !status.ok()) return status;
  MoveToLattice(lattice, loaded.mesh);
  SortByPlace(lattice, loaded.mesh);
  raw.bytes = std::move(Resample(loaded.mesh, lattice).block.bytes);
  raw.cells = std::make_shared<const Mesh>(std::move(loaded.mesh));
  return raw;
}

Result<RawVolume> FromStore(StoredGrid grid) {
  RawVolume raw = Described(grid.cells->facts().notes, grid.other_files, grid.cells->facts().lattice);
  Result<Volume> lattice = grid.cells->ReadLattice();
  if (!lattice.ok()) return lattice.status();
  raw.bytes = std::move(lattice->block.bytes);
  raw.stored_cells = std::move(grid.cells);
  return raw;
}

}  // namespace

Result<RawVolume> GridVolume(const std::string& path, const ReadOptions& options, const GridFormat& format) {
  if (options.headers_only) {
    const Result<LoadedMesh> headers = format.read(MeshOptionsOf(options));
    if (!headers.ok()) return headers.status();
    RawVolume raw = Described(headers->info.notes, headers->info.other_files, {.size = {1, 1, 1}});
    raw.size_unknown = true;
    return raw;
  }
  Result<Grid> grid = ReadGrid(path, options, format);
  if (!grid.ok()) return grid.status();
  if (auto* const stored = std::get_if<StoredGrid>(&*grid)) return FromStore(std::move(*stored));
  return FromMemory(std::move(std::get<LoadedMesh>(*grid)), path, options);
}

}  // namespace slabstream
