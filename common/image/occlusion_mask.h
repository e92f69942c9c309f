// OcclusionMask: which parts of a frame are opaque already, so that what lies behind them need not be rendered.
//
// The display worker makes it from what it has accumulated so far. Workers get it with the groups that lie behind (early termination across
// groups). A mask that is out of date or missing hides less, so it changes no picture by more than the termination threshold.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/pixel_bounds.h"

namespace slabstream {

struct LocalImage;

inline constexpr std::int32_t kOcclusionTile = 16;  // pixels of the rendered frame, along x and y

struct OcclusionMask {
  // Tile (x, y) covers the pixels [16 x, 16 x + 16) x [16 y, 16 y + 16) of the frame, cut at its border. 0 x 0: nothing is hidden.
  std::int32_t tiles_x = 0, tiles_y = 0;
  std::vector<std::uint8_t> hidden;  // [y][x], 0 or 1; tiles_x * tiles_y of them

  bool empty() const { return hidden.empty(); }
  // Whether the tile of a pixel, which lies in the frame, is hidden.
  bool Hides(std::int32_t x, std::int32_t y) const {
    return !hidden.empty() && hidden[std::size_t(y / kOcclusionTile) * std::size_t(tiles_x) + std::size_t(x / kOcclusionTile)] != 0;
  }
  // Whether all pixels of `bounds`, which lie in the frame, are hidden. True if there are none.
  bool HidesAll(const PixelBounds& bounds) const;
  friend bool operator==(const OcclusionMask&, const OcclusionMask&) = default;
};

// Tiles along an axis of so many pixels.
constexpr std::int32_t OcclusionTiles(std::int32_t pixels) { return (pixels + kOcclusionTile - 1) / kOcclusionTile; }

// The pixels of tile (x, y) of a frame of width x height pixels.
constexpr PixelBounds OcclusionTileBounds(std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height) {
  return Intersection(PixelBounds{x * kOcclusionTile, y * kOcclusionTile, (x + 1) * kOcclusionTile, (y + 1) * kOcclusionTile},
                      {0, 0, width, height});
}

// Tiles whose pixels all transmit at most `termination`: alpha >= 1 - termination. Pixels outside the image's bounds are empty.
// `termination` 0, or an image without an opaque tile: an empty mask. `image` is a kRgba image of a frame of width x height pixels.
// `known`: an earlier result, before more was put behind the same image; its hidden tiles stay hidden and are not tested again.
OcclusionMask FindHiddenTiles(const LocalImage& image, std::int32_t width, std::int32_t height, double termination,
                              OcclusionMask known = {});

}  // namespace slabstream
