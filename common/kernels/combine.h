// The image operators, one for each pixel format (common/image/pixel_format.h), on whole local images and on run-encoded ones.
//
// Over (Porter and Duff 1984, premultiplied): out = front + (1 - front.alpha) * back, all four channels.
// Nearest: the nearer depth wins; equal depths go to the lower voxel index in serial-number order (NearerDepth), so that the order of
// operands does not matter.
// Maximum and sum, channel by channel.
#pragma once

#include <cstddef>
#include <span>

#include "common/image/image_view.h"
#include "common/image/local_image.h"

namespace slabstream {

// True if pixel (depth_a, voxel_a) hides (depth_b, voxel_b). Indices are compared modulo 2^32 by signed difference: voxels that can tie are
// neighbours, whose indices differ by far less than 2^31.
inline bool NearerDepth(float depth_a, std::uint32_t voxel_a, float depth_b, std::uint32_t voxel_b) {
  return depth_a < depth_b || (depth_a == depth_b && static_cast<std::int32_t>(voxel_a - voxel_b) < 0);
}

enum class Side : std::uint8_t { kFront, kBack };  // where the second image lies as seen from the first

// Combines `other` into `image`. `side` tells where `other` lies, which only matters for kRgba. Formats must agree. Bit-for-bit: Combine(a,
// b, kBack) equals Combine(b, a, kFront). If the bounds must grow they become `room`, which holds both. Room for all images to come saves
// growing again and costs nothing, since empty pixels are not written (LocalImage::rows).
void Combine(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room);
// The same for unchecked pixels, in memory that another process may even write to meanwhile. False: a pixel of the result where `other`
// has one is invalid (its colour is not finite, or its depth is NaN or -infinity); `image` is then useless.
[[nodiscard]] bool CombineUnchecked(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room);
// The same for runs from outside: checks them as ReadRuns does, while they are combined, and that the combined colours are finite.
// After an error `image` may hold some of them.
Status CombineRuns(LocalImage& image, const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame, Side side,
                   const PixelBounds& room);
// Combines on the union of both bounds; all pixels are stored.
void Combine(LocalImage& image, const LocalImage& other, Side side);

// Makes the pixels `pixels` of a frame `frame_width` wide empty.
void Erase(LocalImage& image, PixelRange pixels, std::int32_t frame_width);

// The row kernels. rgba rows hold 4 * pixel_count floats; rows do not alias, but out may equal front (first) or back (second). False: a
// written value is not finite; an operand that is not never gives a finite sum.
bool OverRow(const float* front, const float* back, float* out, std::size_t pixel_count);

// The larger value, and the sum, in each channel. Rows as above.
bool MaximumRow(const float* a, const float* b, float* out, std::size_t pixel_count);
bool SumRow(const float* a, const float* b, float* out, std::size_t pixel_count);

// A stretch of pixels of one row, to read or to write.
template <class Float, class Index>
struct RowOfPixels {
  Float* rgba;
  Float* depth;  // kDepth only, else null
  Index* voxel;  // kDepth only, else null
};
using SourcePixels = RowOfPixels<const float, const std::uint32_t>;
using TargetPixels = RowOfPixels<float, std::uint32_t>;

// Replaces pixels of `target` by those of `source` that are nearer. With depths; rows do not alias.
void NearestRow(const SourcePixels& source, const TargetPixels& target, std::size_t pixel_count);

}  // namespace slabstream
