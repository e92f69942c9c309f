// ViewRays: the sample positions of an image-order renderer.
//
// Each pixel has one ray, through its centre. Sample k lies k steps behind the ray's first sample, in equal physical distances (`step`).
// The first sample is a whole number of steps away from the eye (perspective) or the eye plane (orthographic). All rays start at the same
// distance, in front of the volume's bounding sphere. (If clipping leaves a slab that faces an orthographic view, samples lie evenly about
// its middle instead, so that a thin one is a slice.) So samples depend only on the view and the volume's geometry, never on a box: boxes
// that ask for the same sample compute the same position, bit for bit (ray_packet-inl.h).
//
// Slicing takes OnPlanes instead: the samples k of all rays lie on one plane of equal depth, also under perspective.
//
// Clipping leaves one part of a ray, or two if the region is cut away. Its ends depend on ray and region alone, so that boxes agree on
// them.
//
// Positions are single precision with separately rounded operations. Their error is below 2^-22 times the side of the volume in voxels.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/image/local_image.h"
#include "common/view/camera.h"
#include "common/view/clip.h"

namespace slabstream {

using Float3 = std::array<float, 3>;
inline Float3 ToFloat3(const Vec3& v) { return {float(v.x), float(v.y), float(v.z)}; }

// ClipRegion in single precision.
struct RayClip {
  struct Side {
    Float3 normal{};
    float offset = 0;
  };
  std::vector<Side> sides;
  bool cut_away = false;
  float face_depth = 0;  // physical: samples so near behind a cut are lit as parts of a flat face

  bool empty() const { return sides.empty(); }
};

struct ViewRays {
  bool perspective = false;
  float centre_x = 0, centre_y = 0;  // the image's centre in pixels, minus half a pixel
  // Data space. `right` and `down`: a pixel's offset from the image's centre along x and y. `forward`: the movement of the central ray per
  // unit of physical distance. `start`: the first sample of the central ray.
  Float3 right{}, down{}, forward{}, start{};
  float pixel_squared = 0;        // square of a pixel's physical size (perspective: at unit depth)
  float bend = 0;                 // pixel_squared: samples of one k lie on a sphere round the eye (perspective); 0: on a plane
  float start_distance = 0;       // physical, from eye or eye plane to the first sample
  float step = 0;                 // physical
  std::int32_t sample_count = 0;  // k < sample_count holds for every sample within the volume
  Float3 volume_end{};            // the volume fills the positions p with -0.5 <= p < volume_end on every axis
  // Samples lie by up to this share of a step farther from the eye, by pixel: R2 of Roberts (2018), whose neighbours differ widely. So
  // rings of equal samples become a fine pattern. [0, 1]
  float jitter = 0;
  RayClip clip;
};

// The distance of samples along a ray: `samples_per_voxel` to the least spacing of the volume. In a rectilinear grid, to the least distance
// of its voxels, but at most kMostInDiagonal to the volume's diagonal.
inline constexpr double kMostInDiagonal = 65536;
double StepOf(const VolumeGeometry& geometry, double samples_per_voxel);

// `samples_per_voxel`: samples along a ray, as StepOf has them, > 0.
ViewRays MakeViewRays(const Camera& camera, const VolumeGeometry& geometry, double samples_per_voxel, const ClipRegion& clip = {});
// The same rays, jittered; not where a clipped slab faces the view, whose samples lie in its middle. `jitter`: [0, 1].
ViewRays Jittered(ViewRays rays, const Camera& camera, const ClipRegion& clip, double jitter);

// The same rays with samples on planes of equal depth, `step` apart.
inline ViewRays OnPlanes(ViewRays rays) {
  rays.bend = 0;
  return rays;
}

inline constexpr float kLeastCrossing = 1e-6F;  // physical distance a sample: a ray that moves less runs along a side
inline constexpr float kRayEnd = 1e9F;          // beyond every sample, either sign

// Samples [begin, end) and pixels that a data-space box may touch, with some slack. The pixels lie within the camera's image.
struct RayReach {
  std::int32_t begin = 0, end = 0;
  PixelBounds pixels;
};
RayReach ReachOfBox(const ViewRays& rays, const Camera& camera, const Vec3& low, const Vec3& high);

// The share of a voxel's volume that a sample at the volume's centre represents: a pixel's area times a step.
double VoxelsASample(const ViewRays& rays, const Camera& camera, const VolumeGeometry& geometry);

}  // namespace slabstream
