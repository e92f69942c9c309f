// Coordinates of voxels along an axis, as one start and one step.
#pragma once

#include <optional>
#include <vector>

namespace slabstream {

struct EvenSteps {
  double first = 0, step = 1;  // the step is finite and not 0
};

// nullopt: fewer than two; a coordinate lies farther than 1 % of a step off its place; they do not change.
std::optional<EvenSteps> EvenStepsOf(const std::vector<double>& coordinates);

}  // namespace slabstream
