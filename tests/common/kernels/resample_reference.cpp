#include "tests/common/kernels/resample_reference.h"

#include <cstddef>

#include "common/kernels/resample_geometry.h"

namespace slabstream {
namespace {

// Pixels of [low, high) that a spline reaches.
struct Reach {
  Reach(double at, double scale, std::int32_t low, std::int32_t high)
      : begin(std::int32_t(std::max<double>(low, std::ceil(at - 1.5 * scale - 0.5)))),
        end(std::int32_t(std::min<double>(high, std::floor(at + 1.5 * scale - 0.5) + 1))) {}
  std::int32_t begin, end;
};

}  // namespace

void ResampleRowsReference(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                           LocalImage& picture) {
  const PixelBounds& b = frame.bounds;
  const auto width = std::size_t(picture.bounds.width());
  for (std::int32_t y = y_begin; y < y_end; ++y) {
    for (std::int32_t x = picture.bounds.x_begin; x < picture.bounds.x_end; ++x) {
      const ResamplePoint point = ResampleAt(frame_from_picture, x + 0.5, y + 0.5);
      if (!point.seen || !IsNear(point.x, point.y)) continue;
      const Reach columns(point.x, point.scale_x, b.x_begin, b.x_end), rows(point.y, point.scale_y, b.y_begin, b.y_end);
      if (columns.begin >= columns.end || rows.begin >= rows.end) continue;
      double sum[4] = {};
      for (std::int32_t j = rows.begin; j < rows.end; ++j) {
        const double row_weight = QuadraticSpline((j + 0.5 - point.y) / point.scale_y);
        for (std::int32_t i = columns.begin; i < columns.end; ++i) {
          const double weight = row_weight * QuadraticSpline((i + 0.5 - point.x) / point.scale_x);
          const auto pixel = std::size_t(j - b.y_begin) * std::size_t(b.width()) + std::size_t(i - b.x_begin);
          for (std::size_t c = 0; c < 4; ++c) sum[c] += weight * double(frame.rgba[4 * pixel + c]);
        }
      }
      const double weights = SplineSum(point.x, point.scale_x) * SplineSum(point.y, point.scale_y);
      float* out = &picture.rgba[4 * (std::size_t(y - picture.bounds.y_begin) * width + std::size_t(x - picture.bounds.x_begin))];
      for (std::size_t c = 0; c < 4; ++c) out[c] = float(sum[c] / weights);
    }
  }
}

}  // namespace slabstream
