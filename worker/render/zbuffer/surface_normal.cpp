#include "worker/render/zbuffer/surface_normal.h"

#include <algorithm>
#include <array>
#include <type_traits>

namespace slabstream {
namespace {

// Along one axis, the B-spline over three places and the differences or smoothing at each are one filter over five samples, from two below
// the voxel to two above it. At the border samples outside have no weight.
struct Taps {
  std::array<std::int64_t, 5> offset{};  // samples from the voxel
  std::array<double, 5> smooth{};        // sums to 1
  std::array<double, 5> slope{};         // 1 / physical distance; sums to 0
};

Taps TapsAlong(int axis, const Box& box, const Vec3& spacing, const Index3& voxel, const Vec3& point) {
  const Index3 size = box.size();
  const std::int64_t stride = axis == 0 ? 1 : axis == 1 ? size.x : std::int64_t{1} * size.x * size.y;
  const auto inside = [&](std::int32_t at) { return std::clamp(at, box.begin[axis], box.end[axis] - 1); };
  const auto tap = [&](std::int32_t at) { return std::size_t(at) - std::size_t(voxel[axis]) + 2; };
  Taps taps;
  for (std::int32_t at = voxel[axis] - 2; at <= voxel[axis] + 2; ++at) taps.offset[tap(at)] = (inside(at) - voxel[axis]) * stride;

  const double t = point[axis] - voxel[axis];
  const std::array<double, 3> spline = {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
  for (int i = 0; i < 3; ++i) {
    const std::int32_t at = inside(voxel[axis] + i - 1), below = inside(at - 1), above = inside(at + 1);
    const double weight = spline[std::size_t(i)];
    taps.smooth[tap(below)] += 0.25 * weight;
    taps.smooth[tap(at)] += 0.5 * weight;
    taps.smooth[tap(above)] += 0.25 * weight;
    if (above == below) continue;  // the volume is one voxel thick
    const double per_distance = weight / ((above - below) * spacing[axis]);
    taps.slope[tap(below)] -= per_distance;
    taps.slope[tap(above)] += per_distance;
  }
  return taps;
}

}  // namespace

Vec3 GradientAt(const VoxelBlock& voxels, const Vec3& spacing, const Index3& voxel, const Vec3& point) {
  const Taps along_x = TapsAlong(0, voxels.box, spacing, voxel, point);
  const Taps along_y = TapsAlong(1, voxels.box, spacing, voxel, point);
  const Taps along_z = TapsAlong(2, voxels.box, spacing, voxel, point);
  return VisitScalarType(voxels.type, [&](auto* type) {
    const auto* centre = voxels.samples<std::remove_cvref_t<decltype(*type)>>() + voxels.Offset(voxel);
    const auto own = double(*centre);  // taken off every sample, so that the gradient of a constant is exactly 0
    Vec3 gradient;
    for (std::size_t k = 0; k < 5; ++k) {
      Vec3 slice;  // d/dx, d/dy and value of the slice
      for (std::size_t j = 0; j < 5; ++j) {
        const auto* row = centre + (along_z.offset[k] + along_y.offset[j]);
        double value = 0, slope = 0;
        for (std::size_t i = 0; i < 5; ++i) {
          const double rise = double(row[along_x.offset[i]]) - own;
          value += along_x.smooth[i] * rise;
          slope += along_x.slope[i] * rise;
        }
        slice = slice + Vec3{along_y.smooth[j] * slope, along_y.slope[j] * value, along_y.smooth[j] * value};
      }
      gradient = gradient + Vec3{along_z.smooth[k] * slice.x, along_z.smooth[k] * slice.y, along_z.slope[k] * slice.z};
    }
    return gradient;
  });
}

}  // namespace slabstream
