// The image operators, one for each pixel format (common/image/pixel_format.h), on whole local images and on run-encoded ones.
//
// Over (Porter and Duff 1984, premultiplied): out = front + (1 - front.alpha) * back, all four channels.
// Nearest: the nearer depth wins; equal depths go to the lower voxel index in serial-number order (NearerDepth), so the result does not
// depend on the order of operands.
// Maximum and sum, channel by channel.
#pragma once

#include <cstddef>
#include <span>

#include "common/image/image_view.h"
#include "common/image/local_image.h"
#include "common/image/run_image.h"

namespace slabstream {

// True if pixel (depth_a, voxel_a) hides (depth_b, voxel_b). Indices are compared modulo 2^32 by signed difference: voxels that can tie are
// neighbours, whose indices differ by far less than 2^31.
inline bool NearerDepth(float depth_a, std::uint32_t voxel_a, float depth_b, std::uint32_t voxel_b) {
  return depth_a < depth_b || (depth_a == depth_b && static_cast<std::int32_t>(voxel_a - voxel_b) < 0);
}

enum class Side : std::uint8_t { kFront, kBack };  // where the second image lies as seen from the first

// Combines `other` into `image`. `side` tells where `other` lies, which only kRgba asks. Formats must agree. Bit-for-bit: Combine(a, b,
// kBack) equals Combine(b, a, kFront). Where the bounds must grow they become `room`, which holds both: room for all that is still to come
// saves growing again, and costs nothing, since what is empty is not written (LocalImage::rows).
void Combine(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room);
// The same for pixels that nobody has looked at, in memory that another process may even write to meanwhile. False: a pixel where `other`
// has some now is none (its colour is not finite, or its depth is NaN or -infinity); `image` is then worth nothing.
[[nodiscard]] bool CombineUnchecked(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room);
// With runs that come from outside: checked as by ValidateRuns, while they are combined, and that the colours which come of it are finite.
// After an error `image` may hold some of them.
Status CombineRuns(LocalImage& image, const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame, Side side,
                   const PixelBounds& room);
// On the union of both bounds, all pixels stored.
void Combine(LocalImage& image, const LocalImage& other, Side side);

// Makes the pixels `pixels` of a frame `frame_width` wide empty.
void Erase(LocalImage& image, PixelRange pixels, std::int32_t frame_width);

// The row kernels. rgba rows hold 4 * pixel_count floats; rows do not alias. out may equal front (first) or back (second). False: some
// value that was written is not finite; an operand that is not never gives a sum that is.
bool OverRow(const float* front, const float* back, float* out, std::size_t pixel_count);
bool OverRowReference(const float* front, const float* back, float* out, std::size_t pixel_count);

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

// Pixels of `target` become those of `source` where that is nearer. With depths; rows do not alias.
void NearestRow(const SourcePixels& source, const TargetPixels& target, std::size_t pixel_count);
void NearestRowReference(const SourcePixels& source, const TargetPixels& target, std::size_t pixel_count);

}  // namespace slabstream
