// PixelBounds and PixelRange: rectangles and linear ranges of the pixels of a frame.
#pragma once

#include <algorithm>
#include <cstdint>

namespace slabstream {

// Half-open pixel rectangle.
struct PixelBounds {
  std::int32_t x_begin = 0, y_begin = 0, x_end = 0, y_end = 0;

  constexpr std::int32_t width() const { return x_end - x_begin; }
  constexpr std::int32_t height() const { return y_end - y_begin; }
  constexpr bool empty() const { return x_end <= x_begin || y_end <= y_begin; }
  constexpr std::int64_t pixel_count() const { return empty() ? 0 : std::int64_t(width()) * height(); }
  constexpr bool Contains(const PixelBounds& b) const {
    return b.empty() || (b.x_begin >= x_begin && b.y_begin >= y_begin && b.x_end <= x_end && b.y_end <= y_end);
  }
  friend constexpr bool operator==(const PixelBounds&, const PixelBounds&) = default;
};

constexpr PixelBounds Intersection(const PixelBounds& a, const PixelBounds& b) {
  return {std::max(a.x_begin, b.x_begin), std::max(a.y_begin, b.y_begin), std::min(a.x_end, b.x_end), std::min(a.y_end, b.y_end)};
}
constexpr PixelBounds Union(const PixelBounds& a, const PixelBounds& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x_begin, b.x_begin), std::min(a.y_begin, b.y_begin), std::max(a.x_end, b.x_end), std::max(a.y_end, b.y_end)};
}

// Half-open range of linear pixel indices y * frame_width + x of the (supersampled) frame.
struct PixelRange {
  std::uint64_t begin = 0, end = 0;
  friend constexpr bool operator==(const PixelRange&, const PixelRange&) = default;
  friend constexpr auto operator<=>(const PixelRange&, const PixelRange&) = default;
};

// The whole rows of a frame that hold the pixels.
constexpr PixelBounds RowsOf(PixelRange pixels, const PixelBounds& frame) {
  const auto width = std::uint64_t(frame.width());
  return {0, std::int32_t(pixels.begin / width), frame.width(), std::int32_t((pixels.end + width - 1) / width)};
}

}  // namespace slabstream
