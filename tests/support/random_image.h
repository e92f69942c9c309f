// Random local images for tests of image operators.
#pragma once

#include <cstdint>

#include "common/image/local_image.h"
#include "tests/support/random.h"

namespace slabstream {

// Bounds somewhere in `frame`; sometimes empty.
inline PixelBounds RandomBounds(Random& random, const PixelBounds& frame) {
  if (random.Chance(0.05)) return {};
  const int x = random.Integer(frame.x_begin, frame.x_end - 1), y = random.Integer(frame.y_begin, frame.y_end - 1);
  return {x, y, random.Integer(x + 1, frame.x_end), random.Integer(y + 1, frame.y_end)};
}

// About a third of the pixels is empty. Depths are few, so that they tie; voxels do not, as in pictures of disjoint boxes.
inline LocalImage RandomImage(Random& random, PixelFormat format, const PixelBounds& bounds) {
  LocalImage image = MakeLocalImage(format, bounds);
  for (std::int64_t i = 0; i < bounds.pixel_count(); ++i) {
    if (random.Chance(0.35)) continue;
    const auto pixel = std::size_t(i);
    const auto alpha = HasDepth(format) || random.Chance(0.2) ? 1.0F : float(random.Real(0.01, 1));
    for (std::size_t channel = 0; channel < 3; ++channel) image.rgba[4 * pixel + channel] = alpha * float(random.Real(0, 1));
    image.rgba[4 * pixel + 3] = alpha;
    if (HasDepth(format)) image.depth[pixel] = float(random.Integer(1, 8));
    if (HasVoxel(format)) image.voxel[pixel] = std::uint32_t(random.Integer(0, 1 << 30));
  }
  return image;
}

}  // namespace slabstream
