// The second pass of the Z-buffer: keys of pixels (draw_faces.h) become colours, depths and indices. Each pixel is shaded once.
//
// The depth gives the point that was hit. The normals at the four corners of the face are blended bilinearly, normalised, and lit by Phong
// (phong.h) with the shares of FrameLight at the point, all in single precision without fused operations: the same bits on every
// instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/view/camera.h"
#include "common/view/shading.h"
#include "worker/kernels/surface_face.h"
#include "worker/light/frame_light.h"

namespace slabstream {

struct FaceShading {
  const FaceSite* sites = nullptr;       // by number of the face; at least one
  const FaceNormals* normals = nullptr;  // by number of the face
  const float* colors = nullptr;         // [bin][4]: straight colour, and one more
  // Labels; null: not shown. With the share s of the label, a face has the colour (1 - s) * (colour of its bin) + s * (colour of its
  // label).
  const std::uint32_t* labels = nullptr;  // by number of the face
  const float* label_colors = nullptr;    // [label][4]: s * straight colour, s

  // hit = origin + x * origin_x + y * origin_y + depth * (direction + x * direction_x + y * direction_y) at pixel centre (x, y). data
  // space.
  float origin[3]{}, origin_x[3]{}, origin_y[3]{}, direction[3]{}, direction_x[3]{}, direction_y[3]{};

  bool phong = true;
  int light_count = 0;
  float light[kMaxLights][3]{}, light_to_viewer[kMaxLights]{};  // unit; the cosine between light and viewer
  float to_viewer[3]{};                                         // unit
  float ambient = 0, diffuse = 0, specular = 0, shininess = 1;
  float diffuse_without_normal = 1;

  const FrameLight::View* frame_light = nullptr;  // shadows and ambient occlusion; null: there are none

  std::uint32_t bricks_x = 0, bricks_y = 0;  // bricks of the whole volume, for FaceIndex
};

FaceShading MakeFaceShading(const Camera& camera, const Shading& shading, const Index3& volume_size);

// Pixels (column ... column + count - 1, row). Fills rgba[4 * count], depth[count] and voxel[count] (FaceIndex); empty pixels become 0,
// infinity, 0.
void ShadeFaceRow(const FaceShading& shading, const std::uint64_t* keys, std::int32_t column, std::int32_t row, std::size_t count,
                  float* rgba, float* depth, std::uint32_t* voxel);

}  // namespace slabstream
