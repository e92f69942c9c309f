#include "data/volume_io/even_steps.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>

namespace slabstream {
namespace {

// The first coordinate that is off its place, or their number.
std::size_t FirstUneven(const std::vector<double>& coordinates, const EvenSteps& steps) {
  constexpr double kTolerance = 0.02;  // of a step: files round their numbers, and Gaussian latitudes are up to 0.014 off
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const double off = coordinates[i] - (steps.first + double(i) * steps.step);
    if (!(std::abs(off) <= kTolerance * std::abs(steps.step))) return i;  // NaN, too
  }
  return coordinates.size();
}

EvenSteps MeanSteps(const std::vector<double>& coordinates) {
  return {coordinates.front(), (coordinates.back() - coordinates.front()) / double(coordinates.size() - 1)};
}

}  // namespace

std::optional<EvenSteps> EvenStepsOf(const std::vector<double>& coordinates) {
  if (coordinates.size() < 2) return std::nullopt;
  const EvenSteps steps = MeanSteps(coordinates);
  if (steps.step == 0 || !std::isfinite(steps.step) || FirstUneven(coordinates, steps) < coordinates.size()) return std::nullopt;
  return steps;
}

std::string WhyUneven(const std::vector<double>& coordinates) {
  const EvenSteps steps = MeanSteps(coordinates);
  const std::size_t i = FirstUneven(coordinates, steps);
  if (i == coordinates.size()) return fmt::format("all are {:g}", steps.first);
  return fmt::format("number {} is {:g}, an even one would be {:g}", i, coordinates[i], steps.first + double(i) * steps.step);
}

}  // namespace slabstream
