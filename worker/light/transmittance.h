// The light that reaches each voxel of a light volume from a light at infinity.
//
// Planes of voxels across the axis that the light is nearest to are visited one after the other, away from the light (Behrens and Ratering
// 1998). What has been accumulated stays on the rays of the light, one for each voxel of a plane, so it is not blurred from plane to plane:
// the matter's transmittance is interpolated at the rays, and at the end the rays' transmittance at the voxels, each once.
#pragma once

#include <array>
#include <cstdint>

#include "worker/light/extinction.h"

namespace slabstream {

// Matter nearer to a voxel than so many steps, towards the light, does not shade it. A step leads from a plane to the next one. So a
// surface does not shade itself, though it is blurred over two voxels here.
inline constexpr double kShadowOffset = 1.5;

// An Extinction with its axes in another order, for rows along another axis than x.
struct TurnedExtinction {
  std::array<int, 3> axes = {0, 1, 2};  // the fastest axis first
  UnwrittenVector<float> each;
};
// The fastest axis becomes y, the slowest one x.
TurnedExtinction Turned(const Extinction& extinction);

// `to_light`: unit, along the voxels' axes, in the unit of the world. `turned`: Turned(extinction), if the light is nearest to x
// (SweepsAlongX); else it is not read. `strength`: [0, 1]. Sets out[NumberIn(size, voxel)] = 255 (1 - strength (1 - transmittance)),
// rounded: x fastest. Parallel; the result is the same for any number of threads and any instruction set.
void FindTransmittance(const Extinction& extinction, const TurnedExtinction& turned, const Vec3& to_light, double strength,
                       std::uint8_t* out);
bool SweepsAlongX(const Extinction& extinction, const Vec3& to_light);

}  // namespace slabstream
