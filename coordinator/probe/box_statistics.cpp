#include "coordinator/probe/box_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "common/volume/exact_value.h"

namespace slabstream {
namespace {

constexpr double kOnASide = 1e-9;  // of a spacing: rounding leaves no voxel out whose centre lies on a side

// Of numbers that come row by row. Means and squares of rows are joined as Chan, Golub and LeVeque (1979) do: no sum of large squares
// loses digits.
struct Moments {
  std::uint64_t count = 0, non_finite = 0;
  double mean = 0, squares = 0;  // of differences from the mean
  Int128 sum = 0;                // of whole numbers
  double least = std::numeric_limits<double>::infinity(), largest = -std::numeric_limits<double>::infinity();

  template <class T>
  void Add(std::span<const T> row) {
    std::uint64_t finite = 0;
    std::conditional_t<std::is_integral_v<T>, Int128, double> row_sum = 0;
    for (const T sample : row) {
      const auto value = double(sample);
      if (!std::isfinite(value)) continue;
      ++finite;
      row_sum += sample;
      least = std::min(least, value);
      largest = std::max(largest, value);
    }
    non_finite += row.size() - finite;
    if (finite == 0) return;
    if constexpr (std::is_integral_v<T>) sum += row_sum;
    const double row_mean = double(row_sum) / double(finite), apart = row_mean - mean;
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

  // `whole`: of whole numbers.
  BoxStatistics Under(const ValueMapping& mapping, bool whole) const {
    BoxStatistics statistics{.voxels = count, .non_finite = non_finite};
    if (count == 0) return statistics;
    const double a = mapping.FromStored(least), b = mapping.FromStored(largest);
    statistics.mean = mapping.FromStored(whole ? double(sum) / double(count) : mean);
    statistics.deviation = std::abs(mapping.scale) * std::sqrt(squares / double(count));
    statistics.least = std::min(a, b);
    statistics.largest = std::max(a, b);
    return statistics;
  }
};

struct Interval {
  std::int32_t begin = 0, end = 0;
};

// The voxels of a row, from `begin.x` to before `end`, whose centres lie in the region.
Interval RowIn(const ClipRegion& region, const Index3& begin, std::int32_t end) {
  double first = begin.x, last = end - 1;
  for (const HalfSpace& side : region.sides) {
    const double slope = side.normal.x,
                 rest = side.normal.y * begin.y + side.normal.z * begin.z + side.offset + kOnASide * Length(side.normal);
    if (slope > 0) first = std::max(first, -rest / slope);
    if (slope < 0) last = std::min(last, -rest / slope);
    if (slope == 0 && rest < 0) return {};
  }
  if (!(first <= last)) return {};
  return {std::int32_t(std::ceil(first)), std::int32_t(std::floor(last)) + 1};
}

// The rows of voxels in the region, brick by brick: use(view_of(brick), y, z, first voxel within the brick, count).
void EachRow(const BrickGrid& grid, const ClipRegion& region, const auto& view_of, const auto& use) {
  for (std::size_t number = 0; number < grid.size(); ++number) {
    const Index3 brick = grid.first + PlaceIn(grid.counts, number);
    const Box bounds = grid.BoxOf(brick);
    if (!region.MayKeep(bounds)) continue;
    const auto view = view_of(brick);
    for (std::int32_t z = bounds.begin.z; z < bounds.end.z; ++z) {
      for (std::int32_t y = bounds.begin.y; y < bounds.end.y; ++y) {
        const auto [begin, end] = RowIn(region, {bounds.begin.x, y, z}, bounds.end.x);
        if (begin < end) use(view, y, z, begin - bounds.begin.x, std::size_t(end - begin));
      }
    }
  }
}

// Calls measure(view of a brick, mapping, whether they are whole numbers) with a function that views the best samples there are.
decltype(auto) WithSamples(const MeasuredVolume& volume, const auto& measure) {
  if (volume.exact) {
    return std::visit(
        [&]<class T>(std::span<const T> samples) {
          const Index3 size = volume.voxels.box().size();
          const std::ptrdiff_t row = size.x, slice = row * size.y;
          const auto view_of = [&, row, slice](const Index3& brick) {
            const Index3 begin = volume.voxels.grid().BoxOf(brick).begin, offset = begin - volume.voxels.box().begin;
            return BrickView<T>{samples.data() + offset.z * slice + offset.y * row + offset.x, begin, row, slice};
          };
          return measure(view_of, volume.exact->mapping, true);
        },
        volume.exact->samples);
  }
  return VisitScalarType(volume.voxels.type(), [&]<class T>(const T*) {
    return measure([&](const Index3& brick) { return volume.voxels.View<T>(brick); }, volume.description.mapping, std::is_integral_v<T>);
  });
}

Result<ClipRegion> RegionOf(const MeasuredVolume& volume, const ClipBox& box) {
  const VolumeGeometry& geometry = volume.description.geometry;
  if (!geometry.rectilinear()) return MakeClipRegion({.box = box}, geometry);
  return Status::InvalidArgument("statistics count voxels, which differ in size on a rectilinear grid; --resample even resamples it");
}

}  // namespace

Result<BoxStatistics> StatisticsIn(const MeasuredVolume& volume, const ClipBox& box) {
  const Result<ClipRegion> region = RegionOf(volume, box);
  if (!region.ok()) return region.status();
  return WithSamples(volume, [&](const auto& view_of, const ValueMapping& mapping, bool whole) {
    Moments moments;
    EachRow(volume.voxels.grid(), *region, view_of,
            [&](const auto& view, std::int32_t y, std::int32_t z, std::int32_t first, std::size_t count) {
              moments.Add(std::span(view.Row(y, z) + first, count));
            });
    return moments.Under(mapping, whole);
  });
}

Result<std::map<std::uint64_t, BoxStatistics>> StatisticsByLabel(const MeasuredVolume& volume, const ClipBox& box,
                                                                 const ReadLabels& labels) {
  const Result<ClipRegion> region = RegionOf(volume, box);
  if (!region.ok()) return region.status();
  return WithSamples(
      volume, [&](const auto& view_of, const ValueMapping& mapping, bool whole) -> Result<std::map<std::uint64_t, BoxStatistics>> {
        std::map<std::uint64_t, Moments> moments;
        EachRow(volume.voxels.grid(), *region, view_of,
                [&](const auto& view, std::int32_t y, std::int32_t z, std::int32_t first, std::size_t count) {
                  if (moments.size() > kMaxLabels) return;
                  const auto* const samples = view.Row(y, z) + first;
                  std::array<std::uint64_t, kBrick> row;
                  labels({view.begin.x + first, y, z}, std::span(row).first(count));
                  for (std::size_t begin = 0; begin < count;) {  // runs of one label
                    std::size_t end = begin + 1;
                    while (end < count && row[end] == row[begin]) ++end;
                    if (row[begin] > 0) moments[row[begin]].Add(std::span(samples + begin, end - begin));
                    begin = end;
                  }
                });
        if (moments.size() > kMaxLabels) {
          return Status::ResourceExhausted(fmt::format("more than {} labels have voxels in the box: measure a smaller one", kMaxLabels));
        }
        std::map<std::uint64_t, BoxStatistics> statistics;
        for (const auto& [label, of] : moments) statistics.emplace(label, of.Under(mapping, whole));
        return statistics;
      });
}

}  // namespace slabstream
