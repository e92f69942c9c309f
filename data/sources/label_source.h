// A source whose samples are labels (common/volume/labels.h), exactly as they are in the file, whatever type the file has for them.
#pragma once

#include <memory>

#include "data/sources/volume_source.h"

namespace slabstream {

// Its samples are uint8, uint16, uint32 or uint64, and its mapping is none. Reads end with InvalidArgument if a sample is no label, which
// is a whole number of at least 0.
std::shared_ptr<VolumeSource> AsLabels(std::shared_ptr<VolumeSource> source);

}  // namespace slabstream
