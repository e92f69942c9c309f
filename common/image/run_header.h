// RunImageHeader: what travels beside the payload of a run image (run_image.h has the layout of the payload).
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/image/color_coding.h"
#include "common/image/pixel_bounds.h"
#include "common/image/pixel_format.h"

namespace slabstream {

struct RunImageHeader {
  PixelFormat format = PixelFormat::kRgba;
  PixelBounds bounds;  // within the frame
  std::uint32_t run_count = 0;
  std::uint64_t pixel_count = 0;              // in all runs
  ColorCoding color = ColorCoding::kFloat32;  // one that MayCode
  friend bool operator==(const RunImageHeader&, const RunImageHeader&) = default;
};

// Whether images of this format may travel in this coding. Colours that combining leaves as they are may have 8 bits.
constexpr bool MayCode(PixelFormat format, ColorCoding color) {
  return color == ColorCoding::kFloat32 || format == PixelFormat::kRgba ||
         (format == PixelFormat::kDepth && color == ColorCoding::kStraight8);
}

constexpr bool IsDense(const RunImageHeader& header) { return header.run_count == 0 && header.pixel_count > 0; }
std::size_t PayloadBytes(const RunImageHeader& header);

}  // namespace slabstream
