// The jpeg encoding of Neuroglancer's precomputed volumes: a picture of any width and height with as many pixels as the chunk has voxels.
#pragma once

#include <cstdint>

#include "data/codecs/codecs.h"

namespace slabstream::precomputed {

// A codec for chunks of so many voxels. Decoded: one channel behind the other. DataLoss: no such picture.
SharedCodec JpegCodec(std::uint64_t voxels, int channels);

}  // namespace slabstream::precomputed
