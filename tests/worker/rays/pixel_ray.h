// The definition of rays, one pixel at a time: the same bits as ray_packet-inl.h.
#pragma once

#include <array>
#include <cstdint>

#include "worker/rays/view_rays.h"

namespace slabstream::testing {

// The ray of a pixel: sample k is at first + k * move in data space, by component.
struct PixelRay {
  Float3 first, move;
};
PixelRay RayOf(const ViewRays& rays, std::int32_t x, std::int32_t y);
Float3 SamplePosition(const PixelRay& ray, std::int32_t k);

// A part of a ray that clipping leaves, in numbers of samples.
struct RayPart {
  float begin = -kRayEnd, end = kRayEnd;    // samples [begin, end)
  float enter = -kRayEnd, leave = kRayEnd;  // where the ray is cut, between samples; enter > leave: nothing is left
  Float3 face{};                            // data space: a normal of the face at `enter`, of any length
  float face_end = -kRayEnd;                // samples before this one lie within face_depth of it
};
// The parts of a ray, nearest first. A part may have no samples, begin >= end, and yet a length.
std::array<RayPart, 2> PartsOf(const RayClip& clip, const PixelRay& ray);

}  // namespace slabstream::testing
