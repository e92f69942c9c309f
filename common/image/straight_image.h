// StraightImage: the pixels of a finished picture in the codes that a PNG of 8 bits holds (StraightCodes, sample_codes.h).
#pragma once

#include <cstdint>

#include "common/image/pixel_bounds.h"
#include "common/image/sample_codes.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {

struct StraightImage {
  PixelBounds bounds;                // within the picture; may have no pixels. Outside, it is transparent
  PooledVector<std::uint8_t> codes;  // 4 * pixel_count: [y][x], top down without padding
  Premultiplied behind = {};         // `codes` are those of the picture over this colour
};

// All pixels are `behind`.
inline StraightImage MakeStraightImage(const PixelBounds& bounds, const Premultiplied& behind = {}) {
  StraightImage image{bounds, PooledVector<std::uint8_t>(4 * std::size_t(bounds.pixel_count()), 0), behind};
  if (behind != Premultiplied{}) FillStraightCodes(behind, image.codes);
  return image;
}

}  // namespace slabstream
