// GrowTree makes slabs, beams, subcubes and kd-trees alike: as kd-trees, by recursive bisection in proportion.
//
// A box to be divided into n boxes is cut across its longest side (of the axes allowed), so that floor(n / 2) and
// ceil(n / 2) of them get their shares of the work; both parts are divided in the same way. Successive cuts along one
// axis are quantiles of the box that the first of them cut: each is rounded once, and errors do not add up.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "common/decomposition/decomposition.h"

namespace slabstream {

// Thinner empty space stays in its box: it costs nothing to render, and another plane costs more than it saves.
inline constexpr std::int32_t kLeastCut = 4;  // voxels

struct GrowOptions {
  std::span<const Axis> axes;  // axes that may be cut; of equally long sides, the first one is cut
  // The first axis is cut as long as it has at least this many slices, however long the other sides are.
  std::int32_t first_axis_down_to = std::numeric_limits<std::int32_t>::max();
  bool cut_away_empty = false;
};

Partition GrowTree(const DecompositionRequest& request, const GrowOptions& options);

// The axes that are not `axis`, the longer side first.
std::array<Axis, 2> OtherAxes(const Index3& size, Axis axis);

}  // namespace slabstream
