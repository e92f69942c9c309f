// --sampling-rate: the parameter of all renderers that take samples along rays.
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream {

// The first parameter of each.
inline RendererParameter SamplingRate() {
  return {.name = "sampling-rate", .purpose = "Samples along a ray in each voxel length", .standard = 1, .least = 0.1, .most = 16};
}

// Its value, of CostBasis::parameters.
inline double SamplingRateOf(std::span<const double> parameters) {
  return parameters.empty() ? SamplingRate().standard : parameters.front();
}

}  // namespace slabstream
