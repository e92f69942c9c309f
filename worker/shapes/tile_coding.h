// A drawn tile as bytes, on its way between workers. A tile without fragments has none. Others have
//   a u8 for each pixel, row by row    the number of its fragments, and 128 more if it ends with an opaque one without a colour, which that
//                                      number leaves out; then zeros up to a multiple of four bytes
//   the fragments of all pixels        in this order, nearest first, each as five floats: depth, red, green, blue, alpha
//   the depths of those without colours, as floats, in this order
// Boxes need no colours of opaque fragments (FrameShapes::TileForBoxes), which makes 5 bytes of 21.
#pragma once

#include <cstddef>
#include <span>

#include "common/base/status.h"
#include "common/memory/pooled_vector.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// `colors`: those of opaque fragments, too; the tile has them.
std::size_t BytesOf(const ShapeTile& tile, bool colors);
inline std::size_t BytesOfCounts(std::size_t pixels) { return (pixels + 3) / 4 * 4; }
inline std::size_t MostBytesOfTile(const PixelBounds& pixels) {
  const auto count = std::size_t(pixels.pixel_count());
  return BytesOfCounts(count) + count * kMostShapeFragments * sizeof(ShapeFragment);
}
void AppendTile(const ShapeTile& tile, bool colors, PooledVector<std::byte>& bytes);

// DataLoss: the bytes are none of a tile of these pixels. The fragments' order is taken as it comes.
Result<ShapeTile> ReadTile(std::span<const std::byte> bytes, const PixelBounds& pixels);

}  // namespace slabstream
