// GrowTree: kd-trees by recursive bisection in proportion, which is how slabs, beams, subcubes and kd-trees are made alike.
//
// A box that is to hold n boxes is cut across its longest side (of the axes allowed), so that floor(n / 2) and ceil(n / 2) of them get
// their shares of the work; and so on with both parts. Cuts that follow one another along one axis are quantiles of the box that the first
// of them cut: one rounding each, none adds up.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "common/decomposition/decomposition.h"

namespace slabstream {

// Thinner empty space stays with what is beside it: it costs its owner nothing to render, and a plane more than it saves.
inline constexpr std::int32_t kLeastCut = 4;  // voxels

struct GrowOptions {
  std::span<const Axis> axes;  // that may be cut; of equally long sides the first one is
  // Slices along the first axis from which on it is cut, however long the other sides are.
  std::int32_t first_axis_down_to = std::numeric_limits<std::int32_t>::max();
  bool cut_away_empty = false;
};

Partition GrowTree(const DecompositionRequest& request, const GrowOptions& options);

// The axes that are not `axis`, the longer side first.
std::array<Axis, 2> OtherAxes(const Index3& size, Axis axis);

}  // namespace slabstream
