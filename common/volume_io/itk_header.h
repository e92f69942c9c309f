// The geometry of a volume file as ITK understands it. ITK's exceptions and warnings end here.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/volume_io/raw_volume.h"

namespace itk {
class ImageIOBase;
}

namespace slabstream {

// Size, spacing, origin, directions and sample type; `rescale` is left alone. Further dimensions of size 1 are fine. InvalidArgument: not a
// file of this format, not three dimensions, several components a voxel, a side above kMaxVolumeSide, another sample type.
Result<RawHeader> ReadItkHeader(itk::ImageIOBase& io, const std::string& path, const std::string& format);

// What an ITK error says in the end: its last line, without the object's address.
std::string CauseOf(const std::string& description);

}  // namespace slabstream
