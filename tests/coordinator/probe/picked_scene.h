// What the tests of picked shapes share: views of a scene's shapes, and frames at random.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/random.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream::testing {

inline constexpr double kNone = std::numeric_limits<double>::infinity();  // a depth where nothing is met

inline std::vector<ShapeView> ViewsOf(const Scene& scene) {
  std::vector<ShapeView> views;
  for (const auto& block : scene.bytes) views.push_back(ViewShape(block->bytes).value());
  return views;
}

inline VolumeGeometry Turned() {
  const double c = std::cos(0.4), s = std::sin(0.4);
  return {{60, 40, 50}, {1, 1.7, 0.6}, {.origin = {100, -50, 7}, .axes = {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}}};
}

inline ViewParameters RandomView(Random& random) {
  return {.projection = random.Chance(0.5) ? Projection::kPerspective : Projection::kOrthographic,
          .azimuth_degrees = random.Real(0, 360),
          .elevation_degrees = random.Real(-80, 80)};
}

}  // namespace slabstream::testing
