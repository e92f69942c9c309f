// KeyPlane: the key (FrameMap) of a triangle along the screen, in double precision, whether or not all of it lies before the eye.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/shapes/draw_mesh.h"
#include "worker/shapes/shape_scene.h"
#include "worker/shapes/tile_samples.h"

namespace slabstream {

// A function of the screen: x * column + y * row + c.
struct Line3 {
  double x = 0, y = 0, c = 0;
  double At(double column, double row) const { return x * column + y * row + c; }
};

// A vertex seen from a point of the frame.
struct Corner {
  double x = 0, y = 0, w = 1, key = 0;  // homogeneous, in pixels; before the eye, w = 1, and behind it key = -1 belongs to this w
  double edge_x = 0, edge_y = 0;        // the same in steps, rounded unless it is too far away
  bool in_front = true;
};

inline Corner CornerOf(const ShapeScene& scene, const SceneShape& shape, std::size_t vertex, double column, double row) {
  const Vec3 p = shape.Position(vertex);
  const double x = Apply(shape.x, p), y = Apply(shape.y, p), w = Apply(shape.w, p);
  if (!(w > scene.map.least_w)) {
    const double from_x = x - column * w, from_y = y - row * w;
    return {from_x, from_y, w, -1, from_x * kSteps, from_y * kSteps, false};
  }
  const double px = x / w, py = y / w;
  const bool round = std::abs(px) < kMostPixel && std::abs(py) < kMostPixel;
  const auto in_steps = [&](double at, double origin) {
    return round ? std::floor(at * kSteps + 0.5) - origin * kSteps : (at - origin) * kSteps;
  };
  return {px - column,          py - row,          1,   scene.map.perspective() ? -1 / w : Apply(shape.depth, p),
          in_steps(px, column), in_steps(py, row), true};
}

// The line through two points in homogeneous coordinates. Exactly the negative if they are exchanged.
inline Line3 Through(double ax, double ay, double aw, double bx, double by, double bw) {
  return {ay * bw - aw * by, aw * bx - ax * bw, ax * by - ay * bx};
}

struct KeyPlane {
  Line3 plane;
  double least = 0, most = 0;  // of the vertices
  float At(double x, double y) const { return float(std::min(std::max(plane.At(x, y), least), most)); }
};
// One of the corners lies before the eye.
inline KeyPlane PlaneOf(const ShapeScene& scene, const Corner& a, const Corner& b, const Corner& c) {
  KeyPlane result = {.least = std::numeric_limits<double>::infinity(), .most = -std::numeric_limits<double>::infinity()};
  for (const Corner* corner : {&a, &b, &c}) {
    result.least = std::min(result.least, corner->in_front ? corner->key : -1 / scene.map.least_w);
    if (corner->in_front) result.most = std::max(result.most, corner->key);
  }
  const Line3 of_a = Through(b.x, b.y, b.w, c.x, c.y, c.w), of_b = Through(c.x, c.y, c.w, a.x, a.y, a.w),
              of_c = Through(a.x, a.y, a.w, b.x, b.y, b.w);
  const double determinant = a.x * of_a.x + a.y * of_a.y + a.w * of_a.c;
  const auto sum = [&](double x, double y, double z) { return (x * a.key + y * b.key + z * c.key) / determinant; };
  result.plane = {sum(of_a.x, of_b.x, of_c.x), sum(of_a.y, of_b.y, of_c.y), sum(of_a.c, of_b.c, of_c.c)};
  if (!std::isfinite(result.plane.x) || !std::isfinite(result.plane.y) || !std::isfinite(result.plane.c)) {
    result.plane = {0, 0, result.least};  // it is seen from the edge
  }
  return result;
}

}  // namespace slabstream
