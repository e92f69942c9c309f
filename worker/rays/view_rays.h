// ViewRays: the sample positions of an image-order renderer.
//
// Each pixel has one ray, through its centre. Sample k lies k steps behind the ray's first sample, in equal physical distances (`step`).
// The first sample is a whole number of steps away from the eye (perspective) or the eye plane (orthographic). All rays start at the same
// distance, in front of the volume's bounding sphere. So samples depend only on the view and the volume's geometry, never on a box: boxes
// that ask for the same sample compute the same position, bit for bit (SamplePosition and, lane by lane, ray_packet-inl.h).
//
// Positions are single precision with separately rounded operations. Their error is below 2^-22 times the side of the volume in voxels.
#pragma once

#include <array>
#include <cstdint>

#include "common/image/local_image.h"
#include "common/view/camera.h"

namespace slabstream {

using Float3 = std::array<float, 3>;

struct ViewRays {
  bool perspective = false;
  float centre_x = 0, centre_y = 0;  // of the image, in pixels, minus half a pixel
  // Data space. `right` and `down`: a pixel's offset from the image's centre along x and y. `forward`: the movement of the central ray per
  // unit of physical distance. `start`: the first sample of the central ray.
  Float3 right{}, down{}, forward{}, start{};
  float pixel_squared = 0;        // square of a pixel's physical size (perspective: at unit depth)
  float start_distance = 0;       // physical, from eye or eye plane to the first sample
  float step = 0;                 // physical
  std::int32_t sample_count = 0;  // k < sample_count holds for every sample within the volume
  Float3 volume_end{};            // the volume fills the positions p with -0.5 <= p < volume_end on every axis
};

// `samples_per_voxel`: samples along a ray per least voxel spacing of the volume, > 0.
ViewRays MakeViewRays(const Camera& camera, const VolumeGeometry& geometry, double samples_per_voxel);

// The ray of a pixel: sample k is at first + k * move in data space, by component.
struct PixelRay {
  Float3 first, move;
};
PixelRay RayOf(const ViewRays& rays, std::int32_t x, std::int32_t y);
Float3 SamplePosition(const PixelRay& ray, std::int32_t k);

// Samples [begin, end) and pixels that a data-space box may touch, with some slack. The pixels lie within the camera's image.
struct RayReach {
  std::int32_t begin = 0, end = 0;
  PixelBounds pixels;
};
RayReach ReachOfBox(const ViewRays& rays, const Camera& camera, const Vec3& low, const Vec3& high);

}  // namespace slabstream
