#include "common/frame/frame_map.h"

#include <cmath>

namespace slabstream {
namespace {

constexpr double kLeastPart = 1e-6;  // of what w is in the middle of the picture

// `pixel`: its side in the unit of space that w is 1 at.
FrameMap Completed(FrameMap map, double pixel) {
  map.merged_depth = 0.5 * (std::abs(map.depth[0]) + std::abs(map.depth[1]) + std::abs(map.depth[2]));
  map.merged_depth_of_pixel = 2 * pixel;
  const Vec3 a = {map.x[0], map.x[1], map.x[2]}, b = {map.y[0], map.y[1], map.y[2]}, d = {map.depth[0], map.depth[1], map.depth[2]};
  const double per_determinant = 1 / Dot(a, Cross(b, d));
  map.steps = {per_determinant * Cross(b, d), per_determinant * Cross(d, a), per_determinant * Cross(a, b)};
  return map;
}

}  // namespace

FrameMap MakeFrameMap(const Camera& camera) {
  FrameMap map = {.x = camera.x_row, .y = camera.y_row, .w = camera.w_row, .depth = camera.depth_row};
  if (camera.projection == Projection::kPerspective) {
    map.w_per_depth = 1;
    map.w_0 = 0;
    map.least_w = kLeastPart * camera.target_depth;
  }
  return Completed(map, camera.PixelSizeAt(1) / camera.supersample);
}

FrameMap MakeFrameMap(const FrameSetup& setup) {
  if (setup.sheets.empty()) return MakeFrameMap(setup.camera);
  const SheetGrid& grid = setup.sheets;
  const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
  const auto at = [](Axis axis) { return std::size_t(Number(axis)); };
  const double away = setup.camera.ascending ? 1 : -1;
  FrameMap map;
  map.x[at(u)] = grid.x_u;
  map.x[at(c)] = grid.x_c;
  map.x[3] = grid.x_0;
  map.y[at(v)] = grid.y_v;
  map.y[at(c)] = grid.y_c;
  map.y[3] = grid.y_0;
  map.w[at(c)] = grid.w_c;
  map.w[3] = grid.w_0;
  map.depth[at(c)] = away;
  map.w_per_depth = away * grid.w_c;
  map.w_0 = grid.w_0;
  map.least_w = map.perspective() ? kLeastPart : 0;
  return Completed(map, 1 / std::min(grid.x_u, grid.y_v));
}

}  // namespace slabstream
