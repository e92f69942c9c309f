// Light by normal code: Phong::ByNormalCode for all codes at once, in single precision, within 2e-7 * max(shininess, 20) of the definition
// per light.
#pragma once

#include <vector>

#include "worker/kernels/phong.h"

namespace slabstream {

// [normal code], kNoGradient included.
std::vector<PhongFactors> PhongTable(const Shading& shading, const Vec3& view_direction);

}  // namespace slabstream
