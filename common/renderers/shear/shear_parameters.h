// The parameters of multi-pass shears, after the sampling rate.
#pragma once

#include <cstddef>
#include <span>

namespace slabstream::shear {

// --kernel: of reconstruction along each axis (worker/renderers/shear/cubic_kernel.h). By value of the parameter.
enum class Kernel { kCatmullRom = 0, kMitchell = 1, kBSpline = 2, kLinear = 3 };

inline constexpr std::size_t kKernel = 1, kSupersampling = 2;  // places among the parameters

// Beams, and slices, that are resampled for each one of the volume.
inline int SupersamplingOf(std::span<const double> parameters) { return 1 + int(parameters[kSupersampling]); }

}  // namespace slabstream::shear
