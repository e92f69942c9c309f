// A volume that is in memory already, as a source of one level.
#pragma once

#include <memory>

#include "data/sources/volume_source.h"

namespace slabstream {

// `info`: its levels and `exact` are made from the volume and, if it has some, its exact samples. Read copies on the thread that calls it.
// counts(): none, since nothing is stored.
std::shared_ptr<VolumeSource> MakeMemorySource(std::shared_ptr<const Volume> volume, SourceInfo info,
                                               std::shared_ptr<const ExactSamples> exact = nullptr);

}  // namespace slabstream
