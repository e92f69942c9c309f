// A rectilinear grid on even voxels, so that every renderer can draw it: values are interpolated linearly along each axis, box by box.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// A source whose axes are even becomes itself. Another one is resampled along its uneven axes (SourceInfo::uneven): on `voxels` each, or,
// if that is 0, on so many that none is longer than the shortest distance there. Values become float32. InvalidArgument, naming `name`:
// fewer voxels than the source has along the axis, or more than kMaxVolumeSide; labels; several levels.
Result<std::shared_ptr<VolumeSource>> MakeEven(const std::string& name, std::shared_ptr<VolumeSource> source, std::int32_t voxels);

}  // namespace slabstream
