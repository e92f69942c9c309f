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
  ColorCoding color = ColorCoding::kFloat32;  // formats but kRgba: always
  friend bool operator==(const RunImageHeader&, const RunImageHeader&) = default;
};

constexpr bool IsDense(const RunImageHeader& header) { return header.run_count == 0 && header.pixel_count > 0; }
std::size_t PayloadBytes(const RunImageHeader& header);

}  // namespace slabstream
