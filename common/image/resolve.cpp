#include "common/image/resolve.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "common/base/check.h"
#include "common/image/local_image.h"

namespace slabstream {

LocalImage Resolve(const LocalImage& image, int supersample) {
  CHECK(supersample >= 1 && std::has_single_bit(unsigned(supersample))) << supersample;
  if (supersample == 1) return image;

  const PixelBounds& fine = image.bounds;
  if (fine.empty()) return MakeLocalImage(image.format, {});
  const int shift = std::countr_zero(unsigned(supersample));  // bounds lie in the frame, so they are not negative
  const auto round_up = [&](std::int32_t fine_coordinate) { return (fine_coordinate + supersample - 1) >> shift; };
  LocalImage result =
      MakeLocalImage(image.format, {fine.x_begin >> shift, fine.y_begin >> shift, round_up(fine.x_end), round_up(fine.y_end)});
  const bool depth = HasVoxel(image.format);
  const auto width = std::size_t(result.bounds.width());
  const double weight = 1.0 / (double(supersample) * supersample);

  // One row of final pixels at a time: sums of up to 2^20 fine pixels, hence double.
  std::vector<double> sums(4 * width);
  for (std::int32_t y = result.bounds.y_begin; y < result.bounds.y_end; ++y) {
    sums.assign(sums.size(), 0.0);
    const std::size_t target_row = std::size_t(y - result.bounds.y_begin) * width;
    const std::int32_t fine_begin = std::max(y * supersample, fine.y_begin), fine_end = std::min((y + 1) * supersample, fine.y_end);
    for (std::int32_t fine_y = fine_begin; fine_y < fine_end; ++fine_y) {
      std::size_t source = std::size_t(fine_y - fine.y_begin) * std::size_t(fine.width());
      for (std::int32_t fine_x = fine.x_begin; fine_x < fine.x_end; ++fine_x, ++source) {
        const auto column = std::size_t((fine_x >> shift) - result.bounds.x_begin);
        for (std::size_t channel = 0; channel < 4; ++channel) sums[4 * column + channel] += double(image.rgba[4 * source + channel]);
        if (depth && image.depth[source] < result.depth[target_row + column]) {
          result.depth[target_row + column] = image.depth[source];
          result.voxel[target_row + column] = image.voxel[source];
        }
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i) result.rgba[4 * target_row + i] = float(weight * sums[i]);
  }
  return result;
}

}  // namespace slabstream
