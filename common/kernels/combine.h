// The two image operators, on whole local images and on run-encoded ones.
//
// Over (Porter and Duff 1984, premultiplied): out = front + (1 - front.alpha) * back, all four channels.
// Nearest: the nearer depth wins; equal depths go to the lower voxel index in serial-number order (NearerDepth), so the result does not
// depend on the order of operands.
#pragma once

#include <cstddef>
#include <span>

#include "common/image/local_image.h"
#include "common/image/run_image.h"

namespace slabstream {

// True if pixel (depth_a, voxel_a) hides (depth_b, voxel_b). Indices are compared modulo 2^32 by signed difference: voxels that can tie are
// neighbours, whose indices differ by far less than 2^31.
inline bool NearerDepth(float depth_a, std::uint32_t voxel_a, float depth_b, std::uint32_t voxel_b) {
  return depth_a < depth_b || (depth_a == depth_b && static_cast<std::int32_t>(voxel_a - voxel_b) < 0);
}

enum class Side : std::uint8_t { kFront, kBack };  // where the second image lies as seen from the first

// Combines `other` into `image`; its bounds grow to the union where needed. `side` tells where `other` lies (kRgba only). Formats must
// agree. Bit-for-bit: Combine(a, b, kBack) equals Combine(b, a, kFront).
void Combine(LocalImage& image, const LocalImage& other, Side side);
void CombineRuns(LocalImage& image, const RunImageHeader& header, std::span<const std::byte> payload, Side side);

// The row kernels. rgba rows hold 4 * pixel_count floats; rows do not alias. out may equal front (first) or back (second).
void OverRow(const float* front, const float* back, float* out, std::size_t pixel_count);
void OverRowReference(const float* front, const float* back, float* out, std::size_t pixel_count);

}  // namespace slabstream
