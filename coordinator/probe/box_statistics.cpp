#include "coordinator/probe/box_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace slabstream {
namespace {

constexpr double kOnASide = 1e-9;  // of a spacing: rounding leaves no voxel out whose centre lies on a side

// Of numbers that come row by row. Means and squares of rows are joined as Chan, Golub and LeVeque (1979) do: no sum of large squares
// loses digits.
struct Moments {
  std::uint64_t count = 0, non_finite = 0;
  double mean = 0, squares = 0;  // of differences from the mean
  double least = std::numeric_limits<double>::infinity(), largest = -std::numeric_limits<double>::infinity();

  template <class T>
  void Add(std::span<const T> row) {
    std::uint64_t finite = 0;
    double sum = 0;
    for (const T sample : row) {
      const auto value = double(sample);
      if (!std::isfinite(value)) continue;
      ++finite;
      sum += value;
      least = std::min(least, value);
      largest = std::max(largest, value);
    }
    non_finite += row.size() - finite;
    if (finite == 0) return;
    const double row_mean = sum / double(finite), apart = row_mean - mean;
    double row_squares = 0;
    for (const T sample : row) {
      const double difference = double(sample) - row_mean;
      if (std::isfinite(difference)) row_squares += difference * difference;
    }
    const double all = double(count + finite);
    squares += row_squares + apart * apart * double(count) / all * double(finite);
    mean += apart * double(finite) / all;
    count += finite;
  }
};

struct Interval {
  std::int32_t begin = 0, end = 0;
};

// The voxels of a row, from `begin.x` to before `end`, whose centres lie in the region.
Interval RowIn(const ClipRegion& region, const Index3& begin, std::int32_t end) {
  double first = begin.x, last = end - 1;
  for (const HalfSpace& side : region.sides) {
    const double slope = side.normal.x, rest = side.normal.y * begin.y + side.normal.z * begin.z + side.offset + kOnASide;
    if (slope > 0) first = std::max(first, -rest / slope);
    if (slope < 0) last = std::min(last, -rest / slope);
    if (slope == 0 && rest < 0) return {};
  }
  if (!(first <= last)) return {};
  return {std::int32_t(std::ceil(first)), std::int32_t(std::floor(last)) + 1};
}

}  // namespace

Result<BoxStatistics> StatisticsIn(const VoxelBricks& voxels, const VolumeDescription& volume, const ClipBox& box) {
  const Result<ClipRegion> region = MakeClipRegion({.box = box}, volume.geometry);
  if (!region.ok()) return region.status();
  Moments moments;
  const BrickGrid& grid = voxels.grid();
  VisitScalarType(voxels.type(), [&]<class T>(const T*) {
    for (std::size_t number = 0; number < grid.size(); ++number) {
      const Index3 brick = grid.first + PlaceIn(grid.counts, number);
      const Box bounds = grid.BoxOf(brick);
      if (!region->MayKeep(bounds)) continue;
      const BrickView<T> view = voxels.View<T>(brick);
      for (std::int32_t z = bounds.begin.z; z < bounds.end.z; ++z) {
        for (std::int32_t y = bounds.begin.y; y < bounds.end.y; ++y) {
          const auto [begin, end] = RowIn(*region, {bounds.begin.x, y, z}, bounds.end.x);
          if (begin < end) moments.Add(std::span(view.Row(y, z) + (begin - bounds.begin.x), std::size_t(end - begin)));
        }
      }
    }
  });
  BoxStatistics statistics{.voxels = moments.count, .non_finite = moments.non_finite};
  if (moments.count == 0) return statistics;
  const ValueMapping& mapping = volume.mapping;
  const double a = mapping.FromStored(moments.least), b = mapping.FromStored(moments.largest);
  statistics.mean = mapping.FromStored(moments.mean);
  statistics.deviation = std::abs(mapping.scale) * std::sqrt(moments.squares / double(moments.count));
  statistics.least = std::min(a, b);
  statistics.largest = std::max(a, b);
  return statistics;
}

}  // namespace slabstream
