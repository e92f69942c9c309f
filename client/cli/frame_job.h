// FrameJob: one of a sequence of frames.
#pragma once

#include <string>

#include "common/frame/frame_request.h"

namespace slabstream {

struct FrameJob {
  FrameRequest request;
  std::string output;  // the file that the picture goes into; empty: none
  std::string source;  // SOURCE as it was typed, for records of pictures
};

}  // namespace slabstream
