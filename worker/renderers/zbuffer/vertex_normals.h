// VertexNormals: normals at the vertices of a brick's cells, the points q + 1/2 between eight voxels. A normal is the direction of the
// gradient of stored samples there, the mean of the gradients at the eight voxels (docs/rendering.md: differences over two voxels, smoothed
// by (1, 2, 1)/4; one-sided at the border). Along each axis that is one filter over the four nearest samples: (1, 3, 3, 1)/8 smooths, (-1,
// -1, 1, 1)/4 differentiates. Blended over faces, normals are continuous from face to face. The filter is as wide as the steps of a
// hard-edged surface, so these do not show as streaks.
//
// Single precision without fused operations; each vertex uses samples at most two voxels from the cells that share it. So the bits are the
// same in every padded box that holds these samples.
#pragma once

#include <array>
#include <cstdint>

#include "common/volume/volume.h"
#include "worker/kernels/surface_face.h"

namespace slabstream {

class VertexNormals {
 public:
  // Reads the samples round the brick at `origin` that lie in `voxels`. Samples outside count as the nearest one inside.
  void Compute(const VoxelBlock& voxels, const Vec3& spacing, const Index3& origin);

  // Physical gradient at the vertex below voxel origin + `vertex` along all axes; each coordinate in [0, kFaceBrick]. Exactly 0 if all 64
  // samples are equal; not finite if one of them is not.
  Vec3 Gradient(const Index3& vertex) const;

 private:
  static constexpr int kVertices = kFaceBrick + 1, kSamples = kFaceBrick + 4;  // samples from two before the brick to two after it
  using Row = std::array<float, kSamples>;

  // Filters of all vertices along one axis: weights of samples vertex ... vertex + 3, and of their differences.
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
