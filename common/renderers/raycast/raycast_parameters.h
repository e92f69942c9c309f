// The parameters of ray casting, after the sampling rate.
#pragma once

#include <cstddef>
#include <span>

namespace slabstream::raycast {

// --gradient: of light (docs/rendering.md). By value of the parameter.
enum class GradientKind { kCentral = 0, kSmooth = 1 };

inline constexpr std::size_t kJitter = 1, kGradient = 2;  // places among the parameters

inline bool SmoothGradient(std::span<const double> parameters) { return GradientKind(int(parameters[kGradient])) == GradientKind::kSmooth; }

}  // namespace slabstream::raycast
