// StraightImage: the pixels of a finished picture in the codes that a PNG of 8 bits holds (StraightCodes, sample_codes.h).
#pragma once

#include <cstdint>

#include "common/image/pixel_bounds.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {

struct StraightImage {
  PixelBounds bounds;                // within the picture; may be empty
  PooledVector<std::uint8_t> codes;  // 4 * pixel_count: [y][x], top down without padding
};

// All pixels empty.
inline StraightImage MakeStraightImage(const PixelBounds& bounds) {
  return {bounds, PooledVector<std::uint8_t>(4 * std::size_t(bounds.pixel_count()), 0)};
}

}  // namespace slabstream
