
#include <atomic>

#include "common/base/check.h"
#include "common/classification/count_occupied.h"
#include "common/classification/occupancy_layers.h"
#include "common/mesh/mesh_cell.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

// Whether any value of a range has an opacity above zero.
class VisibleRanges {
 public:
  explicit VisibleRanges(const ClassificationTable& table) : table_(table), below_(std::size_t(table.size()) + 1) {
    for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) below_[bin + 1] = below_[bin] + (table.opacity[bin] > 0 ? 1 : 0);
  }
  bool operator()(const ValueRange& values) const {
    if (values.min > values.max) return false;
    return below_[std::size_t(table_.BinOf(double(values.max))) + 1] > below_[std::size_t(table_.BinOf(double(values.min)))];
  }

 private:
  const ClassificationTable& table_;
  std::vector<std::int32_t> below_;  // visible bins below a bin
};

// Bits of the voxels of a lattice. Several threads may set them: the order does not change the bits.
class VoxelBits {
 public:
  explicit VoxelBits(const Index3& size) : size_(size), cells_(OccupancyCells(size)), layers_(kOccupancyCell * CountIn(cells_)) {}

  void Set(const Box& voxels) {
    for (std::int32_t z = voxels.begin.z; z < voxels.end.z; ++z) {
      for (std::int32_t y = voxels.begin.y; y < voxels.end.y; y += kOccupancyCell - y % kOccupancyCell) {
        for (std::int32_t x = voxels.begin.x; x < voxels.end.x; x += kOccupancyCell - x % kOccupancyCell) {
          const Index3 cell = Index3{x, y, z} / kOccupancyCell, first = kOccupancyCell * cell;
          const auto end_of = [](std::int32_t end, std::int32_t begin) { return std::min(end - begin, kOccupancyCell); };
          // In a layer, rows stand where a cell has layers.
          const OccupancyLayer bits = LinesIn(y - first.y, end_of(voxels.end.y, first.y), x - first.x, end_of(voxels.end.x, first.x));
          std::atomic<OccupancyLayer>& layer = layers_[kOccupancyCell * NumberIn(cells_, cell) + std::size_t(z - first.z)];
          if ((layer.load(std::memory_order_relaxed) & bits) != bits) layer.fetch_or(bits, std::memory_order_relaxed);
        }
      }
    }
  }

  OccupancyGrid Count() const {
    OccupancyGrid grid{size_, std::vector<CellOccupancy>(CountIn(cells_))};
    ParallelFor(0, grid.cells.size(), [&](std::size_t cell) {
      for (std::int32_t z = 0; z < kOccupancyCell; ++z) {
        AddLayer(grid.cells[cell], z, layers_[kOccupancyCell * cell + std::size_t(z)].load(std::memory_order_relaxed));
      }
    });
    return grid;
  }

 private:
  Index3 size_, cells_;
  std::vector<std::atomic<OccupancyLayer>> layers_;  // by cell, kOccupancyCell each
};

// visit(add) calls add(mesh) for all parts of the grid.
template <class Visit>
Result<OccupancyGrid> Count(const VolumeDescription& lattice, const ClassificationTable& table, Visit&& visit) {
  CHECK(lattice.mapping == ValueMapping{});
  const VisibleRanges visible(table);
  VoxelBits voxels(lattice.geometry.size);
  const Status visited = visit([&](const Mesh& mesh) {
    ParallelFor(0, mesh.tetrahedra.size(), [&](std::size_t cell) {
      if (visible(ValuesIn(mesh, cell))) voxels.Set(VoxelsTouched(BoundsOf(mesh, cell), lattice.geometry.size));
    });
  });
  return visited.ok() ? Result(voxels.Count()) : visited;
}

}  // namespace

OccupancyGrid CountOccupiedByCells(const Mesh& mesh, const VolumeDescription& lattice, const ClassificationTable& table) {
  return *Count(lattice, table, [&](auto&& add) {
    add(mesh);
    return Status::Ok();
  });
}

Result<OccupancyGrid> CountOccupiedByCells(const GridCells& cells, const VolumeDescription& lattice, const ClassificationTable& table) {
  return Count(lattice, table, [&](auto&& add) { return cells.Visit(add); });
}

}  // namespace slabstream
