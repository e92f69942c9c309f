// The light that reaches each voxel of a light volume from a light at infinity.
//
// Planes of voxels across the axis that the light is nearest to are visited one after the other, away from the light (Behrens and Ratering
// 1998). What has been accumulated stays on the rays of the light, one for each voxel of a plane, so it is not blurred from plane to plane:
// the matter's transmittance is interpolated at the rays, and at the end the rays' transmittance at the voxels, each once.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/light/extinction.h"

namespace slabstream {

// Matter nearer to a voxel than so many steps, towards the light, does not shade it. A step leads from a plane to the next one. So a
// surface does not shade itself, though it is blurred over two voxels here.
inline constexpr double kShadowOffset = 1.5;

// Voxels [begin, end) of a row.
struct MatterRange {
  std::int32_t begin = 0, end = 0;
  bool empty() const { return begin == end; }
};

// An Extinction in rows that light meets side by side: along x (then y, then z), or along y (then z, then x).
struct LightRows {
  const float* each = nullptr;
  UnwrittenVector<float> turned;    // `each`, of rows along y
  std::vector<MatterRange> matter;  // by row: voxels outside of these take no light
};
LightRows RowsAlongX(const Extinction& extinction);  // which must live as long
LightRows RowsAlongY(const Extinction& extinction);
// Whether light from there, which is nearest to x, is followed through rows along y.
bool SweepsAlongX(const Extinction& extinction, const Vec3& to_light);

// `to_light`: unit, along the voxels' axes, in the unit of the world. `rows`: along y if SweepsAlongX, else along x. `strength`: [0, 1].
// Sets out[voxel] = 255 (1 - strength (1 - transmittance)), rounded, in the order of the rows. Parallel; the result is the same for any
// number of threads and any instruction set.
void FindTransmittance(const Extinction& extinction, const LightRows& rows, const Vec3& to_light, double strength, std::uint8_t* out);

}  // namespace slabstream
