// Volume files that the user names on the command line: every error in them is bad input.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {

// NotFound: no such file. InvalidArgument: not a volume by its name (names the known endings). Reads nothing.
Status CheckVolumePath(const std::string& path);

// ReadVolume, but a damaged file (DataLoss) becomes InvalidArgument: here the input is wrong, not a service.
Result<LoadedVolume> ReadInputVolume(const std::string& path);

}  // namespace slabstream
