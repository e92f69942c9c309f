// A source without values: voxels that lie where those of another source do, all of them 0, and of which nothing is read. It is the volume
// of a dataset that has labels alone.
#pragma once

#include <memory>

#include "data/sources/volume_source.h"

namespace slabstream {

// Levels, blocks and files are those of `source`; it has one field at one time.
std::shared_ptr<VolumeSource> AsHollow(std::shared_ptr<VolumeSource> source);

}  // namespace slabstream
