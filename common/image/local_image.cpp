#include "common/image/local_image.h"

#include <limits>

namespace slabstream {

LocalImage MakeUnwrittenImage(PixelFormat format, const PixelBounds& bounds) {
  const auto pixels = std::size_t(bounds.pixel_count());
  LocalImage image;
  image.format = format;
  image.bounds = bounds;
  image.rgba.resize(4 * pixels);
  if (HasDepth(format)) image.depth.resize(pixels);
  if (HasVoxel(format)) image.voxel.resize(pixels);
  return image;
}

LocalImage MakeLocalImage(PixelFormat format, const PixelBounds& bounds) {
  LocalImage image = MakeUnwrittenImage(format, bounds);
  MakeEmpty(image, 0, std::size_t(bounds.pixel_count()));
  return image;
}

LocalImage MakeEmptyRows(PixelFormat format, const PixelBounds& bounds) {
  LocalImage image = MakeUnwrittenImage(format, bounds);
  image.rows.resize(std::size_t(bounds.height()));
  return image;
}

void FillRows(LocalImage& image) {
  const auto width = std::size_t(image.bounds.width());
  for (std::size_t y = 0; y < image.rows.size(); ++y) {
    MakeEmpty(image, y * width, y * width + image.rows[y].begin);
    MakeEmpty(image, y * width + image.rows[y].end, (y + 1) * width);
  }
  image.rows.clear();
}

void MakeEmpty(LocalImage& image, std::size_t begin, std::size_t end) {
  std::fill(image.rgba.data() + 4 * begin, image.rgba.data() + 4 * end, 0.0F);
  if (HasDepth(image.format)) std::fill(image.depth.data() + begin, image.depth.data() + end, std::numeric_limits<float>::infinity());
  if (HasVoxel(image.format)) std::fill(image.voxel.data() + begin, image.voxel.data() + end, 0U);
}

}  // namespace slabstream
