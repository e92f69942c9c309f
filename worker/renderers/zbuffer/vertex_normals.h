// VertexNormals: normals at the vertices of a brick's cells, the points q + 1/2 between eight voxels: the direction of the gradient of
// stored samples there, the mean of those at the eight voxels (docs/rendering.md: differences over two voxels, smoothed by (1, 2, 1)/4;
// one-sided at the border). Along each axis that is one filter over the four nearest samples: (1, 3, 3, 1)/8 smooths, (-1, -1, 1, 1)/4
// differentiates. Blended over a face they are continuous over all faces, and as wide as the steps of a hard-edged surface, so these do not
// show as streaks.
//
// In single precision without fused operations, each vertex from samples at most two voxels from the cells that share it: the same bits
// wherever a slab that holds these samples begins and ends.
#pragma once

#include <array>
#include <cstdint>

#include "common/volume/volume.h"
#include "worker/kernels/surface_face.h"

namespace slabstream {

class VertexNormals {
 public:
  // Reads the samples round the brick at `origin`, as far as they lie in `voxels`. Those outside count as the nearest one inside.
  void Compute(const VoxelBlock& voxels, const Vec3& spacing, const Index3& origin);

  // At the vertex below voxel origin + `vertex` along all axes; each coordinate in [0, kFaceBrick]. Over physical distance. Exactly 0 where
  // all 64 samples are equal; not finite where one is not.
  Vec3 Gradient(const Index3& vertex) const;

 private:
  static constexpr int kVertices = kFaceBrick + 1, kSamples = kFaceBrick + 4;  // samples from two before the brick to two after it
  using Row = std::array<float, kSamples>;

  // The filters of all vertices along one axis: weights of samples vertex ... vertex + 3, and of the differences of neighbours among them.
  struct Filters {
    std::array<Row, 4> smooth{};
    std::array<Row, 3> slope{};
  };
  static Filters FiltersAlong(int axis, const Box& box, double spacing, std::int32_t origin);

  Filters along_z_;
  // Filtered along x, by [z][y] of samples, then along y, by [z][y] of sample and vertex: value, d/dx, d/dy.
  std::array<std::array<Row, kSamples>, kSamples> smooth_x_{}, slope_x_{};
  std::array<std::array<Row, kVertices>, kSamples> value_{}, dx_{}, dy_{};
};

// The direction of a gradient as in FaceNormals; 0 if it has none.
std::uint32_t PackNormal(const Vec3& gradient);

}  // namespace slabstream
