#include "data/volume_io/even_steps.h"

#include <cmath>
#include <cstddef>

namespace slabstream {

std::optional<EvenSteps> EvenStepsOf(const std::vector<double>& coordinates) {
  constexpr double kTolerance = 0.01;  // of a step: files round their numbers
  if (coordinates.size() < 2) return std::nullopt;
  const EvenSteps steps{coordinates.front(), (coordinates.back() - coordinates.front()) / double(coordinates.size() - 1)};
  if (steps.step == 0 || !std::isfinite(steps.step)) return std::nullopt;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const double off = coordinates[i] - (steps.first + double(i) * steps.step);
    if (!(std::abs(off) <= kTolerance * std::abs(steps.step))) return std::nullopt;  // NaN, too
  }
  return steps;
}

}  // namespace slabstream
