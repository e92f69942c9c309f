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
  std::ranges::fill(image.rgba, 0.0F);
  std::ranges::fill(image.depth, std::numeric_limits<float>::infinity());
  std::ranges::fill(image.voxel, 0U);
  return image;
}

}  // namespace slabstream
