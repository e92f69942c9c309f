#include "worker/render/zbuffer/surface_normal.h"

#include <algorithm>
#include <array>
#include <type_traits>

namespace slabstream {
namespace {

// One of the three places along an axis: its share, and where central differences there read. Offsets are in samples from the voxel.
struct Place {
  double weight;
  std::int64_t offset;
  std::int64_t below, above;  // from the place
  double per_distance;        // 1 / physical distance of the two; 0 where the volume is one voxel thick
};

std::array<Place, 3> PlacesAlong(int axis, const Box& box, const Vec3& spacing, const Index3& voxel, const Vec3& point) {
  const Index3 size = box.size();
  const std::int64_t stride = axis == 0 ? 1 : axis == 1 ? size.x : std::int64_t{1} * size.x * size.y;
  const double t = point[axis] - voxel[axis];
  const std::array<double, 3> weights = {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
  std::array<Place, 3> places{};
  for (int i = 0; i < 3; ++i) {
    const std::int32_t at = std::clamp(voxel[axis] + i - 1, box.begin[axis], box.end[axis] - 1);
    const std::int32_t below = std::max(at - 1, box.begin[axis]), above = std::min(at + 1, box.end[axis] - 1);
    places[std::size_t(i)] = {weights[std::size_t(i)], (at - voxel[axis]) * stride, (below - at) * stride, (above - at) * stride,
                              above == below ? 0.0 : 1 / ((above - below) * spacing[axis])};
  }
  return places;
}

}  // namespace

Vec3 GradientAt(const VoxelBlock& voxels, const Vec3& spacing, const Index3& voxel, const Vec3& point) {
  const auto along_x = PlacesAlong(0, voxels.box, spacing, voxel, point);
  const auto along_y = PlacesAlong(1, voxels.box, spacing, voxel, point);
  const auto along_z = PlacesAlong(2, voxels.box, spacing, voxel, point);
  return VisitScalarType(voxels.type, [&](auto* type) {
    const auto* centre = voxels.samples<std::remove_cvref_t<decltype(*type)>>() + voxels.Offset(voxel);
    Vec3 sum;
    for (const Place& z : along_z) {
      for (const Place& y : along_y) {
        for (const Place& x : along_x) {
          const auto* p = centre + (x.offset + y.offset + z.offset);
          const double weight = x.weight * y.weight * z.weight;
          sum.x += weight * x.per_distance * (double(p[x.above]) - double(p[x.below]));
          sum.y += weight * y.per_distance * (double(p[y.above]) - double(p[y.below]));
          sum.z += weight * z.per_distance * (double(p[z.above]) - double(p[z.below]));
        }
      }
    }
    return sum;
  });
}

}  // namespace slabstream
