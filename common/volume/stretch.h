// Stretch: where the voxels of a rectilinear grid lie in data space. Along each axis a voxel coordinate is a strictly rising, piecewise
// linear function of the position: the centre of voxel i, whose coordinate is i, lies at its place. Both sides fill [-0.5, size - 0.5), and
// between a border and the outermost voxel the function is linear, too. So data space stays even: views, clipping and light know nothing of
// the grid. Voxel coordinates of an even grid are positions.
//
// Immutable. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"

namespace slabstream {

class Stretch {
 public:
  // The places of the voxels along each axis; empty: the axis is even.
  using Places = std::array<std::vector<double>, 3>;

  Stretch() = default;  // of an even grid
  // Errors of Check, naming the axis.
  static Result<Stretch> Make(const Places& places, const Index3& size);
  // InvalidArgument, naming a place and the limit: there is not one for each of `size` voxels along an axis, or they do not rise from above
  // -0.5 to below size - 0.5 by at least kLeastStep each.
  static Status Check(const std::vector<double>& places, std::int32_t size);
  // Voxels of the mean length: what single precision tells apart in volumes of up to 100 voxels a side.
  static constexpr double kLeastStep = 1e-5;

  bool even() const { return knots_ == nullptr; }
  // The places of the voxels -1, 0 ... size along an axis, where the outermost two mirror their neighbours; empty: the axis is even.
  const std::vector<double>& knots(Axis axis) const;

  double ToVoxel(double position, Axis axis) const;
  double ToData(double voxel, Axis axis) const;
  Vec3 ToVoxel(const Vec3& position) const {
    return {ToVoxel(position.x, Axis::kX), ToVoxel(position.y, Axis::kY), ToVoxel(position.z, Axis::kZ)};
  }
  Vec3 ToData(const Vec3& voxel) const { return {ToData(voxel.x, Axis::kX), ToData(voxel.y, Axis::kY), ToData(voxel.z, Axis::kZ)}; }

  // The least distance of neighbours, by axis; 1 where even.
  Vec3 LeastSteps() const;

  friend bool operator==(const Stretch& a, const Stretch& b) {
    return a.knots_ == b.knots_ || (a.knots_ != nullptr && b.knots_ != nullptr && *a.knots_ == *b.knots_);
  }

 private:
  std::shared_ptr<const Places> knots_;
};

}  // namespace slabstream
