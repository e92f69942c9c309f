#include "data/sources/prolong.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace slabstream {
namespace {

// Between two voxels, or on one, of which nothing but this one counts: the next one may be none (NaN).
struct Place {
  Place(double at, std::int32_t begin)
      : low(std::int32_t(at) - begin), high(std::int32_t(std::ceil(at)) - begin), share(at - std::floor(at)) {}
  double Between(double a, double b) const { return share > 0 ? a + share * (b - a) : a; }

  std::int32_t low, high;  // counted from `begin`
  double share;            // of `high`
};

}  // namespace

VoxelPlaces PlacesBetween(const Box& box, const VolumeGeometry& fine, const VolumeGeometry& coarse) {
  const Vec3 from = fine.orientation.FromWorld(fine.orientation.origin - coarse.orientation.origin);
  VoxelPlaces places;
  for (const Axis axis : kAxes) {
    for (std::int32_t voxel = box.begin[axis]; voxel < box.end[axis]; ++voxel) {
      const double between = (from[axis] + voxel * fine.spacing[axis]) / coarse.spacing[axis];
      places[std::size_t(Number(axis))].push_back(std::clamp(between, 0.0, double(coarse.size[axis] - 1)));
    }
  }
  return places;
}

Box BoxBetween(const VoxelPlaces& places) {
  Box between;
  for (int axis = 0; axis < 3; ++axis) {
    between.begin[axis] = std::int32_t(places[std::size_t(axis)].front());
    between.end[axis] = std::int32_t(std::ceil(places[std::size_t(axis)].back())) + 1;
  }
  return between;
}

template <class From, class To>
void Prolong(const From* samples, const VoxelPlaces& places, const BoxRoom& out, double shift) {
  const Box between = BoxBetween(places);
  const Index3 size = between.size();
  std::vector<Place> along_x;
  for (const double x : places[0]) along_x.emplace_back(x, between.begin.x);
  std::vector<double> row(std::size_t(size.x));
  for (std::size_t k = 0; k < places[2].size(); ++k) {
    const Place z(places[2][k], between.begin.z);
    for (std::size_t j = 0; j < places[1].size(); ++j) {
      const Place y(places[1][j], between.begin.y);
      const auto row_of = [&](std::int32_t at_y, std::int32_t at_z) { return samples + (std::int64_t{at_z} * size.y + at_y) * size.x; };
      const std::array<const From*, 4> rows = {row_of(y.low, z.low), row_of(y.high, z.low), row_of(y.low, z.high), row_of(y.high, z.high)};
      for (std::size_t i = 0; i < row.size(); ++i) {
        row[i] = z.Between(y.Between(double(rows[0][i]), double(rows[1][i])), y.Between(double(rows[2][i]), double(rows[3][i])));
      }
      To* const to = reinterpret_cast<To*>(out.first) + std::int64_t(k) * out.slice + std::int64_t(j) * out.row;
      for (std::size_t i = 0; i < along_x.size(); ++i) {
        to[i] = To(shift + along_x[i].Between(row[std::size_t(along_x[i].low)], row[std::size_t(along_x[i].high)]));
      }
    }
  }
}

template void Prolong<float, float>(const float*, const VoxelPlaces&, const BoxRoom&, double);
template void Prolong<double, double>(const double*, const VoxelPlaces&, const BoxRoom&, double);
template void Prolong<std::uint8_t, float>(const std::uint8_t*, const VoxelPlaces&, const BoxRoom&, double);
template void Prolong<std::uint16_t, float>(const std::uint16_t*, const VoxelPlaces&, const BoxRoom&, double);

}  // namespace slabstream
