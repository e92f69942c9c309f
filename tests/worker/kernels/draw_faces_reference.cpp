#include "tests/worker/kernels/draw_faces_reference.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace slabstream::testing {

std::size_t DrawFacesReference(Projection projection, const FaceProjection& faces, const FaceSite* sites, std::uint32_t first,
                               std::uint32_t count, const KeyBand& band) {
  const bool perspective = projection == Projection::kPerspective;
  std::size_t drawn = 0;
  for (std::uint32_t face = first; face < first + count; ++face) {
    const float local[3] = {float(sites[face].x % kFaceBrick), float(sites[face].y % kFaceBrick), float(sites[face].z % kFaceBrick)};
    const auto linear = [&](const float(&step)[3]) { return (local[0] * step[0] + local[1] * step[1]) + local[2] * step[2]; };
    const float depth = faces.depth + linear(faces.depth_step), per_depth = perspective ? 1.0F / depth : 1.0F;
    const float x = faces.x_phase + linear(faces.x_step) * per_depth, y = faces.y_phase + linear(faces.y_step) * per_depth;

    const float left = std::ceil(x - faces.half_width), top = std::ceil(y - faces.half_height);
    const PixelBounds reach = {faces.column + int(left), faces.row + int(top), faces.column + int(std::floor(x + faces.half_width)) + 1,
                               faces.row + int(std::floor(y + faces.half_height)) + 1};
    const PixelBounds pixels = Intersection(reach, band.bounds);
    if (pixels.empty()) continue;

    float u_x = faces.u_x, u_y = faces.u_y, v_x = faces.v_x, v_y = faces.v_y, slope_x = 0, slope_y = 0;
    if (perspective) {
      const float eye_a = faces.eye_a + local[faces.a], eye_u = faces.eye_u + local[faces.u], eye_v = faces.eye_v + local[faces.v];
      if (!(faces.sign * eye_a < 0)) continue;
      const float per_ray_a = depth / eye_a;
      slope_x = faces.ray_x_a * per_ray_a;
      slope_y = faces.ray_y_a * per_ray_a;
      u_x = depth * faces.ray_x_u - slope_x * eye_u;
      u_y = depth * faces.ray_y_u - slope_y * eye_u;
      v_x = depth * faces.ray_x_v - slope_x * eye_v;
      v_y = depth * faces.ray_y_v - slope_y * eye_v;
    }
    ++drawn;
    for (std::int32_t row = pixels.y_begin; row < pixels.y_end; ++row) {
      for (std::int32_t column = pixels.x_begin; column < pixels.x_end; ++column) {
        const auto right = float(column - reach.x_begin), below = float(row - reach.y_begin);
        const auto at = [&](float along_x, float along_y) {
          return ((left - x) * along_x + (top - y) * along_y) + (right * along_x + below * along_y);
        };
        const float divisor =
            perspective ? (1.0F + ((left - x) * slope_x + (top - y) * slope_y)) + (right * slope_x + below * slope_y) : 1.0F;
        if (!(std::max(std::abs(at(u_x, u_y)), std::abs(at(v_x, v_y))) < kFaceReach * divisor)) continue;
        const float hit = perspective ? depth / divisor
                                      : (depth + ((left - x) * faces.depth_x + (top - y) * faces.depth_y)) +
                                            (right * faces.depth_x + below * faces.depth_y);
        const std::size_t pixel = std::size_t(row - band.bounds.y_begin) * band.stride + std::size_t(column - band.bounds.x_begin);
        if (band.limits.from != nullptr) {
          const bool inside = hit >= band.limits.from[pixel] && hit <= band.limits.to[pixel];
          if (inside != band.limits.inside) continue;
        }
        std::uint64_t& key = band.keys[pixel];
        key = std::min(key, std::uint64_t{std::bit_cast<std::uint32_t>(hit)} << 32 | face);
      }
    }
  }
  return drawn;
}

}  // namespace slabstream::testing
