// Parts of a grid: the cells that touch a box, as they are cut out and sent.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/cell_runs.h"
#include "common/mesh/mesh.h"
#include "common/volume/box.h"

namespace slabstream {

// Cuts out the cells of boxes. Any thread.
class MeshCutter {
 public:
  explicit MeshCutter(std::shared_ptr<const Mesh> mesh);

  // The cells whose bounding boxes touch the space of the box's voxels, [begin - 0.5, end - 0.5] along each axis, and their points. Both
  // keep their order, so what depends on the order of points or cells is the same in every part. So are the gradients at the points, which
  // are those of the whole mesh.
  Mesh Cut(const Box& box) const;

  const Mesh& mesh() const { return *mesh_; }
  // Memory, with the mesh.
  std::size_t bytes() const { return mesh_->bytes() + gradients_.capacity() * sizeof(gradients_[0]) + runs_.bytes(); }

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
