// The entry of libslabstream-pictures.so.
#include "client/pictures/picture_encoder.h"

namespace slabstream {

// By its name alone (kPictureEncoderEntry).
extern "C" __attribute__((visibility("default"))) PictureEncoder SlabstreamPictureEncoder(PictureFileType type) {
  return type == PictureFileType::kPdf || type == PictureFileType::kSvg ? EncodeByCairo : EncodeByOiio;
}

}  // namespace slabstream
