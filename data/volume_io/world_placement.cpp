#include "data/volume_io/world_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "common/base/log.h"

namespace slabstream {
namespace {

constexpr double kLeastVolume = 1e-3;  // of the box that three unit steps span

using Steps = std::array<Vec3, 3>;

double SpannedVolume(const Steps& steps) { return Dot(Cross(steps[0], steps[1]), steps[2]); }

Steps Turned(const Steps& steps, const AxisTurn& turn) {
  Steps turned;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& step = steps[std::size_t(turn.from[i])];
    turned[i] = turn.flipped[i] ? -step : step;
  }
  return turned;
}

Status CheckSteps(const RawHeader& header, const std::string& path) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(fmt::format("{}: {}: {}", path, header.matrix, why)); };
  Steps unit;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& step = header.steps[i];
    if (!IsFinite(step) || !(Length(step) > 0) || !std::isfinite(Length(step))) {
      return wrong(fmt::format("the step along {} is {}, must be finite and not zero", Letter(kAxes[i]), InBrackets(step)));
    }
    unit[i] = Normalized(step);
  }
  if (std::abs(SpannedVolume(unit)) < kLeastVolume) {
    return wrong(fmt::format("the steps {}, {} and {} lie in a plane, so the matrix has no inverse", InBrackets(header.steps[0]),
                             InBrackets(header.steps[1]), InBrackets(header.steps[2])));
  }
  if (!IsFinite(header.origin)) return wrong(fmt::format("the origin is {}, must be finite", InBrackets(header.origin)));
  return Status::Ok();
}

AxisTurn NearestTurn(const Steps& steps) {
  constexpr double kTie = 1e-9;
  Steps unit;
  std::ranges::transform(steps, unit.begin(), Normalized);
  AxisTurn best;
  double best_score = -4;
  Steps best_axes;
  std::array<int, 3> from = {0, 1, 2};
  do {
    for (unsigned flips = 0; flips < 8; ++flips) {
      const AxisTurn turn{from, {(flips & 1) != 0, (flips & 2) != 0, (flips & 4) != 0}};
      const Steps axes = Turned(unit, turn);
      if (SpannedVolume(axes) < 0) continue;
      const double score = axes[0].x + axes[1].y + axes[2].z;
      // Of equally near turns, the one with the greatest axes, for any order of storage.
      if (score < best_score - kTie || (score < best_score + kTie && axes <= best_axes)) continue;
      best = turn;
      best_score = score;
      best_axes = axes;
    }
  } while (std::ranges::next_permutation(from).found);
  return best;
}

// Renderers need a distance. The sign only tells how the axis runs in the scanner; for zero or NaN, 1 is the best guess.
double UsableSpacing(double spacing, const std::string& path) {
  const double distance = std::abs(spacing);
  if (distance > 0 && std::isfinite(distance)) return distance;
  LogWarning(path + ": a spacing of " + std::to_string(spacing) + " is taken as 1");
  return 1;
}

// From how far below 0 to how far above, for `count` steps of `per_step`.
struct Reach {
  double below, above;
};
Reach ReachOf(double per_step, std::int32_t count) {
  const double end = per_step * (count - 1);
  return {std::min(end, 0.0), std::max(end, 0.0)};
}

// The nearest value of the type, halves away from zero.
template <class T>
T Rounded(double value) {
  if constexpr (!std::is_integral_v<T>) {
    return T(value);
  } else {
    // The first double above all values; converting it would be undefined.
    return value >= std::ldexp(1.0, std::numeric_limits<T>::digits) ? std::numeric_limits<T>::max() : T(std::round(value));
  }
}

template <class T>
void SampleStraight(const T* in, const Index3& slanted, const Slant& slant, double outside, Sampling sampling, T* out, const Index3& size) {
  const auto is_inside = [&](std::int32_t x, std::int32_t y) { return x >= 0 && x < slanted.x && y >= 0 && y < slanted.y; };
  const auto sample = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    return is_inside(x, y) ? double(in[NumberIn(slanted, {x, y, z})]) : outside;
  };
  for (std::int32_t z = 0; z < size.z; ++z) {
    for (std::int32_t straight_y = 0; straight_y < size.y; ++straight_y) {
      const double y = straight_y + slant.first.y - slant.y_per_z * z;
      const auto y0 = std::int32_t(std::floor(y));
      const double beyond_y = y - y0;
      for (std::int32_t straight_x = 0; straight_x < size.x; ++straight_x) {
        const double x = straight_x + slant.first.x - slant.x_per_y * y - slant.x_per_z * z;
        if (sampling == Sampling::kNearest) {
          const auto nearest_x = std::int32_t(std::floor(x + 0.5)), nearest_y = std::int32_t(std::floor(y + 0.5));
          *out++ = is_inside(nearest_x, nearest_y) ? in[NumberIn(slanted, {nearest_x, nearest_y, z})] : Rounded<T>(outside);
          continue;
        }
        const auto x0 = std::int32_t(std::floor(x));
        const double beyond_x = x - x0;
        const double near = std::lerp(sample(x0, y0, z), sample(x0 + 1, y0, z), beyond_x);
        const double far = std::lerp(sample(x0, y0 + 1, z), sample(x0 + 1, y0 + 1, z), beyond_x);
        const double value = std::lerp(near, far, beyond_y);
        *out++ = Rounded<T>(value);
      }
    }
  }
}

}  // namespace

