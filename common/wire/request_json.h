// A FrameRequest as JSON, for files that say how a picture was made: the fields of the schema's message (proto/slabstream/v1/frame.proto)
// under their names, with their defaults, all but the dataset. The same request gives the same text.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

std::string RequestToJson(const FrameRequest& request);

// The request, with this dataset. InvalidArgument, one line: not JSON of that message, or not a valid request.
Result<FrameRequest> RequestFromJson(const std::string& json, const std::string& dataset);

}  // namespace slabstream
