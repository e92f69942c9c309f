// The entry of libslabstream-pictures.so.
#include "client/picture_encoder/module_encoders.h"

namespace slabstream {

// By its name alone (kPictureEncoderEntry).
extern "C" __attribute__((visibility("default"))) const PictureEncoder* SlabstreamPictureEncoder(PictureFileType type) {
  const bool vectors = type == PictureFileType::kPdf || type == PictureFileType::kSvg;
  return vectors ? &CairoEncoder() : &OiioEncoder();
}

}  // namespace slabstream
