// ReadPart: some of the bytes of a box of a source, in the order in which a box in memory has them. It is how chunks of the voxels plane
// are read.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/volume/box.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// Bytes [begin, begin + bytes) of the samples of `box`, x fastest; `box` lies inside the level, and the bytes inside the box. Whole rows of
// the box are read. Calls `done` exactly once, on any thread, perhaps before this returns. Errors of VolumeSource::Read.
void ReadPart(const std::shared_ptr<VolumeSource>& source, int level, const Box& box, std::uint64_t begin, std::uint64_t bytes,
              std::function<void(Result<Bytes>)> done);

}  // namespace slabstream
