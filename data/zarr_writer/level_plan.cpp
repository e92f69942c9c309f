#include "data/zarr_writer/level_plan.h"

#include <algorithm>
#include <limits>

namespace slabstream {

std::vector<WrittenLevel> PlanLevels(const VolumeGeometry& geometry, std::int32_t chunk_side) {
  constexpr double kAlike = 1.5;
  std::vector<WrittenLevel> levels = {{.size = geometry.size, .spacing = geometry.spacing}};
  while (true) {
    const WrittenLevel& last = levels.back();
    double least = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (last.size[axis] > chunk_side) least = std::min(least, last.spacing[axis]);
    }
    if (least == std::numeric_limits<double>::infinity()) return levels;
    WrittenLevel next = last;
    for (int axis = 0; axis < 3; ++axis) {
      const bool halved = last.size[axis] > 1 && last.spacing[axis] <= kAlike * least;
      next.step[axis] = halved ? 2 : 1;
      if (!halved) continue;
      next.size[axis] = (last.size[axis] + 1) / 2;
      next.spacing[axis] = 2 * last.spacing[axis];
      next.first[axis] = last.first[axis] + 0.5 * last.spacing[axis];
    }
    levels.push_back(next);
  }
}

}  // namespace slabstream
