#include "common/image/local_image.h"

#include <limits>

namespace slabstream {

LocalImage MakeLocalImage(PixelFormat format, const PixelBounds& bounds) {
  const auto pixels = std::size_t(bounds.pixel_count());
  LocalImage image;
  image.format = format;
  image.bounds = bounds;
  image.rgba.resize(4 * pixels);
  if (format == PixelFormat::kDepth) {
    image.depth.resize(pixels, std::numeric_limits<float>::infinity());
    image.voxel.resize(pixels);
  }
  return image;
}

}  // namespace slabstream
