#include "data/volume_io/uneven_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

namespace slabstream {

UnevenAxis UnevenAxis::Reversed() const { return {{centres.rbegin(), centres.rend()}, end, begin}; }

Result<UnevenAxis> UnevenAxisOf(const std::string& named, const std::vector<double>& coordinates, ValuesAt at) {
  const std::size_t count = coordinates.size(), least = at == ValuesAt::kCells ? 3 : 2;
  if (count < least) return Status::InvalidArgument(fmt::format("{}: has {} numbers, must have at least {}", named, count, least));
  const bool falls = coordinates.front() > coordinates.back();
  for (std::size_t i = 1; i < count; ++i) {
    const double step = coordinates[i] - coordinates[i - 1];
    if (std::isfinite(step) && (falls ? step < 0 : step > 0)) continue;
    return Status::InvalidArgument(fmt::format("{}: number {} is {}, must be finite and {} number {}, which is {}", named, i,
                                               coordinates[i], falls ? "below" : "above", i - 1, coordinates[i - 1]));
  }
  UnevenAxis axis{.centres = coordinates, .begin = coordinates.front(), .end = coordinates.back()};
  if (at == ValuesAt::kCells) {
    for (std::size_t i = 0; i + 1 < count; ++i) axis.centres[i] = std::midpoint(coordinates[i], coordinates[i + 1]);
    axis.centres.pop_back();
  } else {
    axis.begin -= (coordinates[1] - coordinates[0]) / 2;
    axis.end += (coordinates[count - 1] - coordinates[count - 2]) / 2;
  }
  return axis;
}

std::string DistancesText(const UnevenAxis& axis, Axis letter) {
  double shortest = axis.centres[1] - axis.centres[0], longest = shortest;
  for (std::size_t i = 2; i < axis.centres.size(); ++i) {
    const double step = axis.centres[i] - axis.centres[i - 1];
    shortest = std::min(shortest, step);
    longest = std::max(longest, step);
  }
  return fmt::format("the {} voxels along {}, {:g} to {:g} apart,", axis.centres.size(), Letter(letter), shortest, longest);
}

double VoxelsForShortest(const UnevenAxis& axis) {
  constexpr double kRounding = 1e-6;  // of a voxel
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < axis.centres.size(); ++i) shortest = std::min(shortest, std::abs(axis.centres[i] - axis.centres[i - 1]));
  return std::ceil(std::abs(axis.end - axis.begin) / shortest - kRounding);
}

std::vector<double> EvenPlaces(const UnevenAxis& axis, std::int32_t count) {
  const std::vector<double>& centres = axis.centres;
  std::vector<double> places;
  std::size_t low = 0;
  for (std::int32_t i = 0; i < count; ++i) {
    const double at = std::lerp(axis.begin, axis.end, (i + 0.5) / count);
    while (low + 2 < centres.size() && centres[low + 1] <= at) ++low;
    places.push_back(double(low) + std::clamp((at - centres[low]) / (centres[low + 1] - centres[low]), 0.0, 1.0));
  }
  return places;
}

}  // namespace slabstream
