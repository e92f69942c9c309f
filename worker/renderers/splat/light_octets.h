// Shadows and ambient occlusion of splatting: the light on each voxel of octets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/view/phong.h"
#include "common/view/sheet_grid.h"
#include "worker/kernels/shade.h"
#include "worker/light/frame_light.h"

namespace slabstream {

// A voxel of a slice.
struct VoxelPlace {
  std::int32_t u = 0, v = 0;
};

// Made once a frame.
struct OctetLight {
  // `light`: the frame's, which must outlive this.
  OctetLight(const Shading& shading, const Vec3& view_direction, const FrameLight& light);

  FrameLight::View view;
  float ambient = 0;                                // the ambient part of a normal's factors
  std::vector<std::vector<PhongFactors>> by_light;  // by normal code: of each light alone; empty: there is one light
};

// Octets of one slice, with `places` of their voxels 0. Sets their shares, which `shares` has room for.
void LightOctets(const OctetLight& light, const SliceAxes& axes, std::int32_t slice, std::span<const VoxelPlace> places,
                 std::span<OctetWork> octets, std::vector<OctetShares>& shares);

}  // namespace slabstream
