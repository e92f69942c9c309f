#include "tests/worker/rays/pixel_ray.h"

#include <cmath>

namespace slabstream::testing {

PixelRay RayOf(const ViewRays& rays, std::int32_t x, std::int32_t y) {
  const float from_x = float(x) - rays.centre_x, from_y = float(y) - rays.centre_y;
  PixelRay ray{};
  const float square = (from_x * from_x + from_y * from_y) * rays.bend;
  const float length = std::sqrt(1 + square);
  const float lag = square / (1 + length), scale = rays.step / length, shift = rays.start_distance / length;
  const double plastic = 1.3247179572447460;  // its cube is 1 more
  const double sum = x / plastic + y / (plastic * plastic);
  const auto share = float(sum - std::floor(sum));
  for (std::size_t i = 0; i < 3; ++i) {
    const float offset = from_x * rays.right[i] + from_y * rays.down[i];
    ray.first[i] = rays.start[i] + (rays.perspective ? shift * (offset - lag * rays.forward[i]) : offset);
    ray.move[i] = rays.perspective ? scale * (rays.forward[i] + offset) : rays.step * rays.forward[i];
    ray.first[i] += share * rays.jitter * ray.move[i];
  }
  return ray;
}

Float3 SamplePosition(const PixelRay& ray, std::int32_t k) {
  Float3 position{};
  for (std::size_t i = 0; i < 3; ++i) position[i] = ray.first[i] + float(k) * ray.move[i];
  return position;
}

std::array<RayPart, 2> PartsOf(const RayClip& clip, const PixelRay& ray) {
  struct Cut {
    float at;
    const RayClip::Side* side = nullptr;
    float face_samples = 0;
  };
  Cut enter{-kRayEnd}, leave{kRayEnd};
  for (const RayClip::Side& side : clip.sides) {
    const auto dot = [&](const Float3& v) { return side.normal[0] * v[0] + side.normal[1] * v[1] + side.normal[2] * v[2]; };
    const float first = dot(ray.first) + side.offset, move = dot(ray.move);
    const float at = -first / move, samples = clip.face_depth / std::abs(move);
    if (!(std::abs(move) >= kLeastCrossing)) {
      if (first < 0) leave.at = -2 * kRayEnd;  // the ray runs outside
    } else if (move > 0) {
      if (at > enter.at) enter = {at, &side, samples};
    } else if (at < leave.at) {
      leave = {at, &side, samples};
    }
  }
  const auto face = [](RayPart& part, const Cut& cut) {
    if (cut.side == nullptr) return;
    part.face = cut.side->normal;
    part.face_end = cut.at + cut.face_samples;
  };
  const bool any = enter.at <= leave.at;
  std::array<RayPart, 2> parts;
  if (!clip.cut_away) {
    if (any) {
      parts[0] = {std::ceil(enter.at), std::floor(leave.at) + 1, enter.at, leave.at};
      face(parts[0], enter);
    } else {
      parts[0].end = parts[0].leave = -kRayEnd;
    }
    parts[1].end = parts[1].leave = -kRayEnd;
  } else if (any) {
    parts[0] = {-kRayEnd, std::ceil(enter.at), -kRayEnd, enter.at};
    parts[1] = {std::floor(leave.at) + 1, kRayEnd, leave.at, kRayEnd};
    face(parts[1], leave);
  } else {
    parts[1].end = parts[1].leave = -kRayEnd;
  }
  return parts;
}

}  // namespace slabstream::testing
