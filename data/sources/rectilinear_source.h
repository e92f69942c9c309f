// A rectilinear grid as it is: its voxels lie at their own places (common/volume/stretch.h), and nothing is resampled.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// A source whose axes are even becomes itself. Another one is described as its coordinates say (SourceInfo::uneven). InvalidArgument,
// naming `name`: coordinates that Stretch does not take; labels; several levels.
Result<std::shared_ptr<VolumeSource>> AsRectilinear(const std::string& name, std::shared_ptr<VolumeSource> source);

}  // namespace slabstream
