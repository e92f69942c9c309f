// CoverageMap: how many pixels of each tile of a frame an image fills. Cost models use it instead of the pixels: how much of any pixel
// range travels, and how images that overlap add up.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/pixel_bounds.h"

namespace slabstream {

struct LocalImage;

inline constexpr std::int32_t kCoverageTile = 16;  // pixels of the rendered frame, along x and y

struct CoverageMap {
  std::int32_t frame_width = 0, frame_height = 0;  // pixels
  // Tile (x, y) covers the pixels [16 x, 16 x + 16) x [16 y, 16 y + 16) of the frame, cut at its border.
  std::int32_t tiles_x = 0, tiles_y = 0;
  std::vector<float> share;  // [y][x], of the tile's pixels that are not empty, in [0, 1]

  float& at(std::int32_t x, std::int32_t y) { return share[std::size_t(y) * std::size_t(tiles_x) + std::size_t(x)]; }
  float at(std::int32_t x, std::int32_t y) const { return share[std::size_t(y) * std::size_t(tiles_x) + std::size_t(x)]; }
  // Pixels of tile (x, y).
  std::int32_t TilePixels(std::int32_t x, std::int32_t y) const;
  double pixels() const;  // not empty, in all
  friend bool operator==(const CoverageMap&, const CoverageMap&) = default;
};

// Tiles along an axis of so many pixels.
constexpr std::int32_t CoverageTiles(std::int32_t pixels) { return (pixels + kCoverageTile - 1) / kCoverageTile; }

// For images as renderers make them, with all pixels stored (no LocalImage::rows).
//
// Estimates how many pixels of `image` are not empty. Looks at all pixels of small images, and at a quarter of some 32 rows of larger ones,
// so that it costs next to nothing.
std::uint64_t SamplePixels(const LocalImage& image);

// The coverage of `image`, whose bounds lie in a frame of width x height pixels, each at least 1. Exact.
CoverageMap FindCoverage(const LocalImage& image, std::int32_t width, std::int32_t height);

// `pixels` pixels, at most bounds.pixel_count(), spread evenly over `bounds`: for when no more is known.
CoverageMap UniformCoverage(const PixelBounds& bounds, double pixels, std::int32_t width, std::int32_t height);

}  // namespace slabstream
