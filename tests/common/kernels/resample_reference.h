// The definition of ResampleRows in plain code.
#pragma once

#include "common/kernels/resample.h"

namespace slabstream {

void ResampleRowsReference(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                           LocalImage& picture);

}  // namespace slabstream
