// PixelFormat: what a pixel of an image holds, and how two of them combine (common/kernels/combine.h).
//
// format      planes                    empty pixel        two pixels combine to
// kRgba       rgba                      alpha = 0          front over back (Porter and Duff 1984); rgba is premultiplied
// kDepth      rgba, depth, voxel index  depth = +infinity  the nearer one; equal depths: the one with the lower voxel index
// kRgbaDepth  rgba, depth               depth = +infinity  nothing: only finished pictures have it, made from kDepth
// kMaximum    rgba                      alpha = 0          the larger value in each channel
// kSum        rgba                      alpha = 0          the sum in each channel
// A renderer defines what the four channels of kMaximum and kSum mean. Their values are finite and >= 0, and combining does not depend on
// the order of images. Sums are exact, and so independent of the order as well, as long as a renderer adds integers below 2^24.
#pragma once

#include <cstddef>
#include <cstdint>

namespace slabstream {

enum class PixelFormat : std::uint8_t { kRgba = 1, kDepth = 2, kRgbaDepth = 3, kMaximum = 4, kSum = 5 };

constexpr bool HasDepth(PixelFormat format) { return format == PixelFormat::kDepth || format == PixelFormat::kRgbaDepth; }
constexpr bool HasVoxel(PixelFormat format) { return format == PixelFormat::kDepth; }

constexpr std::size_t BytesPerPixel(PixelFormat format) {
  return 4 * sizeof(float) + (HasDepth(format) ? sizeof(float) : 0) + (HasVoxel(format) ? sizeof(std::uint32_t) : 0);
}

}  // namespace slabstream
