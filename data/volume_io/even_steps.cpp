#include "data/volume_io/even_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace slabstream {
namespace {

constexpr double kTolerance = 0.02;  // of a step: files round their numbers, and Gaussian latitudes are up to 0.014 off

// The first coordinate that is off its place, or their number.
std::size_t FirstUneven(const std::vector<double>& coordinates, const EvenSteps& steps) {
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const double off = coordinates[i] - (steps.first + double(i) * steps.step);
    if (!(std::abs(off) <= kTolerance * std::abs(steps.step))) return i;  // NaN, too
  }
  return coordinates.size();
}

}  // namespace

EvenSteps MeanSteps(const std::vector<double>& coordinates) {
  return {coordinates.front(), (coordinates.back() - coordinates.front()) / double(coordinates.size() - 1)};
}

std::optional<EvenSteps> EvenStepsOf(const std::vector<double>& coordinates) {
  if (coordinates.size() < 2) return std::nullopt;
  const EvenSteps steps = MeanSteps(coordinates);
  if (steps.step == 0 || !std::isfinite(steps.step) || FirstUneven(coordinates, steps) < coordinates.size()) return std::nullopt;
  return steps;
}

std::optional<EvenSteps> EvenCellsOf(const std::vector<double>& bounds) {
  std::vector<double> centres, lengths;
  for (std::size_t i = 0; i + 1 < bounds.size(); i += 2) {
    centres.push_back(std::midpoint(bounds[i], bounds[i + 1]));
    lengths.push_back(std::abs(bounds[i + 1] - bounds[i]));
  }
  if (centres.size() == 1 && lengths[0] > 0 && std::isfinite(lengths[0])) return EvenSteps{centres[0], lengths[0]};
  const std::optional<EvenSteps> even = EvenStepsOf(centres);
  const auto fills = [&](double length) { return std::abs(length - std::abs(even->step)) <= kTolerance * std::abs(even->step); };
  return even && std::ranges::all_of(lengths, fills) ? even : std::nullopt;
}

std::string WhyUneven(const std::vector<double>& coordinates) {
  const EvenSteps steps = MeanSteps(coordinates);
  const std::size_t i = FirstUneven(coordinates, steps);
  if (i == coordinates.size()) return fmt::format("all are {:g}", steps.first);
  return fmt::format("number {} is {:g}, an even one would be {:g}", i, coordinates[i], steps.first + double(i) * steps.step);
}

}  // namespace slabstream
