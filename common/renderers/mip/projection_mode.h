// What an intensity projection shows of the samples along a ray.
#pragma once

#include <cstdint>

#include "common/frame/frame_setup.h"

namespace slabstream::mip {

enum class ProjectionMode : std::uint8_t { kMaximum = 0, kMinimum = 1, kMean = 2 };

// The renderer's parameters, in the order of RendererKind::parameters.
inline double SamplesPerVoxel(const FrameSetup& setup) { return setup.parameters.at(0); }
inline ProjectionMode ModeOf(const FrameSetup& setup) { return ProjectionMode(int(setup.parameters.at(1))); }
inline bool TakesNearestVoxel(const FrameSetup& setup) { return setup.parameters.at(2) != 0; }

// What the four channels of a pixel hold. Value: data values from the volume's least (0) to its largest (1).
//   maximum  kMaximum  (value, 0, 0, 1)
//   minimum  kMaximum  (1 - value, 0, 0, 1)
//   mean     kSum      the sum of all values and their number (SumOfValues, common/renderers/projection_kind.h)

}  // namespace slabstream::mip
