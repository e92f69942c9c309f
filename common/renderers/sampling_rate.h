// --sampling-rate: the parameter of all renderers that take samples along rays.
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream {

// The first parameter of each.
inline RendererParameter SamplingRate(double standard = 1) {
  return {.name = "sampling-rate", .purpose = "Samples along a ray in each voxel length", .standard = standard, .least = 0.1, .most = 16};
}

// Its value, of CostBasis::parameters.
inline double SamplingRateOf(std::span<const double> parameters, double standard = 1) {
  return parameters.empty() ? standard : parameters.front();
}

}  // namespace slabstream
