// Volume files that the user names on the command line: whatever is wrong with them is bad input.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {

// Whether it is worth trying: NotFound, or InvalidArgument naming the endings there are. Reads nothing.
Status CheckVolumePath(const std::string& path);

// ReadVolume, with damage of the file (DataLoss) told as InvalidArgument: here it is the input that is wrong, not a service.
Result<LoadedVolume> ReadInputVolume(const std::string& path);

}  // namespace slabstream
