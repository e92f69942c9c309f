// The inner loop of the Z-buffer: draws the faces of one side of the cells of a brick into the keys of a band of pixels.
//
// A key holds a pixel's depth (float bits, 32 ... 63) and the number of the visible face (0 ... 31). The least key is the nearest face; at
// equal depth, the face with the lower number. So the order of faces does not matter. An empty pixel has infinite depth and any number.
// Depths that clipping cuts out of a pixel's ray are not drawn (DepthLimits).
//
// A pixel centre's offset (dx, dy) from the projected centre of a face decides whether it is hit, in the plane of the face:
//   orthographic: du = u_x dx + u_y dy, dv alike; hit: max(|du|, |dv|) < kFaceReach; depth = that of the centre + depth_x dx + depth_y dy
//   perspective:  the same over 1 + slope_x dx + slope_y dy, with coefficients of each face
// Centres are relative to the brick, so single precision suffices: the error is below 2^-16 of a voxel's size on the screen (at most 45
// voxels' steps, some ten roundings to 2^-24). Faces reach 2^-14 voxel beyond their edges, so no ray passes between two that share an edge.
// No operation is fused or reordered: a key has the same bits on every instruction set, and depends only on pixel, face and camera.
#pragma once

#include <cstdint>

#include "common/image/pixel_bounds.h"
#include "common/view/camera.h"
#include "worker/kernels/surface_face.h"

namespace slabstream {

inline constexpr float kFaceReach = 0.5F + 0x1p-14F;
inline constexpr std::uint64_t kEmptyKey = 0x7F800000FFFFFFFF;
inline constexpr std::size_t kSitesReadAhead = 16;
inline constexpr int kKeyPadding = 16;  // keys after each row that kernels may change; they are never read

// Depths that clipping cuts out of the rays of a band's pixels, placed as the keys are: those in [from, to], or all others.
struct DepthLimits {
  const float* from = nullptr;  // null: nothing is clipped
  const float* to = nullptr;
  bool inside = false;  // depths in [from, to] are drawn, and no others; else the others
};

// Keys of the pixels of `bounds`: pixel (x, y) at (y - bounds.y_begin) * stride + x - bounds.x_begin; stride >= width + kKeyPadding.
struct KeyBand {
  std::uint64_t* keys = nullptr;
  std::size_t stride = 0;
  PixelBounds bounds;
  DepthLimits limits;
};

// Faces of one side of a brick on the screen. The face of the brick's voxel (0, 0, 0) has its centre at x - 0.5 = column + x_phase, that of
// voxel (i, j, k) at x_phase + (i x_step[0] + j x_step[1] + k x_step[2]) / depth (orthographic: without the division).
struct FaceProjection {
  std::int32_t column = 0, row = 0;
  float x_phase = 0, y_phase = 0, depth = 0;
  float x_step[3]{}, y_step[3]{}, depth_step[3]{};
  float half_width = 0, half_height = 0;  // pixels that a face can reach from its centre
  // Orthographic.
  float u_x = 0, u_y = 0, v_x = 0, v_y = 0, depth_x = 0, depth_y = 0;
  // Perspective: the vector from the eye to the centre of the first face, and the change of a ray's direction per pixel, along the normal
  // axis a, u and v.
  int a = 0, u = 1, v = 2;
  float sign = 1;  // the side's sign: faces are seen where sign * (centre - eye) < 0 along a
  float eye_a = 0, eye_u = 0, eye_v = 0;
  float ray_x_a = 0, ray_x_u = 0, ray_x_v = 0, ray_y_a = 0, ray_y_u = 0, ray_y_v = 0;
};

// Draws faces first ... first + count - 1 of `sites`, all of one side and brick. May read kSitesReadAhead more. Prefetches the `normals`
// (also by face) of faces that may be visible, because shading comes soon. Returns how many faces may touch pixels of the band.
std::size_t DrawFaces(Projection projection, const FaceProjection& faces, const FaceSite* sites, const FaceNormals* normals,
                      std::uint32_t first, std::uint32_t count, const KeyBand& band);

// True if DrawFaces changes no pixel of `bounds` with faces at `depth` or behind it: all that the limits let through is hidden. `bounds`
// lie in the band.
bool AllHidden(const KeyBand& band, const PixelBounds& bounds, float depth);

}  // namespace slabstream
