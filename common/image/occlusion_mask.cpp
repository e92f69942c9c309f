#include "common/image/occlusion_mask.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/image/local_image.h"
#include "common/image/tile_bounds.h"

namespace slabstream {
namespace {

bool Opaque(const LocalImage& image, const PixelBounds& tile, float least_alpha) {
  for (std::int32_t y = tile.y_begin; y < tile.y_end; ++y) {
    const std::size_t row = std::size_t(y - image.bounds.y_begin) * std::size_t(image.bounds.width());
    for (std::int32_t x = tile.x_begin; x < tile.x_end; ++x) {
      if (image.rgba[4 * (row + std::size_t(x - image.bounds.x_begin)) + 3] < least_alpha) return false;
    }
  }
  return true;
}

}  // namespace

bool OcclusionMask::HidesAll(const PixelBounds& bounds) const {
  if (bounds.empty()) return true;
  for (std::int32_t y = bounds.y_begin / kOcclusionTile; y <= (bounds.y_end - 1) / kOcclusionTile; ++y) {
    for (std::int32_t x = bounds.x_begin / kOcclusionTile; x <= (bounds.x_end - 1) / kOcclusionTile; ++x) {
      if (!Hides(x * kOcclusionTile, y * kOcclusionTile)) return false;
    }
  }
  return true;
}

OcclusionMask Union(const OcclusionMask& a, const OcclusionMask& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  CHECK(a.tiles_x == b.tiles_x && a.tiles_y == b.tiles_y) << "masks of two frames";
  OcclusionMask both = a;
  std::ranges::transform(a.steps, b.steps, both.steps.begin(), [](std::uint8_t x, std::uint8_t y) { return std::max(x, y); });
  return both;
}

RayEnds::RayEnds(double termination) {
  if (termination <= 0) return;
  for (int steps = 0; steps <= kOcclusionSteps; ++steps) {
    transmittance_[std::size_t(steps)] = float(std::pow(termination, 1 - double(steps) / kOcclusionSteps));
  }
}

OcclusionMask FindHiddenTiles(const LocalImage& image, std::int32_t width, std::int32_t height, double termination, OcclusionMask known) {
  CHECK(image.format == PixelFormat::kRgba);
  if (termination <= 0 || image.bounds.empty()) return {};
  OcclusionMask mask = std::move(known);
  if (mask.empty()) {
    mask.tiles_x = OcclusionTiles(width);
    mask.tiles_y = OcclusionTiles(height);
    mask.steps.resize(std::size_t(mask.tiles_x) * std::size_t(mask.tiles_y));
  }
  CHECK(mask.tiles_x == OcclusionTiles(width) && mask.tiles_y == OcclusionTiles(height)) << "a mask of another frame";
  for (std::int32_t y = 0; y < mask.tiles_y; ++y) {
    for (std::int32_t x = 0; x < mask.tiles_x; ++x) {
      std::uint8_t& steps = mask.steps[std::size_t(y) * std::size_t(mask.tiles_x) + std::size_t(x)];
      const PixelBounds tile = TileBounds(kOcclusionTile, x, y, width, height);
      if (steps < kOcclusionSteps && image.bounds.Contains(tile) && Opaque(image, tile, float(1 - termination))) steps = kOcclusionSteps;
    }
  }
  if (std::ranges::none_of(mask.steps, [](std::uint8_t steps) { return steps != 0; })) return {};
  return mask;
}

}  // namespace slabstream
