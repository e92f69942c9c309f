// The magnitude of vectors, of which a source gives the components: the root of the sum of their squares, as float32. Missing (NaN) where
// a component is. Read in parts, at all levels, wherever the components are. At a coarser level it is the magnitude of that level's
// vectors.
#pragma once

#include <memory>
#include <vector>

#include "data/sources/volume_source.h"

namespace slabstream {

// `components`: at least one, of one grid, levels, time and files.
std::shared_ptr<VolumeSource> MagnitudeOf(std::vector<std::shared_ptr<VolumeSource>> components);

}  // namespace slabstream
