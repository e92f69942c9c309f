#include "common/image/coverage_map.h"

#include <algorithm>
#include <limits>

#include "common/base/check.h"
#include "common/image/local_image.h"
#include "common/image/tile_bounds.h"

namespace slabstream {
namespace {

CoverageMap EmptyMap(std::int32_t width, std::int32_t height) {
  CHECK_GE(width, 1);
  CHECK_GE(height, 1);
  CoverageMap map{width, height, CoverageTiles(width), CoverageTiles(height), {}};
  map.share.assign(std::size_t(map.tiles_x) * std::size_t(map.tiles_y), 0.0F);
  return map;
}

bool Filled(const LocalImage& image, std::size_t pixel) {
  return HasDepth(image.format) ? image.depth[pixel] < std::numeric_limits<float>::infinity() : image.rgba[4 * pixel + 3] > 0;
}

}  // namespace

std::uint64_t SamplePixels(const LocalImage& image) {
  constexpr std::int64_t kFew = 64 * 64;
  constexpr std::int32_t kRows = 32;
  const std::int64_t pixels = image.bounds.pixel_count();
  const bool few = pixels <= kFew;
  // One RGBA pixel of each cache line, in some rows.
  const std::int32_t row_step = few ? 1 : std::max(image.bounds.height() / kRows, 1), column_step = few ? 1 : 4;
  std::int64_t looked_at = 0, filled = 0;
  for (std::int32_t y = row_step / 2; y < image.bounds.height(); y += row_step) {
    for (std::int32_t x = column_step / 2; x < image.bounds.width(); x += column_step) {
      filled += Filled(image, std::size_t(y) * std::size_t(image.bounds.width()) + std::size_t(x)) ? 1 : 0;
      ++looked_at;
    }
  }
  // The sampling may miss all pixels of a narrow image.
  return std::uint64_t(looked_at > 0 ? (filled * pixels + looked_at / 2) / looked_at : pixels);
}

std::int32_t CoverageMap::TilePixels(std::int32_t x, std::int32_t y) const {
  return std::int32_t(TileBounds(kCoverageTile, x, y, frame_width, frame_height).pixel_count());
}

double CoverageMap::pixels() const {
  double sum = 0;
  for (std::int32_t y = 0; y < tiles_y; ++y) {
    for (std::int32_t x = 0; x < tiles_x; ++x) sum += double(at(x, y)) * TilePixels(x, y);
  }
  return sum;
}

CoverageMap FindCoverage(const LocalImage& image, std::int32_t width, std::int32_t height) {
  CHECK(PixelBounds({0, 0, width, height}).Contains(image.bounds));
  CHECK(image.rows.empty()) << "all pixels are stored";
  CoverageMap map = EmptyMap(width, height);
  const PixelBounds& bounds = image.bounds;
  std::size_t pixel = 0;
  for (std::int32_t y = bounds.y_begin; y < bounds.y_end; ++y) {
    float* row = &map.share[std::size_t(y / kCoverageTile) * std::size_t(map.tiles_x)];
    for (std::int32_t x = bounds.x_begin; x < bounds.x_end; ++x, ++pixel) {
      row[x / kCoverageTile] += Filled(image, pixel) ? 1.0F : 0.0F;
    }
  }
  for (std::int32_t y = 0; y < map.tiles_y; ++y) {
    for (std::int32_t x = 0; x < map.tiles_x; ++x) map.at(x, y) /= float(map.TilePixels(x, y));
  }
  return map;
}

CoverageMap UniformCoverage(const PixelBounds& bounds, double pixels, std::int32_t width, std::int32_t height) {
  CoverageMap map = EmptyMap(width, height);
  const PixelBounds inside = Intersection(bounds, {0, 0, width, height});
  if (inside.empty()) return map;
  const double density = std::clamp(pixels / double(inside.pixel_count()), 0.0, 1.0);
  for (std::int32_t y = inside.y_begin / kCoverageTile; y * kCoverageTile < inside.y_end; ++y) {
    for (std::int32_t x = inside.x_begin / kCoverageTile; x * kCoverageTile < inside.x_end; ++x) {
      const PixelBounds tile = TileBounds(kCoverageTile, x, y, width, height);
      map.at(x, y) = float(density * double(Intersection(tile, inside).pixel_count()) / double(tile.pixel_count()));
    }
  }
  return map;
}

}  // namespace slabstream
