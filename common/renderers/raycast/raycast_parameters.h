// The parameters of ray casting; the sampling rate is number 0.
#pragma once

#include <cstddef>
#include <span>

namespace slabstream::raycast {

// Which gradients light uses (docs/rendering.md). Enumerators are the parameter's values.
enum class GradientKind { kCentral = 0, kSmooth = 1 };

inline constexpr std::size_t kJitter = 1, kGradient = 2;  // places among the parameters

inline bool SmoothGradient(std::span<const double> parameters) { return GradientKind(int(parameters[kGradient])) == GradientKind::kSmooth; }

}  // namespace slabstream::raycast
