#include "common/volume/stretch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace slabstream {
namespace {

const std::vector<double> kNone;

// The knot before a value of ascending `knots`, but neither the last one nor one before the first.
std::size_t KnotBefore(const std::vector<double>& knots, double position) {
  return std::size_t(std::upper_bound(knots.begin() + 1, knots.end() - 1, position) - knots.begin()) - 1;
}

}  // namespace

Status Stretch::Check(const std::vector<double>& places, std::int32_t size) {
  if (places.empty()) return Status::Ok();
  if (places.size() != std::size_t(size)) return Status::InvalidArgument(fmt::format("{} places of {} voxels", places.size(), size));
  const double end = size - 0.5;
  double before = -0.5;
  for (std::size_t i = 0; i <= places.size(); ++i) {
    // The outermost voxels lie half a step from the borders, or farther.
    const bool at_border = i == 0 || i == places.size();
    const double place = i < places.size() ? places[i] : end, least = before + (at_border ? kLeastStep / 2 : kLeastStep);
    if (place >= least && place <= end) {
      before = place;
      continue;
    }
    const std::size_t number = std::min(i, places.size() - 1);
    return Status::InvalidArgument(
        fmt::format("place {} is {}, must lie {} or more above the one before and below {}", number, places[number], kLeastStep, end));
  }
  return Status::Ok();
}

Result<Stretch> Stretch::Make(const Places& places, const Index3& size) {
  const auto knots = std::make_shared<Places>();
  bool even = true;
  for (const Axis axis : kAxes) {
    const auto number = std::size_t(Number(axis));
    const std::vector<double>& of = places[number];
    if (Status status = Check(of, size[axis]); !status.ok()) {
      return Status::InvalidArgument(fmt::format("along {}, {}", Letter(axis), status.message()));
    }
    bool at_numbers = true;
    for (std::size_t i = 0; i < of.size(); ++i) at_numbers = at_numbers && of[i] == double(i);
    if (at_numbers) continue;
    even = false;
    std::vector<double>& its = (*knots)[number];
    its.reserve(of.size() + 2);
    its.push_back(-1 - of.front());
    its.insert(its.end(), of.begin(), of.end());
    its.push_back(2 * size[axis] - 1 - of.back());
  }
  Stretch stretch;
  if (!even) stretch.knots_ = knots;
  return stretch;
}

const std::vector<double>& Stretch::knots(Axis axis) const { return even() ? kNone : (*knots_)[std::size_t(Number(axis))]; }

double Stretch::ToVoxel(double position, Axis axis) const {
  const std::vector<double>& of = knots(axis);
  if (of.empty()) return position;
  const std::size_t i = KnotBefore(of, position);
  return double(i) - 1 + (position - of[i]) / (of[i + 1] - of[i]);
}

double Stretch::ToData(double voxel, Axis axis) const {
  const std::vector<double>& of = knots(axis);
  if (of.empty()) return voxel;
  const auto i = std::size_t(std::clamp(voxel + 1, 0.0, double(of.size() - 2)));
  return of[i] + (voxel + 1 - double(i)) * (of[i + 1] - of[i]);
}

Vec3 Stretch::LeastSteps() const {
  Vec3 least = {1, 1, 1};
  for (const Axis axis : kAxes) {
    const std::vector<double>& of = knots(axis);
    for (std::size_t i = 1; i < of.size(); ++i) least[axis] = std::min(least[axis], of[i] - of[i - 1]);
  }
  return least;
}

}  // namespace slabstream
