#include "common/renderers/zbuffer/depth_shading.h"

#include <algorithm>
#include <cmath>

#include "common/parallel/parallel.h"
#include "common/renderers/renderer_kind.h"
#include "common/view/phong.h"

namespace slabstream {
namespace {

// How far neighbours are, in voxels. The faces of voxels are steps: nearer neighbours show each of them, farther ones lose what is small.
constexpr double kVoxels = 2;

// Depths of a frame, and the physical points that they mean. Rays are linear in x and y, so three of them give all. Pixels count from the
// frame's corner, so the bits do not depend on the image's bounds.
class Points {
 public:
  Points(const LocalImage& image, const Camera& camera) : image_(image) {
    const auto physical = [&](double x, double y) {
      const Camera::Ray ray = camera.RayAt(x, y);
      return Camera::Ray{ray.origin * camera.spacing, ray.direction * camera.spacing};
    };
    at_ = physical(0.5, 0.5);
    const Camera::Ray right = physical(1.5, 0.5), below = physical(0.5, 1.5);
    by_x_ = {right.origin - at_.origin, right.direction - at_.direction};
    by_y_ = {below.origin - at_.origin, below.direction - at_.direction};
  }

  float DepthAt(std::int32_t x, std::int32_t y) const {
    const PixelBounds& bounds = image_.bounds;
    if (x < bounds.x_begin || x >= bounds.x_end || y < bounds.y_begin || y >= bounds.y_end) return INFINITY;
    return image_.depth[IndexOf(x, y)];
  }
  Vec3 At(std::int32_t x, std::int32_t y, float depth) const {
    const Vec3 origin = at_.origin + double(x) * by_x_.origin + double(y) * by_y_.origin;
    return origin + double(depth) * (at_.direction + double(x) * by_x_.direction + double(y) * by_y_.direction);
  }
  std::size_t IndexOf(std::int32_t x, std::int32_t y) const {
    return std::size_t(y - image_.bounds.y_begin) * std::size_t(image_.bounds.width()) + std::size_t(x - image_.bounds.x_begin);
  }

 private:
  const LocalImage& image_;
  Camera::Ray at_, by_x_, by_y_;
};

// A pixel that has a depth.
struct Seen {
  std::int32_t x, y;
  float depth;
};

// The tangent at a pixel along a step of (dx, dy) pixels; 0 if no neighbour has a depth. Steps in depth below `least` count alike.
Vec3 Tangent(const Points& points, const Seen& pixel, std::int32_t dx, std::int32_t dy, double least) {
  const Vec3 here = points.At(pixel.x, pixel.y, pixel.depth);
  Vec3 sum;
  double weights = 0;
  for (const std::int32_t side : {-1, 1}) {
    const std::int32_t x = pixel.x + side * dx, y = pixel.y + side * dy;
    const float depth = points.DepthAt(x, y);
    if (!std::isfinite(depth)) continue;
    const double step = double(depth) - pixel.depth, weight = 1 / (step * step + least * least);
    sum = sum + (side * weight) * (points.At(x, y, depth) - here);
    weights += weight;
  }
  return weights > 0 ? sum / weights : Vec3();
}

}  // namespace

LocalImage ShadeByDepth(const LocalImage& frame, const FrameSetup& setup) {
  LocalImage lit = frame;
  const Points points(frame, setup.camera);
  const Phong phong(setup.shading, setup.camera.view_direction);
  const auto distance = std::max(std::int32_t{1}, std::int32_t(std::lround(kVoxels * CostViewOf(setup).pixels_per_voxel)));
  const Vec3& spacing = setup.camera.spacing;
  const double least = Least(spacing);
  constexpr std::int32_t kRows = 8;
  ParallelForRanges(frame.bounds.y_begin, frame.bounds.y_end, kRows, [&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t y = begin; y < end; ++y) {
      for (std::int32_t x = frame.bounds.x_begin; x < frame.bounds.x_end; ++x) {
        const Seen pixel{x, y, points.DepthAt(x, y)};
        if (!std::isfinite(pixel.depth)) continue;
        const Vec3 normal = Cross(Tangent(points, pixel, distance, 0, least), Tangent(points, pixel, 0, distance, least));
        const double length = Length(normal);
        const PhongFactors light = length > 0 ? phong.AtNormal(normal / length) : phong.WithoutGradient();
        float* rgba = &lit.rgba[4 * points.IndexOf(x, y)];
        for (int channel = 0; channel < 3; ++channel)
          rgba[channel] = std::clamp(rgba[channel] * light.diffuse + light.specular, 0.0F, 1.0F);
      }
    }
  });
  return lit;
}

}  // namespace slabstream
