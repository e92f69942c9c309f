// A box of one level of another source, as a source of one level.
#pragma once

#include <memory>

#include "data/sources/volume_source.h"

namespace slabstream {

// Its voxels lie where they lie in `source`. `box` is not empty and lies inside the level.
std::shared_ptr<VolumeSource> MakePartSource(std::shared_ptr<VolumeSource> source, int level, const Box& box);

}  // namespace slabstream
