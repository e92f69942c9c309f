// Parts of a grid: the cells that touch a box, as they are cut out and sent.
//
// A grid's cells are in memory (MeshCutter), or in files if they are too many for that (StoredCells, data/cell_store).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/cell_runs.h"
#include "common/mesh/mesh.h"
#include "common/mesh/summarize_cells.h"
#include "common/volume/box.h"

namespace slabstream {

// All cells of a grid. Any thread. Errors are those of files: Unavailable, DataLoss; ResourceExhausted.
class GridCells {
 public:
  virtual ~GridCells() = default;

  // The cells whose bounding boxes touch the space of the box's voxels, [begin - 0.5, end - 0.5] along each axis, and their points. Both
  // keep their order, so what depends on the order of points or cells is the same in every part. So are the gradients at the points, which
  // are those of the whole grid.
  virtual Result<Mesh> CellsIn(const Box& box) const = 0;
  // Calls function(part) for parts that have all cells, each once. They need not have gradients.
  virtual Status Visit(const std::function<void(const Mesh&)>& function) const = 0;
  // Of a lattice of this size, on which the grid lies.
  virtual CellRanges Ranges(const Index3& size) const = 0;
  virtual std::string Digest() const = 0;   // of all that CellsIn may return
  virtual std::uint64_t bytes() const = 0;  // memory
};

// The cells of a mesh with gradients whose bounding boxes touch a space, as of GridCells::CellsIn.
Mesh CellsTouching(const Mesh& mesh, const CellBounds& space);

// Those of a mesh in memory.
class MeshCutter : public GridCells {
 public:
  explicit MeshCutter(std::shared_ptr<const Mesh> mesh);

  Mesh Cut(const Box& box) const;  // CellsIn

  Result<Mesh> CellsIn(const Box& box) const override { return Cut(box); }
  Status Visit(const std::function<void(const Mesh&)>& function) const override;
  CellRanges Ranges(const Index3& size) const override { return RangesOf(*mesh_, size); }
  std::string Digest() const override;
  std::uint64_t bytes() const override { return mesh_->bytes() + gradients_.capacity() * sizeof(gradients_[0]) + runs_.bytes(); }

 private:
  std::shared_ptr<const Mesh> mesh_;
  AlignedVector<Vector3<float>> gradients_;  // by point of the mesh
  CellRuns runs_;
};

// The mesh as bytes, little-endian, and back:
//   uint64 points, uint64 tetrahedra     how many
//   uint32 at                            0: a value for each point, 1: one for each tetrahedron
//   uint32 lit                           1: there are gradients, 0: there are none
//   float32 x, y, z                      of each point
//   uint32 a, b, c, d                    the points of each tetrahedron
//   float32 value                        of each point or tetrahedron
//   float32 x, y, z                      the gradient of each point, if there are gradients
// DataLoss: they are not those of a mesh; a point is not finite; a tetrahedron has a point that there is not, or one twice. Memory is taken
// for what the bytes hold and no more.
std::vector<std::byte> EncodeMesh(const Mesh& mesh);
Result<Mesh> DecodeMesh(std::span<const std::byte> bytes);

}  // namespace slabstream
