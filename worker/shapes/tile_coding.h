// A shape tile as bytes, on its way between workers. A tile without fragments has none. Others have
//   a u8 for each pixel, row by row    the number of its fragments with colours, and 128 more if an opaque one without a colour lies behind
//                                      them
//   the fragments with colours         by pixel, nearest first, each as five floats: depth, red, green, blue, alpha
//   the depths of the others           by pixel, as floats
// Boxes need no colours of opaque fragments (FrameShapes::TileForBoxes): 5 bytes a pixel, not 21.
#pragma once

#include <cstddef>
#include <span>

#include "common/base/status.h"
#include "common/memory/pooled_vector.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// `colors`: those of opaque fragments, too; the tile has them.
std::size_t BytesOf(const ShapeTile& tile, bool colors);
void AppendTile(const ShapeTile& tile, bool colors, PooledVector<std::byte>& bytes);

// DataLoss: the bytes are no tile of these pixels. Whether depths ascend in a pixel is not checked.
Result<ShapeTile> ReadTile(std::span<const std::byte> bytes, const PixelBounds& pixels);

}  // namespace slabstream
