#include "common/image/picture_image.h"

#include <algorithm>

#include "common/image/sample_codes.h"

namespace slabstream {
namespace {

// Calls function(rgba) with the colours, floats or codes: four a pixel, row by row.
template <class Function>
auto VisitColors(const PictureImage& image, Function&& function) {
  return image.codes() != nullptr ? function(image.codes()->codes.data()) : function(image.floats()->rgba.data());
}

}  // namespace

void PictureImage::ReadColors(std::int32_t y, float* rgba) const {
  const auto width = std::size_t(bounds().width());
  const std::size_t first = 4 * width * std::size_t(y - bounds().y_begin);
  if (codes() != nullptr) {
    FromStraightCodes(codes()->codes.data() + first, width, rgba);
  } else {
    std::copy_n(floats()->rgba.data() + first, 4 * width, rgba);
  }
}

void PictureImage::ReadDepths(std::int32_t y, float* depth) const {
  const auto width = std::size_t(bounds().width());
  std::copy_n(floats()->depth.data() + width * std::size_t(y - bounds().y_begin), width, depth);
}

bool PictureImage::IsEmpty() const {
  return VisitColors(*this, [pixels = std::size_t(bounds().pixel_count())](const auto* rgba) {
    for (std::size_t i = 0; i < pixels; ++i) {
      if (rgba[4 * i + 3] > 0) return false;
    }
    return true;
  });
}

PixelBounds PictureImage::ContentBounds() const {
  const PixelBounds& b = bounds();
  const auto width = std::size_t(b.width()), height = std::size_t(b.height());
  std::size_t top = height, bottom = 0, left = width, right = 0;
  VisitColors(*this, [&](const auto* rgba) {
    for (std::size_t y = 0; y < height; ++y) {
      const auto shows = [row = rgba + 4 * y * width](std::size_t x) { return row[4 * x + 3] > 0; };
      std::size_t first = 0;
      while (first < width && !shows(first)) ++first;
      if (first == width) continue;
      std::size_t last = width;
      while (last > right && !shows(last - 1)) --last;
      top = std::min(top, y);
      bottom = y + 1;
      left = std::min(left, first);
      right = std::max(right, last);
    }
  });
  if (top == height) return {};
  return {b.x_begin + int(left), b.y_begin + int(top), b.x_begin + int(right), b.y_begin + int(bottom)};
}

}  // namespace slabstream
