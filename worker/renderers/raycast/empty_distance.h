// EmptyDistance: for each cell the Chebyshev distance, in cells, to the nearest visible cell; 0 in a visible cell. A ray in a cell of
// distance d may leap over all cells less than d away (Zuiderveld et al. 1992 call such a map proximity clouds).
#pragma once

#include <cstdint>
#include <vector>

#include "worker/rays/macrocell_ranges.h"
#include "worker/rays/ray_look.h"

namespace slabstream {

inline constexpr std::size_t kEmptyDistancePadding = 3;  // bytes after the last distance: kernels read four at a time

// [z][y][x] and the padding; at most 255.
std::vector<std::uint8_t> EmptyDistances(const MacrocellRanges& cells, const VisibleSamples& visible);
// The same where more is visible: `distance` has the padding, 0 in visible cells and 255 elsewhere.
std::vector<std::uint8_t> EmptyDistances(const Index3& counts, std::vector<std::uint8_t> distance);
// What it begins with.
std::vector<std::uint8_t> VisibleCells(const MacrocellRanges& cells, const VisibleSamples& visible);

}  // namespace slabstream
