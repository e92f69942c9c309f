// Openness and transmittance of a light volume, side by side as FrameLight has them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/memory/pooled_vector.h"
#include "worker/light/frame_light.h"

namespace slabstream {

// Shares in 1/255 by voxel: rows along x (then y, then z), or along y (then z, then x).
using Bytes255 = UnwrittenVector<std::uint8_t>;

// Writes the shares of light `number`. `open`: in light.fast's order; `reached`: in that of `reached_fast`. Empty: 255 everywhere.
// Parallel.
void PackShares(const Bytes255& open, const Bytes255& reached, int reached_fast, std::size_t number, FrameLight& light);

// Rows along y, of rows along x. Parallel.
Bytes255 TurnedBytes(const Bytes255& along_x, const Index3& size);

}  // namespace slabstream
