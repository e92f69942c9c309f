#include "data/volume_io/grid_volume.h"

#include <optional>
#include <utility>

#include "common/mesh/lattice.h"
#include "common/volume/memory_budget.h"

namespace slabstream {

MeshOptions MeshOptionsOf(const ReadOptions& options) {
  const std::optional<int> channel = options.channel || !options.describe ? options.channel : std::optional(0);
  return {.array = options.array, .time = options.time, .channel = channel, .headers_only = options.headers_only};
}

Result<RawVolume> GridVolume(const std::string& path, LoadedMesh grid, const ReadOptions& options) {
  RawVolume raw = {.other_files = grid.info.other_files};
  raw.header.type = SampleType::kFloat32;
  raw.header.notes = grid.info.notes;
  raw.size_unknown = options.headers_only;
  raw.header.size = {1, 1, 1};
  if (options.headers_only) return raw;
  const VolumeGeometry lattice = LatticeOf(grid.bounds, std::int64_t(grid.mesh.tetrahedra.size()), options.lattice);
  raw.header.size = lattice.size;
  raw.header.world = lattice.orientation.world;
  raw.header.steps = StepsOf(lattice.spacing);
  raw.header.origin = lattice.orientation.origin;
  const auto bytes = std::int64_t(grid.mesh.bytes()) + raw.header.sample_bytes();
  if (Status status = CheckFitsMemory(bytes, path + ": its cells in order, and their lattice"); !status.ok()) return status;
  MoveToLattice(lattice, grid.mesh);
  SortByPlace(lattice, grid.mesh);
  raw.bytes = std::move(Resample(grid.mesh, lattice).block.bytes);
  raw.cells = std::make_shared<const Mesh>(std::move(grid.mesh));
  return raw;
}

}  // namespace slabstream
