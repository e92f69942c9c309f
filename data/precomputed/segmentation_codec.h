// The compressed_segmentation encoding of Neuroglancer's precomputed volumes: blocks of voxels, each with a table of the labels in it.
// Source: https://github.com/google/neuroglancer/tree/master/src/sliceview/compressed_segmentation
#pragma once

#include <array>
#include <cstdint>

#include "data/codecs/codecs.h"

namespace slabstream::precomputed {

// A codec for chunks of `size` voxels along x, y and z, x fastest, one channel behind the other. `block`: voxels along
// each axis of a block. `label_bytes`: 4 or 8. DataLoss: damaged.
SharedCodec SegmentationCodec(const std::array<std::uint64_t, 3>& size, const std::array<std::uint64_t, 3>& block, std::uint64_t channels,
                              std::size_t label_bytes);

}  // namespace slabstream::precomputed
