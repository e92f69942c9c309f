// OcclusionMask: which parts of a frame are opaque already, so that what lies behind them need not be rendered.
//
// Made by the display worker from what it has accumulated so far, told to the workers with the groups that lie behind (early termination
// across groups). A mask that is out of date or missing changes no picture by more than the termination threshold: it only ever says less.
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
  // Of the tile that holds the pixel, which lies in the frame.
  bool Hides(std::int32_t x, std::int32_t y) const {
    return !hidden.empty() && hidden[std::size_t(y / kOcclusionTile) * std::size_t(tiles_x) + std::size_t(x / kOcclusionTile)] != 0;
  }
  // All pixels of `bounds`, which lie in the frame. True if there are none.
  bool HidesAll(const PixelBounds& bounds) const;
  friend bool operator==(const OcclusionMask&, const OcclusionMask&) = default;
};

// Along an axis of a frame with so many pixels.
constexpr std::int32_t OcclusionTiles(std::int32_t pixels) { return (pixels + kOcclusionTile - 1) / kOcclusionTile; }

// Tiles whose pixels all transmit at most `termination`: alpha >= 1 - termination. Pixels outside the image's bounds are empty.
// `termination` 0, or an image without an opaque tile: an empty mask. `image` is a kRgba image of a frame of width x height pixels.
// `known`: found earlier, before more was put behind the same image; what was hidden stays hidden and is not looked at again.
OcclusionMask FindHiddenTiles(const LocalImage& image, std::int32_t width, std::int32_t height, double termination,
                              OcclusionMask known = {});

}  // namespace slabstream
