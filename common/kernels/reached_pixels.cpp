#include <algorithm>
#include <cmath>
#include <optional>

#include "common/kernels/resample.h"

namespace slabstream {
namespace {

// The inverse of the map, but for a factor.
ProjectiveMap Adjugate(const ProjectiveMap& m) {
  return {m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
          m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
          m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
}

}  // namespace

PixelBounds ReachedPixels(const PixelBounds& frame, const ProjectiveMap& frame_from_picture, std::int32_t width, std::int32_t height) {
  // Half of a spline is 1.5 pixels of the frame or, if those are larger, of the picture. There, splines in x and y may be askew.
  constexpr double kReach = 2, kReachInPicture = 6;
  const PixelBounds whole = {0, 0, width, height};
  const ProjectiveMap inverse = Adjugate(frame_from_picture);
  double x_least = width, x_most = 0, y_least = height, y_most = 0;
  std::optional<bool> side;  // of the plane W = 0 that the corners seen so far lie on
  for (const double x : {frame.x_begin - kReach, frame.x_end + kReach}) {
    for (const double y : {frame.y_begin - kReach, frame.y_end + kReach}) {
      const double w = inverse[6] * x + inverse[7] * y + inverse[8];
      const double at_x = (inverse[0] * x + inverse[1] * y + inverse[2]) / w, at_y = (inverse[3] * x + inverse[4] * y + inverse[5]) / w;
      if (!std::isfinite(at_x) || !std::isfinite(at_y) || (side && *side != (w > 0))) return whole;
      side = w > 0;
      x_least = std::min(x_least, at_x), x_most = std::max(x_most, at_x);
      y_least = std::min(y_least, at_y), y_most = std::max(y_most, at_y);
    }
  }
  const auto first = [](double least, std::int32_t size) {
    return std::int32_t(std::clamp(std::floor(least - kReachInPicture), 0.0, double(size)));
  };
  const auto end = [](double most, std::int32_t size) {
    return std::int32_t(std::clamp(std::ceil(most + kReachInPicture), 0.0, double(size)));
  };
  const PixelBounds reached = {first(x_least, width), first(y_least, height), end(x_most, width), end(y_most, height)};
  return reached.empty() ? PixelBounds{} : reached;
}

}  // namespace slabstream
