#include "tests/worker/kernels/clip_rows_reference.h"

#include <algorithm>
#include <cmath>

#include "common/volume/volume.h"

namespace slabstream::testing {

void RegionDepthsReference(const RegionRow& row, std::int32_t column, std::size_t count, float* enter, float* leave) {
  const auto depth = [&](double g) { return float(row.perspective ? -1 / g : g); };
  for (std::size_t n = 0; n < count; ++n) {
    const double x = double(column) + double(n) + 0.5;
    const auto at = [x](const LinearInRow& g) { return g.at_0 + x * g.by_x; };
    double entered = row.start, left = row.end;
    for (const LinearInRow& g : row.entered) entered = std::max(entered, at(g));
    for (const LinearInRow& g : row.left) left = std::min(left, at(g));
    for (const LinearInRow& g : row.never) left = at(g) < 0 ? row.start : left;
    const bool meets = entered < left;
    enter[n] = !meets ? kNeverMet : entered > row.start ? depth(entered) : 0;
    leave[n] = meets ? depth(left) : -1;
  }
}

void VoxelsAtReference(const RayRow& row, std::int32_t column, std::size_t count, const float* depth, double behind, std::int32_t* x,
                       std::int32_t* y, std::int32_t* z) {
  std::int32_t* const voxel[3] = {x, y, z};
  for (std::size_t n = 0; n < count; ++n) {
    const double pixel = double(column) + double(n) + 0.5;
    const auto at = [pixel](const LinearInRow& q) { return q.at_0 + pixel * q.by_x; };
    for (std::size_t i = 0; i < 3; ++i) {
      const double p = at(row.origin[i]) + (double(depth[n]) + behind) * at(row.direction[i]);
      voxel[i][n] = std::int32_t(std::floor(std::clamp(p + 0.5, -1.0, double(kMaxVolumeSide))));
    }
  }
}

}  // namespace slabstream::testing
