// The block of metadata that JPEG and WebP files hold: the size of a pixel, the program and the record, as Exif 2.3 has them (CIPA DC-008).
#pragma once

#include <string>

#include "client/pictures/picture_encoder.h"

namespace slabstream {

// A TIFF header and one directory: XResolution and YResolution; Software, and the record as ImageDescription. Empty: there is nothing to
// say.
std::string ExifBlock(const EncodedFormat& format);

}  // namespace slabstream
