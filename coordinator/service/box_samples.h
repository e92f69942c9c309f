// Samples of a box cut out of a volume, as the voxels plane sends them.
#pragma once

#include <cstdint>
#include <memory>

#include "common/memory/bytes.h"
#include "common/volume/volume.h"

namespace slabstream {

// Bytes [begin, end) of the samples of `box` in order, x fastest. If they are contiguous in the volume (a slab along z, whole rows), the
// result refers to the volume's own memory and keeps it alive; else they are copied row by row. `box` is inside the volume and not empty; 0
// <= begin < end <= voxel_count * BytesPerSample.
Bytes BoxSamples(const std::shared_ptr<const Volume>& volume, const Box& box, std::uint64_t begin, std::uint64_t end);

}  // namespace slabstream
