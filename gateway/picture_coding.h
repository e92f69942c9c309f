// How a picture for a page is encoded.
#pragma once

#include <cstdint>

namespace slabstream {

enum class PictureCoding : std::uint8_t {
  kLossless,  // PNG
  kJpeg,
  kVideo,  // VP9 (video_encoder.h)
};

}  // namespace slabstream
