// The encoders of libslabstream-pictures.so.
#pragma once

#include "client/picture_encoder/picture_encoder.h"

namespace slabstream {

const PictureEncoder& OiioEncoder();   // EXR and TIFF
const PictureEncoder& CairoEncoder();  // PDF and SVG

}  // namespace slabstream
