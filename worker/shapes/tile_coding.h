// A drawn tile as bytes, on its way between workers: of each pixel the number of its fragments (u8), row by row, then zeros up to a
// multiple of four bytes; then the fragments of all pixels in this order, each as five floats: depth, red, green, blue, alpha. A tile
// without fragments has no bytes.
#pragma once

#include <cstddef>
#include <span>

#include "common/base/status.h"
#include "common/memory/pooled_vector.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

std::size_t BytesOf(const ShapeTile& tile);
inline std::size_t BytesOfCounts(std::size_t pixels) { return (pixels + 3) / 4 * 4; }
inline std::size_t MostBytesOfTile(const PixelBounds& pixels) {
  const auto count = std::size_t(pixels.pixel_count());
  return BytesOfCounts(count) + count * kMostShapeFragments * sizeof(ShapeFragment);
}
void AppendTile(const ShapeTile& tile, PooledVector<std::byte>& bytes);

// DataLoss: the bytes are none of a tile of these pixels. The fragments' order is taken as it comes.
Result<ShapeTile> ReadTile(std::span<const std::byte> bytes, const PixelBounds& pixels);

}  // namespace slabstream
