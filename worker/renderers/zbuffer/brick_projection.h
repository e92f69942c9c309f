// BrickProjection: the positions of a surface's bricks and their faces on a frame's screen. Made once a frame.
#pragma once

#include <cstdint>

#include "common/image/pixel_bounds.h"
#include "common/view/camera.h"
#include "worker/kernels/draw_faces.h"
#include "worker/renderers/zbuffer/surface.h"

namespace slabstream {

// A brick as a frame sees it.
struct ProjectedBrick {
  PixelBounds pixels;       // pixels that its faces may touch, within the frame; may be empty
  float nearest = 0;        // depth; no face is nearer
  std::uint32_t sides = 0;  // sides that may face the eye: bit side
  bool clipped = false;     // not all of its faces are drawn
};

class BrickProjection {
 public:
  BrickProjection(const Camera& camera, const Index3& volume_size);

  ProjectedBrick View(const SurfaceBrick& brick) const;

  // For DrawFaces. Depends only on the brick's position in the volume, not on which of its faces a box has. The brick lies at least partly
  // within the frame.
  FaceProjection Faces(const SurfaceBrick& brick, int side) const;

 private:
  // The projection of a box of data space: centre and half size, pixels.
  struct Extent {
    double x, y, half_x, half_y, least_w;
  };
  Extent Project(const Vec3& centre, const Vec3& half) const;

  const Camera& camera_;
  const Index3 volume_size_;
  Vec3 ray_x_, ray_y_;                          // change of a ray per pixel: of its direction (perspective) or its origin
  Vec3 direction_;                              // the central ray's direction
  std::array<FaceProjection, kSides> by_side_;  // the part that all bricks share
};

}  // namespace slabstream
