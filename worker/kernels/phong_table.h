// Phong shading by table: the light of every normal that a voxel's code can name.
#pragma once

#include <vector>

#include "common/view/phong.h"

namespace slabstream {

// Light by normal code (normal_code.h), kNoGradient included: in single precision, within 2e-7 * max(shininess, 20) of the definition per
// light.
std::vector<PhongFactors> PhongTable(const Shading& shading, const Vec3& view_direction);

}  // namespace slabstream
