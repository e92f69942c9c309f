// ShapeGrid: the shape tiles of a frame (worker/shapes draws them), numbered row by row.
#pragma once

#include <cstdint>

#include "common/image/pixel_bounds.h"

namespace slabstream {

inline constexpr std::int32_t kShapeTile = 64;  // pixels a side

struct ShapeGrid {
  explicit ShapeGrid(const PixelBounds& of) : frame(of) {}

  PixelBounds frame;  // begins at (0, 0)

  std::uint32_t columns() const { return std::uint32_t((frame.width() + kShapeTile - 1) / kShapeTile); }
  std::uint32_t rows() const { return std::uint32_t((frame.height() + kShapeTile - 1) / kShapeTile); }
  std::uint32_t count() const { return columns() * rows(); }
  // The tile that holds a pixel of the frame.
  std::uint32_t NumberOf(std::int32_t x, std::int32_t y) const {
    return std::uint32_t(y / kShapeTile) * columns() + std::uint32_t(x / kShapeTile);
  }
  PixelBounds PixelsOf(std::uint32_t tile) const {
    const auto x = std::int32_t(tile % columns()) * kShapeTile, y = std::int32_t(tile / columns()) * kShapeTile;
    return Intersection(frame, {x, y, x + kShapeTile, y + kShapeTile});
  }
  // visit(number) for each tile with pixels in `pixels`, which lie in the frame.
  template <class Visit>
  void ForEach(const PixelBounds& pixels, Visit&& visit) const {
    if (pixels.empty()) return;
    for (std::int32_t y = pixels.y_begin / kShapeTile; y <= (pixels.y_end - 1) / kShapeTile; ++y) {
      for (std::int32_t x = pixels.x_begin / kShapeTile; x <= (pixels.x_end - 1) / kShapeTile; ++x) {
        visit(std::uint32_t(y) * columns() + std::uint32_t(x));
      }
    }
  }
};

}  // namespace slabstream