bool IsFinite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

std::string InBrackets(const Vec3& v) { return fmt::format("({:g}, {:g}, {:g})", v.x, v.y, v.z); }

Result<WorldPlacement> PlaceInWorld(const RawHeader& header, const std::string& path) {
  WorldPlacement placed;
  VolumeGeometry& geometry = placed.geometry;
  const bool usual = header.world == World::kPatient && header.unit == LengthUnit::kMillimetre;
  if (!usual) geometry.orientation.unit = header.unit;
  if (header.world == World::kVoxels) {
    // Axes may be stored in another order, but not backwards: the sign of a spacing only tells how the scanner moved.
    const bool in_order = header.steps[0].y == 0 && header.steps[0].z == 0;
    if (!in_order) placed.turn = NearestTurn(header.steps);
    for (int i = 0; i < 3; ++i) {
      const int stored = placed.turn.from[std::size_t(i)];
      geometry.size[i] = header.size[stored];
      geometry.spacing[i] = UsableSpacing(header.steps[std::size_t(stored)][i], path);
    }
    return placed;
  }
  if (Status status = CheckSteps(header, path); !status.ok()) return status;
  placed.turn = NearestTurn(header.steps);
  const Steps steps = Turned(header.steps, placed.turn);
  Vec3 origin = header.origin;
  for (std::size_t i = 0; i < 3; ++i) {
    geometry.size[int(i)] = header.size[placed.turn.from[i]];
    if (placed.turn.flipped[i]) origin = origin - double(geometry.size[int(i)] - 1) * steps[i];
    const UnevenAxis& uneven = header.uneven[std::size_t(placed.turn.from[i])];
    placed.uneven[i] = placed.turn.flipped[i] ? uneven.Reversed() : uneven;
  }

  // The straight axes by Gram and Schmidt: x stays, y stays in the plane of x and y. So slices stay slices.
  Orientation& orientation = geometry.orientation;
  orientation.world = header.world;
  const Vec3 x = Normalized(steps[0]);
  const Vec3 y = Normalized(steps[1] - Dot(steps[1], x) * x);
  orientation.axes = {x, y, Cross(x, y)};
  const Steps straight = {orientation.FromWorld(steps[0]), orientation.FromWorld(steps[1]), orientation.FromWorld(steps[2])};
  const double xy = straight[1].x / Length(steps[1]), xz = straight[2].x / Length(steps[2]), yz = straight[2].y / Length(steps[2]);
  if (std::max({std::abs(xy), std::abs(xz), std::abs(yz)}) < kStraight) {
    geometry.spacing = {Length(steps[0]), Length(steps[1]), Length(steps[2])};
    orientation.origin = origin;
    return placed;
  }

  geometry.spacing = {straight[0].x, straight[1].y, straight[2].z};
  Slant slant{.x_per_y = straight[1].x / straight[0].x, .x_per_z = straight[2].x / straight[0].x, .y_per_z = straight[2].y / straight[1].y};
  const Reach of_y = ReachOf(slant.x_per_y, geometry.size.y), of_z = ReachOf(slant.x_per_z, geometry.size.z),
              along_y = ReachOf(slant.y_per_z, geometry.size.z);
  slant.first = {std::floor(of_y.below + of_z.below), std::floor(along_y.below), 0};
  const double size_x = geometry.size.x + std::ceil(of_y.above + of_z.above) - slant.first.x;
  const double size_y = geometry.size.y + std::ceil(along_y.above) - slant.first.y;
  if (std::max(size_x, size_y) > kMaxVolumeSide) {
    return Status::InvalidArgument(
        fmt::format("{}: {}: slices are so slanted that the volume needs {:g} x {:g} voxels in x and y, limit {}", path, header.matrix,
                    size_x, size_y, kMaxVolumeSide));
  }
  geometry.size.x = std::int32_t(size_x);
  geometry.size.y = std::int32_t(size_y);
  orientation.origin = origin + orientation.ToWorld(geometry.spacing * slant.first);
  placed.slant = slant;
  return placed;
}

AlignedVector<std::byte> StraightenVoxels(SampleType type, const AlignedVector<std::byte>& samples, const Index3& size, const Slant& slant,
                                          const Index3& straight_size, double outside, Sampling sampling) {
  AlignedVector<std::byte> straight(CountIn(straight_size) * BytesPerSample(type));
  VisitSampleType(type, [&]<class T>(const T*) {
    SampleStraight(reinterpret_cast<const T*>(samples.data()), size, slant, outside, sampling, reinterpret_cast<T*>(straight.data()),
                   straight_size);
  });
  return straight;
}

}  // namespace slabstream
