#include "common/planning/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/view/clip_corners.h"

namespace slabstream {
namespace {

Vec3 MiddleOf(const Box& box) { return 0.5 * (ToVec3(box.begin + box.end) - Vec3{1, 1, 1}); }

Ball BallRound(const std::vector<Box>& bricks, const VolumeGeometry& geometry) {
  Box hull;
  for (const Box& brick : bricks) hull = Hull(hull, brick);
  const Vec3 middle = MiddleOf(hull);
  double radius = 0;
  for (const Box& brick : bricks) {
    const Vec3 farthest = Absolute(MiddleOf(brick) - middle) + 0.5 * ToVec3(brick.size());
    radius = std::max(radius, Length(farthest * geometry.spacing));
  }
  return {geometry.ToWorld(middle), radius};
}

// A box along the picture's right and up and the direction of view, in physical lengths.
class ViewBox {
 public:
  ViewBox(const Camera& camera, const VolumeGeometry& geometry)
      : axes_{camera.right * geometry.spacing, camera.up * geometry.spacing, camera.view_direction * geometry.spacing},
        directions_{camera.right, camera.up, camera.view_direction},
        spacing_(geometry.spacing) {}

  bool empty() const { return low_.x > high_.x; }

  // Whether the picture's sides of `brick` lie within this box.
  bool Frames(const Box& brick) const {
    const Vec3 middle = MiddleOf(brick), half = 0.5 * ToVec3(brick.size());
    const auto frames = [&](int i) {
      const double at = Dot(axes_[i], middle), reach = Dot(Absolute(axes_[i]), half);
      return low_[i] <= at - reach && at + reach <= high_[i];
    };
    return frames(0) && frames(1);
  }

  void Add(const Vec3& point) {
    for (int i = 0; i < 3; ++i) {
      const double at = Dot(axes_[i], point);
      low_[i] = std::min(low_[i], at);
      high_[i] = std::max(high_[i], at);
    }
  }

  Vec3 half_extent() const { return 0.5 * (high_ - low_); }
  Vec3 centre() const {  // data space
    const Vec3 at = 0.5 * (low_ + high_);
    return (at.x * directions_[0] + at.y * directions_[1] + at.z * directions_[2]) / spacing_;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  std::array<Vec3, 3> axes_;        // of data space
  std::array<Vec3, 3> directions_;  // of physical space, unit
  Vec3 spacing_;
  Vec3 low_ = {kInfinity, kInfinity, kInfinity}, high_ = -low_;
};

// The ball that frames the cut. None: the slab takes nothing of the bricks, or is cut away.
std::optional<Ball> BallOfCut(const FrameRequest& request, const std::vector<Box>& bricks, const ClipRegion& clip,
                              const VolumeGeometry& geometry) {
  if (!request.clipping.slab || clip.mode != ClipMode::kKeep) return std::nullopt;
  const Camera camera = MakeCamera(request.view, request.size, geometry);
  ViewBox cut(camera, geometry);
  const auto add = [&](const Box& brick) {
    for (const Vec3& corner : CornersOf(clip, brick)) cut.Add(corner);
  };
  // Once the outermost bricks are in, few others lie outside.
  for (const Vec3& side : {camera.right, camera.up}) {
    const auto along = [axis = side * geometry.spacing](const Box& brick) { return Dot(axis, MiddleOf(brick)); };
    const auto [first, last] = std::ranges::minmax_element(bricks, {}, along);
    add(*first);
    add(*last);
  }
  for (const Box& brick : bricks) {
    if (!cut.Frames(brick)) add(brick);
  }
  if (cut.empty()) return std::nullopt;
  const double shorter = std::min(camera.width, camera.height);
  const Vec3 half = cut.half_extent();
  const double radius = std::max(half.x * shorter / camera.width, half.y * shorter / camera.height);
  return Ball{geometry.ToWorld(cut.centre()), std::max(radius, Least(geometry.spacing))};
}

}  // namespace

std::optional<Ball> FramedBall(const FrameRequest& request, const std::vector<Box>& places, const ClipRegion& clip,
                               const VolumeGeometry& geometry) {
  if (places.empty()) return std::nullopt;
  const std::optional<Ball> cut = BallOfCut(request, places, clip, geometry);
  return cut ? *cut : BallRound(places, geometry);
}

AffineMap FromWorld(const VolumeGeometry& geometry) {
  AffineMap map;
  const auto among = [&](const Vec3& direction) { return geometry.orientation.FromWorld(direction) / geometry.spacing; };
  map.steps = {among({1, 0, 0}), among({0, 1, 0}), among({0, 0, 1})};
  map.offset = among(-geometry.orientation.origin);
  return map;
}

Box BoxAround(const ShapeInfo& shape, const VolumeGeometry& geometry) {
  const auto [low, high] = FromWorld(geometry).Bounds(shape.low, shape.high);
  Box box;
  for (const Axis axis : kAxes) {
    box.begin[Number(axis)] = std::int32_t(std::floor(std::clamp(low[axis] + 0.5, -kFarthestShape, kFarthestShape)));
    box.end[Number(axis)] = std::int32_t(std::floor(std::clamp(high[axis] + 0.5, -kFarthestShape, kFarthestShape))) + 1;
  }
  return box;
}

}  // namespace slabstream
