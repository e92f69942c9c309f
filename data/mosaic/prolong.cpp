#include "data/mosaic/prolong.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace slabstream {
namespace {

// Where a voxel lies among those of the coarser level: between `low` and the next one.
struct Place {
  std::int32_t low = 0;
  double share = 0;  // of the next one
};

Place PlaceOf(std::int32_t voxel, int axis, const VolumeGeometry& fine, const VolumeGeometry& coarse) {
  const auto [x, y, z] = fine.orientation.FromWorld(fine.orientation.origin - coarse.orientation.origin);
  const double between = (std::array{x, y, z}.at(std::size_t(axis)) + voxel * fine.spacing[axis]) / coarse.spacing[axis];
  const double inside = std::clamp(between, 0.0, double(coarse.size[axis] - 1));
  const auto low = std::min(std::int32_t(inside), std::max(coarse.size[axis] - 2, 0));
  return {low, inside - low};
}

}  // namespace

Box BoxBetween(const Box& box, const VolumeGeometry& fine, const VolumeGeometry& coarse) {
  Box between;
  for (int axis = 0; axis < 3; ++axis) {
    between.begin[axis] = PlaceOf(box.begin[axis], axis, fine, coarse).low;
    between.end[axis] = std::min(PlaceOf(box.end[axis] - 1, axis, fine, coarse).low + 2, coarse.size[axis]);
  }
  return between;
}

template <class T>
void Prolong(const T* samples, const Box& box, const VolumeGeometry& fine, const VolumeGeometry& coarse, const BoxRoom& out) {
  const Box between = BoxBetween(box, fine, coarse);
  const Index3 size = between.size();
  // Within `samples`. The next one of the last voxel is itself.
  const auto place = [&](std::int32_t voxel, int axis) {
    Place found = PlaceOf(voxel, axis, fine, coarse);
    found.low -= between.begin[axis];
    return found;
  };
  const auto next = [&](const Place& at, int axis) { return std::min(at.low + 1, size[axis] - 1); };
  std::vector<Place> places;
  for (std::int32_t x = box.begin.x; x < box.end.x; ++x) places.push_back(place(x, 0));
  std::vector<double> row(std::size_t(size.x));
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    const Place at_z = place(z, 2);
    for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
      const Place at_y = place(y, 1);
      const auto row_of = [&](std::int32_t j, std::int32_t k) { return samples + (std::int64_t{k} * size.y + j) * size.x; };
      const std::array<const T*, 4> rows = {row_of(at_y.low, at_z.low), row_of(next(at_y, 1), at_z.low), row_of(at_y.low, next(at_z, 2)),
                                            row_of(next(at_y, 1), next(at_z, 2))};
      const auto mix = [](double a, double b, double share) { return a + share * (b - a); };
      for (std::size_t i = 0; i < row.size(); ++i) {
        row[i] = mix(mix(double(rows[0][i]), double(rows[1][i]), at_y.share), mix(double(rows[2][i]), double(rows[3][i]), at_y.share),
                     at_z.share);
      }
      T* const to = reinterpret_cast<T*>(out.first) + (z - box.begin.z) * out.slice + (y - box.begin.y) * out.row;
      for (std::size_t i = 0; i < places.size(); ++i) {
        to[i] = T(mix(row[std::size_t(places[i].low)], row[std::size_t(next(places[i], 0))], places[i].share));
      }
    }
  }
}

template void Prolong(const float*, const Box&, const VolumeGeometry&, const VolumeGeometry&, const BoxRoom&);
template void Prolong(const double*, const Box&, const VolumeGeometry&, const VolumeGeometry&, const BoxRoom&);

}  // namespace slabstream
