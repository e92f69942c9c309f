// PointZBuffer: Z-buffering of voxel points, as the paper's pipeline has it (Yagel and Machiraju, sections 3.1 and 3.5): the centre of each
// occupied voxel is transformed and written to the one pixel that it falls on, if it is the nearest so far. Nothing is reconstructed, so
// magnified surfaces have holes, through which one sees what lies behind, or nothing. For comparison with the renderer, which draws whole
// faces of voxels.
//
// Slices are transformed one at a time by the incremental scheme: each is the one before it plus a row of the matrix (transform_loops.h).
#pragma once

#include <cstdint>
#include <vector>

#include "common/view/camera.h"
#include "laboratory/measure/transform_loops.h"

namespace slabstream {

// From voxel indices to pixels and depth. Orthographic cameras only.
TransformMatrix MatrixOf(const Camera& camera);

class PointZBuffer {
 public:
  explicit PointZBuffer(ImageSize size);

  // Draws into an empty image. `occupied`: a byte a voxel, x fastest; all but 0 are.
  void Draw(const TransformMatrix& matrix, const Index3& size, const std::uint8_t* occupied);

  // Number of pixels on which at least two of the drawn voxels fall that lie within a voxel's length of the nearest one: neither hides the
  // other, and one of them is lost. The same arguments as those of Draw, which must have been called. Voxels have spacing 1.
  std::size_t CountDoubled(const TransformMatrix& matrix, const Index3& size, const std::uint8_t* occupied) const;

  bool Written(std::size_t pixel) const { return voxel_[pixel] != 0; }
  // Numbers of pixels.
  struct Holes {
    std::size_t covered = 0;  // by a face
    std::size_t empty = 0;    // the part of these that was not written
    // The part of these whose voxel lies more than a voxel's diagonal behind the face, so it is not the face's.
    std::size_t behind = 0;
  };
  // `faces`: the depth of the face that each pixel shows, row by row; +infinity where it shows none. Voxels have spacing 1.
  Holes HolesIn(const std::vector<float>& faces) const;

 private:
  // visit(pixel, depth, number of the voxel, from 1) for each occupied voxel that falls on the image.
  template <class Visit>
  void ForEachPoint(const TransformMatrix& matrix, const Index3& size, const std::uint8_t* occupied, Visit visit) const;

  ImageSize size_;
  std::vector<float> depth_;          // by pixel
  std::vector<std::uint32_t> voxel_;  // by pixel: the index of the nearest voxel, from 1; 0: none. Deferred shading would need it
};

}  // namespace slabstream
