// What all renderers that take samples along rays have: --sampling-rate, and how far a sample reaches.
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream {

// The first parameter of each.
inline RendererParameter SamplingRate(double standard = 1) {
  return {.name = "sampling-rate", .purpose = "Samples along a ray in each voxel length", .standard = standard, .least = 0.1, .most = 16};
}

// A sample lies between voxels of its box, or half a voxel beyond them. It interpolates the eight voxels round it, and its gradient is
// interpolated from differences of their neighbours.
inline constexpr std::int32_t kRayReach = 2;
// Voxels that are read in parts are kept as rays read them. What is derived are ranges of macrocells, and the padding.
inline constexpr double kRayDerived = 0.25;

// The sampling rate, of CostBasis::parameters.
inline double SamplingRateOf(std::span<const double> parameters, double standard = 1) {
  return parameters.empty() ? standard : parameters.front();
}

}  // namespace slabstream
