// Coordinates of voxels along an axis, as one start and one step.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slabstream {

struct EvenSteps {
  double first = 0, step = 1;  // the step is finite and not 0
};

// nullopt: fewer than two; a coordinate lies farther than 2 % of a step off its place; they do not change.
std::optional<EvenSteps> EvenStepsOf(const std::vector<double>& coordinates);

// What keeps two coordinates or more from being even, for messages: "number 1 is 850, an even one would be 550".
std::string WhyUneven(const std::vector<double>& coordinates);

}  // namespace slabstream
