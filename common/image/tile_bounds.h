// TileBounds: the pixels of one square tile of a frame.
#pragma once

#include <cstdint>

#include "common/image/pixel_bounds.h"

namespace slabstream {

// The pixels of tile (x, y), `side` x `side` of them, cut at the border of a frame of width x height pixels.
constexpr PixelBounds TileBounds(std::int32_t side, std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height) {
  return Intersection(PixelBounds{x * side, y * side, (x + 1) * side, (y + 1) * side}, {0, 0, width, height});
}

}  // namespace slabstream
