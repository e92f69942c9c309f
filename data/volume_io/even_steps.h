// Coordinates of voxels along an axis, as one start and one step.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slabstream {

struct EvenSteps {
  double first = 0, step = 1;  // the step is finite and not 0
};

// From the first to the last of two coordinates or more, which need not be even.
EvenSteps MeanSteps(const std::vector<double>& coordinates);

// nullopt: fewer than two; a coordinate lies farther than 2 % of a step off its place; they do not change.
std::optional<EvenSteps> EvenStepsOf(const std::vector<double>& coordinates);

// The steps between the centres of cells. `bounds` has the two ends of each cell, in either order (CF conventions, 7.1). nullopt: the
// centres are not even, as above; or the length of a cell differs from the step by more than 2 %. The step of a single cell is its length.
std::optional<EvenSteps> EvenCellsOf(const std::vector<double>& bounds);

// What keeps two coordinates or more from being even, for messages: "number 1 is 850, an even one would be 550".
std::string WhyUneven(const std::vector<double>& coordinates);

}  // namespace slabstream
