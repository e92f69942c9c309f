// `info` of pictures: what the file states, and how the picture was made.
#pragma once

#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

// `options.path` ends as a picture's does (IsPicturePath).
Status RunPictureInfo(const InfoOptions& options);

}  // namespace slabstream
